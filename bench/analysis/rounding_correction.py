"""Rounding errors of the peak of fitted cycles, estimated from the residuals of the fit.

The output of a laser has steps (`bench.analysis.rounding`). Where a reading turns, it remains on one step for some
time; the fit follows it as far as its harmonics can, which is the error, and leaves the rest as a residual that all
cycles have in common. With P the projection on the fitted harmonics, L the low-pass before the converter, and e the
rounding error of the readings x, a sawtooth whose phase is the position of the steps,

    error of the fit = P L e(x),    residual = (1 - P) L e(x) + noise

The unknowns are the positions of the steps near the upper and near the lower turning point (two positions, since the
steps of calibrated readings are slightly unequal), the smoothing of the steps by the laser's noise, and the cutoff of
the low-pass. Each combination of them is a hypothesis, with equal prior probability; the likelihoods of the residual
give the mean error and its variance. As x is the fitted motion without the error, the estimation is repeated with the
corrected motion.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import ceil, log2, pi, tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import TRACES, Cycle, harmonic_basis

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

FEWEST = 17.0
"""Fewest steps within the swing of a reading for a correction: with fewer, several positions of the steps have nearly
the same residual, and the stated variances are too small.
"""

SEVERAL, SEPARATE = 60.0, 24.0
"""Numbers of steps within the swing below which the estimation is begun at several positions of the steps, since it may
end at a wrong one, and below which these positions are independent in the upper and the lower half: the fitted swing is
then not accurate enough to relate them.
"""

MODEL = 0.25
"""Standard uncertainty of the corrections, relative to the rounding errors. Of readings of simulated lasers with swings
of 25 to 1000 steps, a share of 0.1 to 0.35 remained (rms).
"""

_TERMS, _POSITIONS, _BINS = 3, 48, 256
"""Number of terms of the sawtooth, of positions of the steps, and of phases at which the residual is averaged."""
_SMOOTHING: Array = np.array([0.06, 0.1, 0.16, 0.25, 0.5])
"""Standard deviations by which the steps may be smoothed, relative to a step; with the largest, there are no steps."""
_CUTOFFS = (60.0, 100.0, 160.0, 300.0, 1000.0)
"""Cutoffs [Hz] of the low-pass, a Butterworth filter of order 4."""
_NOISE = 2.0
"""Standard deviation of the residual in the likelihoods, relative to the measured one: allows for the rounding by the
converter and for other low-passes.
"""
_ROUNDS, _DAMPING = 6, 0.7
"""Number of estimations, and share of the change of the corrected motion that is applied after each of them."""
_STARTS, _EACH, _START_SMOOTHING = 12, 8, 0.1
"""Number of positions at which the estimation is begun, number of positions in each half if they are separate, and the
smoothing at the beginning.
"""

_ORDERS: Array = np.arange(1.0, _TERMS + 1.0)
_TURNS: Complex = np.exp(-1j * np.outer(np.arange(_POSITIONS) * (tau / _POSITIONS), _ORDERS))


@dataclass(frozen=True)
class Rounding:
    """Estimated rounding error [m] of a peak, and its variance [m2] without the uncertainty of the model."""

    error: float
    variance: float


def rounding(
    cycles: Sequence[Cycle], omega: float, column: int, phase: float, orders: int, step: float
) -> Rounding | None:
    """Rounding error of the mean of `cycles` at `omega` [rad/s] in the signal `column`, one of TRACES, at the phase
    `phase` [rad], from its harmonics 1 to `orders`, for readings in steps of `step` [m]. None if the swing has less
    than FEWEST steps, or if samples are missing.
    """
    fitted = min(cycle.fitted for cycle in cycles)
    if fitted < orders or any(cycle.fitted != fitted or len(cycle.traces) != cycle.samples for cycle in cycles):
        return None
    fit = _Fit.of(cycles, omega, column, phase, orders, step)
    sawtooth = fit.sawtooth(np.zeros_like(fit.motion))
    if sawtooth is None:
        return None
    judged = {cutoff: fit.judged(sawtooth.filtered(omega, cutoff)) for cutoff in _CUTOFFS}
    cutoff = max(judged, key=lambda each: judged[each].evidence)
    starts = [judged[cutoff].error]
    if sawtooth.swing < SEVERAL * step:
        starts += sawtooth.filtered(omega, cutoff).starts(separate=sawtooth.swing < SEPARATE * step)
    ends = [end for end in (fit.repeated(start, cutoff) for start in starts) if end is not None]
    if not ends:
        return None
    evidences, peaks, variances = np.array([(each.evidence, each.peak, each.variance) for each in ends]).T
    weights: Array = np.exp(evidences - evidences.max())
    weights /= weights.sum()
    error = float(weights @ peaks)
    return Rounding(error, float(weights @ (variances + (peaks - error) ** 2)))


@dataclass(frozen=True, eq=False)
class _Judged:
    """Means over all hypotheses with one low-pass: complex amplitudes of the fit's `error` [m], shape (1 + H,), error
    [m] and variance [m2] of the peak; and the logarithm of the evidence.
    """

    error: Complex
    peak: float
    variance: float
    evidence: float


@dataclass(frozen=True, eq=False)
class _Sawtooth:
    """Terms of the sawtooth along a motion, for steps at zero: exp(2 pi j m x / step). `spectra`, shape (terms, 2, 2 K
    + 1), are their harmonics -K to K in the upper and in the lower half of the swing, `swing` [m].
    """

    spectra: Complex
    swing: float
    step: float
    fitted: int

    @property
    def orders(self) -> Array:
        """Orders of the harmonics, shape (2 K + 1,)."""
        kept = self.spectra.shape[2] // 2
        return np.arange(-kept, kept + 1, dtype=np.float64)

    def filtered(self, omega: float, cutoff: float) -> "_Sawtooth":
        """Behind a low-pass without its delay, which all signals have in common."""
        angles: Array = (pi / 8.0) * np.array([5.0, 7.0, 9.0, 11.0])
        poles = tau * cutoff * np.exp(1j * angles)
        s = 1j * omega * np.abs(self.orders)
        response = np.prod(-poles[:, None] / (s - poles[:, None]), axis=0)
        response = response * np.exp(s * float(np.sum(-1.0 / poles).real))
        return replace(self, spectra=self.spectra * np.where(self.orders < 0.0, response.conj(), response))

    def starts(self, *, separate: bool) -> list[Complex]:
        """Errors of the fit for several positions of the steps, which may be `separate` in the two halves."""
        number = _EACH if separate else _STARTS
        terms = _amplitudes(self.step, np.array([_START_SMOOTHING])) * _TURNS[:: _POSITIONS // number]
        upper, lower = (terms @ self.spectra[:, half] for half in (0, 1))
        if separate:
            return [self.error(high + low) for high in upper for low in lower]
        return [self.error(total) for total in upper + lower]

    def error(self, total: Complex) -> Complex:
        """Complex amplitudes of the fitted harmonics of the imaginary part of a spectrum."""
        kept = total.size // 2
        found: Complex = (total[kept:] - total[kept::-1].conj())[: 1 + self.fitted] / 2j
        found[1:] *= 2.0
        return found


def _amplitudes(step: float, smoothing: Array) -> Array:
    """Amplitudes [m] of the terms of a sawtooth, smoothed by `smoothing`, shape (s,); shape (s, terms)."""
    return step / pi * (-1.0) ** _ORDERS / _ORDERS * np.exp(-2.0 * pi**2 * np.outer(smoothing**2, _ORDERS**2))


@lru_cache(maxsize=4)
def _left_over(kept: int, fitted: int) -> Complex:
    """Mean of each harmonic -`kept` to `kept` in each of `_BINS` intervals of the phase, shape (2 kept + 1, bins); zero
    for those that are `fitted`. The estimations of a measurement have these in common.
    """
    orders = np.arange(-kept, kept + 1, dtype=np.float64)
    centres = (np.arange(float(_BINS)) + 0.5) * (tau / _BINS)
    beyond = np.where(np.abs(orders) > fitted, np.sinc(orders / _BINS), 0.0)
    return np.exp(1j * np.outer(orders, centres)) * beyond[:, None]


@dataclass(frozen=True, eq=False)
class _Fit:
    """Fitted `motion`, complex amplitudes [m] of shape (1 + H,) of readings Re(sum of c_k exp(j k phase)), and the mean
    residual [m] in each of `_BINS` intervals of the phase, with its weights: samples over variance [1/m2].

    The peak at `phase` has the harmonics 1 to `orders`.
    """

    motion: Complex
    residual: Array
    weights: Array
    omega: float
    phase: float
    orders: int
    step: float

    @staticmethod
    def of(cycles: Sequence[Cycle], omega: float, column: int, phase: float, orders: int, step: float) -> "_Fit":
        fitted, trace = cycles[0].fitted, TRACES.index(column)
        mean: Array = np.mean([cycle.coefficients[:, column] for cycle in cycles], axis=0)
        motion: Complex = np.append(mean[0] + 0j, mean[1 : 1 + fitted] - 1j * mean[1 + fitted :])
        phases = [each.phases[0] + each.phases[1] * np.arange(each.samples, dtype=np.float64) for each in cycles]
        left: Array = np.concatenate(
            [
                cycle.traces[:, trace] - harmonic_basis(each, fitted) @ cycle.coefficients[:, column]
                for cycle, each in zip(cycles, phases, strict=True)
            ]
        )
        bins = (np.concatenate(phases) % tau * (_BINS / tau)).astype(np.intp) % _BINS
        samples = np.bincount(bins, minlength=_BINS).astype(np.float64)
        residual = np.bincount(bins, left, minlength=_BINS) / np.maximum(samples, 1.0)
        # readings without noise and steps leave nothing
        variance = _NOISE**2 * max(float(np.mean(left**2)), (1e-3 * step) ** 2)
        return _Fit(motion, residual, samples / variance, omega, phase, orders, step)

    def sawtooth(self, error: Complex) -> _Sawtooth | None:
        """The sawtooth along the motion without `error`; None if its swing has less than FEWEST steps."""
        amplitudes, fitted = self.motion - error, self.motion.size - 1
        largest = 2.0 * float(np.abs(amplitudes[1:]).sum())
        n = 2 ** ceil(log2(max(2048.0, 4.0 * pi * _TERMS * largest / self.step)))
        spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
        spectrum[: 1 + fitted] = amplitudes * (0.5 * n)
        spectrum[0] *= 2.0
        x: Array = np.fft.irfft(spectrum, n)
        low, high = float(x.min()), float(x.max())
        if high - low < FEWEST * self.step:
            return None
        upper: Array = np.clip(0.5 + (2.0 * x - low - high) / (high - low), 0.0, 1.0)
        upper = upper * upper * (3.0 - 2.0 * upper)
        turn, power = np.exp((tau * 1j / self.step) * x), np.ones(n, dtype=np.complex128)
        kept, found = 4 * fitted, list[Complex]()
        for _ in range(_TERMS):
            power = power * turn
            for part in (upper, 1.0 - upper):
                whole: Complex = np.fft.fft(power * part) / n
                found.append(np.concatenate((whole[-kept:], whole[: kept + 1])))
        return _Sawtooth(np.array(found).reshape(_TERMS, 2, -1), high - low, self.step, fitted)

    def repeated(self, error: Complex, cutoff: float) -> _Judged | None:
        """Result after `_ROUNDS` estimations, the first of them with the motion without `error`."""
        judged: _Judged | None = None
        for _ in range(_ROUNDS):
            sawtooth = self.sawtooth(error)
            if sawtooth is None:
                return None
            judged = self.judged(sawtooth.filtered(self.omega, cutoff))
            error = error + _DAMPING * (judged.error - error)
        return judged

    def judged(self, sawtooth: _Sawtooth) -> _Judged:
        """Means over all hypotheses, weighted by the likelihoods of the residual."""
        orders = sawtooth.orders
        waves = sawtooth.spectra @ _left_over(orders.size // 2, sawtooth.fitted)
        terms = _amplitudes(self.step, _SMOOTHING)[:, None, :] * _TURNS
        upper, lower = (np.imag(terms @ waves[:, half]) for half in (0, 1))
        weighed = self.weights * self.residual
        above, below = (each @ weighed - 0.5 * (each**2 @ self.weights) for each in (upper, lower))
        together = (upper * self.weights) @ lower.transpose(0, 2, 1)
        likelihoods: Array = above[:, :, None] + below[:, None, :] - together
        largest = float(likelihoods.max())
        shares: Array = np.exp(likelihoods - largest)
        evidence = largest + float(np.log(shares.sum()))
        shares /= shares.sum()
        counted = (np.abs(orders) <= self.orders) & (orders != 0.0)
        at_peak = np.where(counted, np.exp(1j * self.phase * orders), 0.0)
        top, bottom = (np.imag(terms @ (sawtooth.spectra[:, half] @ at_peak)) for half in (0, 1))
        peaks = top[:, :, None] + bottom[:, None, :]
        peak = float(np.sum(shares * peaks))
        means = [np.einsum("sp,spm->m", shares.sum(axis=axis), terms) for axis in (2, 1)]
        error = sawtooth.error(means[0] @ sawtooth.spectra[:, 0] + means[1] @ sawtooth.spectra[:, 1])
        return _Judged(error, peak, float(np.sum(shares * (peaks - peak) ** 2)), evidence)
