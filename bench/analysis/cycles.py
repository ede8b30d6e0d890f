"""Fourier coefficients of each cycle of a dwell, by least squares at a known frequency (IEEE 1057, joint harmonics).

A fit over one cycle does not require an integer number of samples, averages the noise over all of them, and yields the
peak of the motion without the upward bias of the largest noisy sample.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import DRIFT, LASER_1, LASER_2

HARMONICS = 10
"""Number of jointly fitted harmonics; the higher harmonics of a rocking frame's drift are below 1e-5 of its peak."""

TRACES = (DRIFT, LASER_1, LASER_2)
"""Signals whose samples are kept with a cycle."""

COMPLETE = 0.98
"""Minimum fraction of valid samples in a cycle: with fewer, a laser that leaves its range at every peak would bias the
fit.
"""

_GRID = 256
_ANGLES: NDArray[np.float64] = np.arange(_GRID, dtype=np.float64) * (tau / _GRID)


def harmonic_basis(phase: NDArray[np.float64], harmonics: int) -> NDArray[np.float64]:
    """Columns 1, cos(k phase) and sin(k phase) for k = 1 to harmonics; shape (n, 1 + 2 harmonics)."""
    turns = np.exp(1j * phase)
    powers = np.cumprod(np.broadcast_to(turns[:, None], (phase.size, harmonics)), axis=1)
    basis = np.ones((phase.size, 1 + 2 * harmonics))
    basis[:, 1 : 1 + harmonics] = powers.real
    basis[:, 1 + harmonics :] = powers.imag
    return basis


@lru_cache(maxsize=HARMONICS)
def _period(harmonics: int) -> NDArray[np.float64]:
    """`harmonic_basis` at `_GRID` equally spaced phases of one period."""
    return harmonic_basis(_ANGLES, harmonics)


@dataclass(frozen=True)
class Cycle:
    """One cycle of the drive. The last of the m columns is for the drive [V], the others are for the signals.

    `coefficients`, shape (1 + 2 H, m): mean, cosines and sines of the harmonics of phase = omega (sample index) / rate.
    `fundamental` holds the complex amplitudes c with signal = Re(c exp(-i phase)); `peak` is the largest magnitude of
    the fitted motion, including its mean; `noise` is the rms of the residual; shape (m,) each. `extreme`, shape (m,),
    is the largest magnitude of the smoothed samples. It replaces `peak` for an unsteady motion, which the fit
    overshoots because the motion differs between the two ends of the cycle. `traces` [m], shape (n, 3), are all samples
    of the drift and of both lasers, missing ones interpolated; no rows if there are no such signals. `first` is the
    index of the first sample, counted like the phase, and `phases` [rad] are its phase and the phase between samples.
    """

    index: int
    samples: int
    coefficients: NDArray[np.float64]
    fundamental: NDArray[np.complex128]
    peak: NDArray[np.float64]
    extreme: NDArray[np.float64]
    noise: NDArray[np.float64]
    traces: NDArray[np.float32]
    first: int = 0
    phases: tuple[float, float] = (0.0, 0.0)

    @property
    def fitted(self) -> int:
        """Number of fitted harmonics."""
        return (self.coefficients.shape[0] - 1) // 2

    def harmonics(self, column: int) -> NDArray[np.complex128]:
        """Complex amplitudes z_k of one signal, shape (HARMONICS,): the signal is its mean plus Im(sum of z_k exp(i k
        phase)).

        Harmonics that were not fitted are zero; those above HARMONICS are omitted.
        """
        fitted = self.fitted
        found = np.zeros(HARMONICS, dtype=np.complex128)
        cosines, sines = self.coefficients[1 : 1 + fitted, column], self.coefficients[1 + fitted :, column]
        found[:fitted] = (sines + 1j * cosines)[:HARMONICS]
        return found


