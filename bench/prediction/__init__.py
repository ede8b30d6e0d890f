"""Model predictions as tables: modes, time histories, steady motions, spectra, maps."""
