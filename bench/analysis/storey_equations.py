"""Equations for the errors of both lasers, from the motion of the second storey in one test.

Only the upper columns move the second storey. With its absolute displacement x_2, the drift d, and p = m_2 / k_2,
q = c_2 / k_2,

    d + q d' + p x_2'' = 0

whatever table, first storey and block do. The readings r_1 and r_2 of lasers on the ground leave a residual

    (r_2 - r_1) + q (r_2 - r_1)' + p r_2'' = (e_2 + q e_2' + p e_2'') - (e_1 + q e_1')

which is due to their errors e_1(r_1) and e_2(r_2): the motion is its own reference. With lasers on the table, p times
the acceleration of the table is added.

The equations are filtered by 1 / (1 + p omega^2), which leaves the white noise of r_2 white, and limited to the band of
the motion. What else may be in a residual has columns of its own, which are projected out: changes of p and q, the
square and the cube of the drift (stiffness that is not constant), the sign of its rate (friction), an offset, the
table's acceleration, and the delay between the lasers, which wanders with their free-running clocks.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from bench.analysis.drift_zero import shortest, strong_part
from bench.analysis.linearity import LinearFrame
from bench.analysis.signals import ACCELERATION, LASER_1, LASER_2

Array = NDArray[np.float64]

BAND = 20.0
"""Upper frequency of the equations [Hz]."""

INNER, KEPT = 10.0, 4
"""Lowest rate of the filtered signals, relative to `BAND`, and number of their samples for each equation."""

EDGE = 12.0
"""Time constants of the filter between an equation and the ends of the signals: errors there decay to 6e-6."""

KNOTS = 1.0
"""Time between the values of the wandering delay, between which it is linear [s]."""


@dataclass(frozen=True, eq=False)
class StoreyMotion:
    """Strong motion of a test at `rate` [Hz]: readings of both lasers relative to rest, shape (2, n) [m], and for
    lasers on the table its acceleration, shape (n,) [m/s2]. There is an equation for every `KEPT`-th sample of `kept`;
    `nominal` [s2] is the ratio of the second storey's mass and stiffness.
    """

    rate: float
    readings: Array
    acceleration: Array | None
    kept: slice
    nominal: float

    @property
    def number(self) -> int:
        """Number of equations."""
        return len(range(*self.kept.indices(self.readings.shape[1])))

    def equations(self, bases: tuple[Callable[[Array], Array], Callable[[Array], Array]]) -> tuple[Array, Array]:
        """Rows and right-hand sides [m] of the equations, after the projection, shapes (number, n + m + 1) and
        (number,): their unknowns are the coefficients of both error curves, relative to the error at rest, and the
        scale of laser 2 relative to that of laser 1.

        `bases` compute the basis functions of the curves at readings of shape (k,): shapes (n, k) and (m, k).
        """
        own = self._own()
        steady: Array = own[0]
        # the coefficients of the equation are linear in it, so that no iteration is needed
        fitted = np.linalg.lstsq(own[1:].T, -steady, rcond=None)[0]
        q, p = float(fitted[0]), float(fitted[1])
        first, second = (base(each) - base(np.zeros(1)) for base, each in zip(bases, self.readings, strict=True))
        s = self._s
        lower, upper = -(1.0 + q * s), 1.0 + q * s + p * s**2
        curves = (self._filtered(first, lower), self._filtered(second, upper), self._filtered(self.readings[1:], upper))
        rows, values = np.concatenate(curves).T, steady + q * own[1] + p * own[2]
        across = np.linalg.qr(np.concatenate((own[1:], self._delays(upper))).T).Q
        return rows - across @ (across.T @ rows), values - across @ (across.T @ values)

    def _own(self) -> Array:
        """Filtered drift, its rate, and acceleration of the second storey, and what else may be in a residual, shape
        (terms, number), each of the latter with a rms of 1.
        """
        drift = self.readings[1] - self.readings[0]
        s, one = self._s, np.ones(self._size // 2 + 1)
        bending = self._filtered(self.readings[1:], s**2)
        others = [drift**2, drift**3, np.sign(np.gradient(drift)), np.ones_like(drift)]
        if self.acceleration is not None:
            table = self._filtered(self.acceleration[None], one)
            bending = bending + table
            others.append(self.acceleration)
        more = self._filtered(np.array(others), one)
        more /= np.maximum(np.sqrt(np.mean(more**2, axis=1, keepdims=True)), np.finfo(np.float64).tiny)
        return np.concatenate((self._filtered(drift[None], one), self._filtered(drift[None], s), bending, more))

    def _delays(self, upper: NDArray[np.complex128]) -> Array:
        """Effect of a delay between the lasers at each of its knots, shape (knots, number)."""
        speed = self._filtered(self.readings[1:], upper * self._s)
        time = np.arange(self.number) * (KEPT / self.rate)
        knots = np.arange(0.0, time[-1] + KNOTS, KNOTS)
        return np.maximum(1.0 - np.abs(time - knots[:, None]) / KNOTS, 0.0) * speed

    @property
    def _edge(self) -> int:
        return _edge(self.nominal, self.rate)

    @cached_property
    def _size(self) -> int:
        """Number of samples of a transform: the signals, continued by their first and last values."""
        from scipy.fft import next_fast_len

        return int(next_fast_len(self.readings.shape[1] + 2 * self._edge, real=True))

    @cached_property
    def _s(self) -> NDArray[np.complex128]:
        return np.asarray(2.0j * pi * np.fft.rfftfreq(self._size, 1.0 / self.rate), dtype=np.complex128)

    def _filtered(self, values: Array, response: NDArray[np.complex128] | Array) -> Array:
        """`values`, shape (k, n), with a frequency `response` within the band, at the equations, shape (k, number)."""
        edge, size, s = self._edge, self._size, self._s
        window = 1.0 / (1.0 + (s.imag / (2.0 * pi * BAND)) ** 8) / (1.0 + self.nominal * s.imag**2)
        padded = np.pad(values, ((0, 0), (edge, size - edge - values.shape[1])), mode="edge")
        found = np.fft.irfft(np.fft.rfft(padded, axis=1) * (response * window), size, axis=1)
        return found[:, edge : edge + values.shape[1]][:, self.kept]


def storey_motion(signals: Array, frame: LinearFrame, sample_rate: float) -> StoreyMotion | None:
    """Strong motion in `signals`, shape (n, len(SIGNALS)), of a `frame` with or without block; None if it is too short,
    or too many samples are missing.
    """
    during = strong_part(signals, frame, sample_rate)
    if during is None:
        return None
    storey = frame.specimen.frame
    nominal = storey.m2 / storey.k2
    margin = _edge(nominal, sample_rate)
    begin, end = max(during.start - margin, 0), min(during.stop + margin, len(signals))
    columns = [LASER_1, LASER_2] if frame.grounded else [LASER_1, LASER_2, ACCELERATION]
    every = max(int(sample_rate / (INNER * BAND)), 1)
    values = _slower([_complete(signals[begin:end, column]) for column in columns], every, sample_rate)
    rate, n = sample_rate / every, values.shape[1]
    edge = _edge(nominal, rate)
    first = max(ceil((during.start - begin) / every), edge)
    last = min((during.stop - begin) // every, n - edge)
    if (last - first) / rate < shortest(frame):
        return None
    return StoreyMotion(rate, values[:2], None if frame.grounded else values[2], slice(first, last, KEPT), nominal)


def _edge(nominal: float, rate: float) -> int:
    """Number of samples at `rate` [Hz] within which the filter forgets the ends of the signals."""
    return ceil(EDGE * sqrt(nominal) * rate)


def _complete(values: Array) -> Array:
    """`values`, shape (n,), with missing ones interpolated."""
    known = np.flatnonzero(np.isfinite(values))
    return values if known.size == values.size else np.interp(np.arange(values.size), known, values[known])


def _slower(values: Sequence[Array], every: int, sample_rate: float) -> Array:
    """Every `every`-th of the smoothed `values`, shape (k, n // every); the band of the equations is unchanged."""
    n = values[0].size
    pad = ceil(sample_rate / BAND)
    padded = np.pad(np.array(values), ((0, 0), (pad, pad)), mode="edge")
    passed = 1.0 / (1.0 + (np.fft.rfftfreq(padded.shape[1], 1.0 / sample_rate) / (2.5 * BAND)) ** 8)
    smooth = np.fft.irfft(np.fft.rfft(padded, axis=1) * passed, padded.shape[1], axis=1)
    return smooth[:, pad : pad + n : every]