def fit_cycle(
    index: int, phase: NDArray[np.float64], values: NDArray[np.float64], highest: int = HARMONICS, first: int = 0
) -> Cycle | None:
    """Fit samples `values`, shape (n, m), at `phase` [rad] up to the harmonic `highest`, or up to a lower harmonic if
    there are few samples. Returns None if too many samples are missing (NaN) or there are too few for one harmonic.
    """
    finite = np.isfinite(values)
    share, traces, every = 1.0, _traces(values, finite), phase
    if not finite.all():
        valid = finite.all(axis=1)
        phase, values, share = phase[valid], values[valid], valid.mean()
    harmonics = min(highest, (phase.size - 1) // 4)
    if share < COMPLETE or harmonics < 1:
        return None
    basis = harmonic_basis(phase, harmonics)
    coefficients: NDArray[np.float64] = np.linalg.solve(basis.T @ basis, basis.T @ values).astype(np.float64)
    residual = values - basis @ coefficients
    waveform = _period(harmonics) @ coefficients
    return Cycle(
        index=index,
        samples=phase.size,
        coefficients=coefficients,
        fundamental=coefficients[1] + 1j * coefficients[harmonics + 1],
        peak=_peak(waveform),
        extreme=extremes(values),
        noise=np.sqrt(np.mean(residual**2, axis=0)),
        traces=traces,
        first=first,
        phases=(float(every[0]), float(every[1] - every[0])),
    )


def _traces(values: NDArray[np.float64], finite: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Samples of the signals TRACES, with missing ones interpolated."""
    if values.shape[1] <= max(TRACES):
        return np.zeros((0, len(TRACES)), dtype=np.float32)
    found = values[:, TRACES].astype(np.float32)
    if not finite.all():
        places = np.arange(len(values))
        for trace, column in zip(found.T, TRACES, strict=True):
            valid = finite[:, column]
            if valid.any():
                trace[~valid] = np.interp(places[~valid], places[valid], values[valid, column])
    return found


SHARE = 16
"""Reciprocal of the fraction of a cycle to which a parabola is fitted. Its vertex is the peak, with averaged noise; the
relative error of the vertex is 5e-6 for a sine and 3e-3 for a fifth harmonic.
"""


@lru_cache(maxsize=8)
def parabola(points: int) -> NDArray[np.float64]:
    """Matrix that fits a parabola by least squares to `points` samples at x = -h, ..., h, with h = points // 2; its
    rows give the coefficients of 1, x and x^2.
    """
    x = np.arange(points, dtype=np.float64) - points // 2
    return np.linalg.pinv(np.stack([np.ones_like(x), x, x**2], axis=1)).astype(np.float64)


def extremes(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest magnitude of each column of samples, shape (n, m), smoothed by a parabola around it."""
    magnitude = np.abs(values)
    half = max(len(values) // (2 * SHARE), 1)
    top: NDArray[np.intp] = np.argmax(magnitude, axis=0)
    rows = np.arange(-half, half + 1)[:, None] + np.clip(top, half, len(values) - 1 - half)
    fit: NDArray[np.float64] = parabola(2 * half + 1) @ magnitude[rows, np.arange(top.size)]
    level, slope, bend = fit[0], fit[1], fit[2]
    # a vertex beyond the window is clipped to its end
    ends: NDArray[np.float64] = half * np.sign(slope)
    vertex: NDArray[np.float64] = np.where(bend < 0.0, -0.5 * slope / np.where(bend < 0.0, bend, -1.0), ends)
    x = np.clip(vertex, -float(half), float(half))
    return level + slope * x + bend * x**2


def mean_amplitude(cycles: Sequence[Cycle], column: int) -> float:
    """Mean, over cycles, of the magnitude of one signal's fundamental."""
    return float(np.mean([abs(cycle.fundamental[column]) for cycle in cycles]))


@dataclass(frozen=True, eq=False)
class Waves:
    """The mean of many cycles.

    `waveform` and `rates`, its derivative with respect to the phase [1/rad], both of shape (k, m), cover one period;
    `peaks`, shape (m,), are the largest magnitudes, interpolated around row `at` of the waveform; `there`, shape (n,
    m), is each cycle's value in that row, positive in the direction of the peak. `harmonics`, shape (m,), is the rms of
    all harmonics above the fundamental, divided by the fundamental.
    """

    waveform: NDArray[np.float64]
    rates: NDArray[np.float64]
    at: NDArray[np.intp]
    peaks: NDArray[np.float64]
    there: NDArray[np.float64]
    harmonics: NDArray[np.float64]


def mean_waves(cycles: Sequence[Cycle], bound: Mapping[int, int] | None = None) -> Waves:
    """Mean of the cycles' coefficients. Unlike a mean of peaks, it is not biased by noise.

    Harmonics that were not fitted in all cycles, because some have few samples, are omitted.

    `bound` maps a column to the highest harmonic of its signal; the mean and the higher harmonics of that signal are
    set to zero.
    """
    harmonics = min(cycle.fitted for cycle in cycles)
    all_coefficients = np.array([_up_to(harmonics, cycle) for cycle in cycles])
    orders: NDArray[np.float64] = np.arange(1, harmonics + 1, dtype=np.float64)
    for column, highest in (bound or {}).items():
        all_coefficients[:, np.concatenate(([0.0], orders, orders)) > highest, column] = 0.0
        all_coefficients[:, 0, column] = 0.0
    mean = all_coefficients.mean(axis=0)
    basis = _period(harmonics)
    waveform = basis @ mean
    at = np.argmax(np.abs(waveform), axis=0)
    sign = np.sign(np.take_along_axis(waveform, at[None, :], axis=0)[0])
    there = sign * np.einsum("mk,nkm->nm", basis[at], all_coefficients)
    power = mean[1 : harmonics + 1] ** 2 + mean[harmonics + 1 :] ** 2
    fundamental = np.where(power[0] > 0.0, power[0], np.inf)
    cosines, sines = mean[1 : harmonics + 1], mean[harmonics + 1 :]
    turned = np.concatenate((np.zeros_like(mean[:1]), orders[:, None] * sines, -orders[:, None] * cosines))
    return Waves(
        waveform=waveform,
        rates=basis @ turned,
        at=at,
        peaks=_peak(waveform),
        there=there,
        harmonics=np.sqrt(power[1:].sum(axis=0) / fundamental),
    )


def _up_to(harmonics: int, cycle: Cycle) -> NDArray[np.float64]:
    """Coefficients of a cycle up to a harmonic."""
    coefficients, fitted = cycle.coefficients, cycle.fitted
    if fitted == harmonics:
        return coefficients
    return np.concatenate((coefficients[: 1 + harmonics], coefficients[1 + fitted : 1 + fitted + harmonics]))


def _peak(waveform: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest magnitude of each periodic column, refined by a parabola through three points."""
    magnitude = np.abs(waveform)
    at: NDArray[np.intp] = np.argmax(magnitude, axis=0)
    columns: NDArray[np.intp] = np.arange(at.size)
    left, top, right = (magnitude[(at + shift) % _GRID, columns] for shift in (-1, 0, 1))
    bend = left - 2.0 * top + right
    shift = np.where(bend < 0.0, 0.5 * (left - right) / np.where(bend < 0.0, bend, -1.0), 0.0)
    return top - 0.25 * (left - right) * shift


class CycleAnalyser:
    """Splits a stream of samples into cycles of `omega` [rad/s] and fits each cycle when it is complete."""

    def __init__(self, omega: float, sample_rate: float, first: int, highest: int = HARMONICS) -> None:
        self._highest = highest
        self._step = omega / sample_rate
        self._first = first
        self._start = first
        self._count = 0
        self._pending: list[NDArray[np.float64]] = []
        self._held = 0

    @property
    def completed(self) -> int:
        """Number of completed cycles, including those without a fit."""
        return self._count

    @property
    def first(self) -> int:
        """Index of the first sample of the first cycle."""
        return self._first

    def start_of(self, cycle: int) -> int:
        """Index of the first sample of a cycle."""
        return self._first + ceil(cycle * tau / self._step)

    def push(self, values: NDArray[np.float64]) -> list[Cycle]:
        """Process the next samples, shape (n, m); returns the fits of the cycles that they complete."""
        self._pending.append(values)
        self._held += values.shape[0]
        if self._start + self._held < self._end():
            return []
        queue = np.concatenate(self._pending)
        cycles: list[Cycle] = []
        while self._start + queue.shape[0] >= self._end():
            n = self._end() - self._start
            phase = self._step * np.arange(self._start, self._start + n, dtype=np.float64)
            cycle = fit_cycle(self._count, phase, queue[:n], self._highest, self._start)
            if cycle is not None:
                cycles.append(cycle)
            queue = queue[n:]
            self._start += n
            self._count += 1
        self._pending, self._held = [queue], queue.shape[0]
        return cycles

    def _end(self) -> int:
        return self.start_of(self._count + 1)
