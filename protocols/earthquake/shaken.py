"""How well the table did what it was asked: the achieved motion of one test beside the record."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION
from bench.control.passes import SpectrumCheck
from protocols.earthquake.records import Shaking

Array = NDArray[np.float64]

PERIODS = (0.1, 1.0)
"""Periods [s] between which response spectra are compared."""


@dataclass(frozen=True)
class Tracking:
    """Errors relative to the record, both seen through the record's band: rms over rms, and of the spectrum."""

    error: float
    spectrum_error: float


def tracking(shaking: Shaking, signals: Array) -> Tracking:
    """Of `signals`, shape (n, len(SIGNALS)), that begin with the record's drive and may go on after it."""
    target = shaking.target
    moved = _seen(shaking, signals)
    wanted = _windowed(shaking, target.acceleration)
    check = SpectrumCheck(wanted, target.sample_rate, PERIODS, ())
    return Tracking(_rms(moved - wanted) / _rms(wanted), check.error(moved))


def difference(shaking: Shaking, signals: Array, others: Array) -> float:
    """Rms difference between the motions of two tests over the record's rms, within its band."""
    wanted = _windowed(shaking, shaking.target.acceleration)
    return _rms(_seen(shaking, signals) - _seen(shaking, others)) / _rms(wanted)


def _seen(shaking: Shaking, signals: Array) -> Array:
    return _windowed(shaking, signals[: shaking.target.acceleration.size, ACCELERATION])


def _windowed(shaking: Shaking, acceleration: Array) -> Array:
    return np.fft.irfft(shaking.target.window * np.fft.rfft(acceleration), acceleration.size)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
