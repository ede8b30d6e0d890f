"""Each cycle of a dwell as Fourier coefficients: least squares on a known frequency (IEEE 1057, joint harmonics).

A fit over one cycle needs no whole number of samples, averages the noise of hundreds of samples, and gives the peak
of the motion without the upward bias of picking the largest noisy sample.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, tau

import numpy as np
from numpy.typing import NDArray

HARMONICS = 10
"""Harmonics fitted jointly: the drift of a rocking frame has less than 1e-5 of its peak above them."""

COMPLETE = 0.98
"""Share of a cycle's samples that must be there: a laser that leaves its range at every peak would bias the fit."""

_GRID = 256
_ANGLES: NDArray[np.float64] = np.arange(_GRID, dtype=np.float64) * (tau / _GRID)


def _basis(phase: NDArray[np.float64], harmonics: int) -> NDArray[np.float64]:
    """Columns 1, cos k phase, sin k phase for k = 1..harmonics; shape (n, 1 + 2 harmonics)."""
    turns = np.exp(1j * phase)
    powers = np.cumprod(np.broadcast_to(turns[:, None], (phase.size, harmonics)), axis=1)
    basis = np.ones((phase.size, 1 + 2 * harmonics))
    basis[:, 1 : 1 + harmonics] = powers.real
    basis[:, 1 + harmonics :] = powers.imag
    return basis


@dataclass(frozen=True)
class Cycle:
    """One cycle of the drive's period. The last column of every array is the drive [V], the others the signals.

    `coefficients`, shape (1 + 2 H, m): mean, cosines and sines of the harmonics of phase = omega (sample index) / rate.
    `fundamental` are complex amplitudes c with signal = Re(c exp(-i phase)); `peak` is the largest magnitude of the
    fitted motion, its mean included; `noise` the residual's rms; shape (m,) each.
    """

    index: int
    samples: int
    coefficients: NDArray[np.float64]
    fundamental: NDArray[np.complex128]
    peak: NDArray[np.float64]
    noise: NDArray[np.float64]

    def harmonics(self, column: int) -> NDArray[np.complex128]:
        """Complex amplitudes z_k of one signal, shape (HARMONICS,): it is Im(sum of z_k exp(i k phase)) and its mean.

        Harmonics that were not fitted are zero, higher ones are left out.
        """
        fitted = (self.coefficients.shape[0] - 1) // 2
        found = np.zeros(HARMONICS, dtype=np.complex128)
        cosines, sines = self.coefficients[1 : 1 + fitted, column], self.coefficients[1 + fitted :, column]
        found[:fitted] = (sines + 1j * cosines)[:HARMONICS]
        return found


def fit_cycle(
    index: int, phase: NDArray[np.float64], values: NDArray[np.float64], highest: int = HARMONICS
) -> Cycle | None:
    """Fit samples `values`, shape (n, m), at `phase` [rad] up to harmonic `highest`, as far as they tell it apart.

    None where too many samples are missing (NaN).
    """
    valid = np.isfinite(values).all(axis=1)
    if not valid.all():
        phase, values = phase[valid], values[valid]
    harmonics = min(highest, (phase.size - 1) // 4)
    if valid.mean() < COMPLETE or harmonics < 1:
        return None
    basis = _basis(phase, harmonics)
    coefficients: NDArray[np.float64] = np.linalg.solve(basis.T @ basis, basis.T @ values).astype(np.float64)
    residual = values - basis @ coefficients
    waveform = _basis(_ANGLES, harmonics) @ coefficients
    return Cycle(
        index=index,
        samples=phase.size,
        coefficients=coefficients,
        fundamental=coefficients[1] + 1j * coefficients[harmonics + 1],
        peak=_peak(waveform),
        noise=np.sqrt(np.mean(residual**2, axis=0)),
    )


def mean_amplitude(cycles: Sequence[Cycle], column: int) -> float:
    """Mean over cycles of the magnitude of one signal's fundamental."""
    return float(np.mean([abs(cycle.fundamental[column]) for cycle in cycles]))


@dataclass(frozen=True, eq=False)
class Waves:
    """The mean of many cycles.

    `waveform` and its `rates` [per rad of phase], shape (k, m), over one period; `peaks`, shape (m,), are the largest
    magnitudes, in row `at` of the waveform; `there`, (n, m), is each cycle's magnitude at it. `harmonics`, (m,), are
    the rms of all above the fundamental over the fundamental.
    """

    waveform: NDArray[np.float64]
    rates: NDArray[np.float64]
    at: NDArray[np.intp]
    peaks: NDArray[np.float64]
    there: NDArray[np.float64]
    harmonics: NDArray[np.float64]


def mean_waves(cycles: Sequence[Cycle], bound: Mapping[int, int] | None = None) -> Waves:
    """The mean is taken of the coefficients, so that noise does not raise the peak as a mean of peaks would.

    `bound` tells for a column that its signal has no mean and no harmonics above the given one.
    """
    all_coefficients = np.array([cycle.coefficients for cycle in cycles])
    harmonics = (all_coefficients.shape[1] - 1) // 2
    orders: NDArray[np.float64] = np.arange(1, harmonics + 1, dtype=np.float64)
    for column, highest in (bound or {}).items():
        all_coefficients[:, np.concatenate(([0.0], orders, orders)) > highest, column] = 0.0
        all_coefficients[:, 0, column] = 0.0
    mean = all_coefficients.mean(axis=0)
    basis = _basis(_ANGLES, harmonics)
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


def _peak(waveform: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest magnitude of periodic columns, refined by a parabola through three points."""
    magnitude = np.abs(waveform)
    at = np.argmax(magnitude, axis=0)
    left, top, right = (
        np.take_along_axis(magnitude, ((at + shift) % _GRID)[None, :], axis=0)[0] for shift in (-1, 0, 1)
    )
    bend = left - 2.0 * top + right
    shift = np.where(bend < 0.0, 0.5 * (left - right) / np.where(bend < 0.0, bend, -1.0), 0.0)
    return top - 0.25 * (left - right) * shift


class CycleAnalyser:
    """Cuts a stream of samples into cycles of `omega` [rad/s] and fits each as soon as it is complete."""

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
        """Cycles cut so far, those without a fit included."""
        return self._count

    def push(self, values: NDArray[np.float64]) -> list[Cycle]:
        """Take the next samples, shape (n, m); return the cycles that they complete."""
        self._pending.append(values)
        self._held += values.shape[0]
        if self._start + self._held < self._end():
            return []
        queue = np.concatenate(self._pending)
        cycles: list[Cycle] = []
        while self._start + queue.shape[0] >= self._end():
            n = self._end() - self._start
            phase = self._step * np.arange(self._start, self._start + n, dtype=np.float64)
            cycle = fit_cycle(self._count, phase, queue[:n], self._highest)
            if cycle is not None:
                cycles.append(cycle)
            queue = queue[n:]
            self._start += n
            self._count += 1
        self._pending, self._held = [queue], queue.shape[0]
        return cycles

    def _end(self) -> int:
        return self._first + ceil((self._count + 1) * tau / self._step)
