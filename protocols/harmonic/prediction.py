"""The gain spectra that the model expects, computed and stored before the first sample moves."""

import numpy as np
from numpy.typing import NDArray

from bench.prediction.bands import bands
from bench.record.tables import Column, Table
from protocols.harmonic.parameters import HarmonicParameters
from sim.errors import InvalidInput
from sim.gain import gain_spectrum
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Specimen

STEP = 0.05
"""Distance of the frequencies of a spectrum [rad/s]."""

MARGIN = 1.0
"""How far a spectrum goes beyond the measured frequencies [rad/s]."""


def gain_spectra(parameters: HarmonicParameters, specimen: Specimen, known: SpecimenKnowledge) -> Table:
    """alpha_2 against Omega for every spring and layer, at the asked amplitude: one row per layer that exists.

    Its band, k = 2 and to first order, is what is left open of the specimen.
    """
    amplitude = parameters.amplitude_factor * specimen.uplift_acceleration
    omegas = _frequencies(parameters.omega)
    rows = [
        (prediction.omega, beta, layer, name)
        for beta in parameters.beta
        for prediction in gain_spectrum(specimen.coupled(beta), omegas, amplitude)
        for name, layer in prediction.layers.items()
    ]
    if not rows:
        raise InvalidInput("specimen", "as configured", "no steady motion of it is known at the asked frequencies")
    omega, beta, layers, names = (list(column) for column in zip(*rows, strict=True))
    alpha_2 = np.array([layer.alpha_2 for layer in layers])
    band = bands([layer.orbit for layer in layers], alpha_2, known)
    return {
        "omega": Column(np.array(omega), "rad/s", "circular frequency of the base motion"),
        "beta": Column(np.array(beta), "1", "stiffness ratio of the coupling spring"),
        "alpha_1": Column(np.array([layer.alpha_1 for layer in layers]), "1", "gain of the peak of u1"),
        "alpha_2": Column(alpha_2, "1", "gain of the peak drift"),
        "alpha_2_uncertainty": Column(band.uncertainty, "1", "expanded uncertainty of alpha_2 (k = 2), specimen's"),
        "alpha_2_low": Column(band.low, "1", "where the band of alpha_2 begins"),
        "alpha_2_high": Column(band.high, "1", "where the band of alpha_2 ends"),
        "stable": Column(np.array([layer.stable for layer in layers]), "1", "whether the motion is stable"),
        "layer": Column(np.array(names), "", "rocking, or resting where the block never lifts"),
    }


def _frequencies(measured: tuple[float, ...]) -> NDArray[np.float64]:
    low, high = max(min(measured) - MARGIN, STEP), max(measured) + MARGIN
    return np.linspace(low, high, round((high - low) / STEP) + 1)
