"""Predictions of the model as tables: modes, time histories, steady motions, spectra, maps."""
