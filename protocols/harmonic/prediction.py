"""The gain spectra that the model expects, computed and stored before the first sample moves."""

import numpy as np
from numpy.typing import NDArray

from bench.record.tables import Column, Table
from protocols.harmonic.parameters import HarmonicParameters
from sim.errors import InvalidInput
from sim.gain import gain_spectrum
from sim.specimen import Specimen

STEP = 0.05
"""Distance of the frequencies of a spectrum [rad/s]."""

MARGIN = 1.0
"""How far a spectrum goes beyond the measured frequencies [rad/s]."""


def gain_spectra(parameters: HarmonicParameters, specimen: Specimen) -> Table:
    """alpha_2 against Omega for every spring and layer, at the asked amplitude: one row per layer that exists."""
    amplitude = parameters.amplitude_factor * specimen.uplift_acceleration
    omegas = _frequencies(parameters.omega)
    rows = [
        (prediction.omega, beta, layer.alpha_1, layer.alpha_2, layer.stable, name)
        for beta in parameters.beta
        for prediction in gain_spectrum(specimen.coupled(beta), omegas, amplitude)
        for name, layer in prediction.layers.items()
    ]
    if not rows:
        raise InvalidInput("specimen", "as configured", "no steady motion of it is known at the asked frequencies")
    omega, beta, alpha_1, alpha_2, stable, layer = (list(column) for column in zip(*rows, strict=True))
    return {
        "omega": Column(np.array(omega), "rad/s", "circular frequency of the base motion"),
        "beta": Column(np.array(beta), "1", "stiffness ratio of the coupling spring"),
        "alpha_1": Column(np.array(alpha_1), "1", "gain of the peak of u1"),
        "alpha_2": Column(np.array(alpha_2), "1", "gain of the peak drift"),
        "stable": Column(np.array(stable), "1", "whether the motion is stable"),
        "layer": Column(np.array(layer), "", "rocking, or resting where the block never lifts"),
    }


def _frequencies(measured: tuple[float, ...]) -> NDArray[np.float64]:
    low, high = max(min(measured) - MARGIN, STEP), max(measured) + MARGIN
    return np.linspace(low, high, round((high - low) / STEP) + 1)
