"""Equations for the errors of both lasers, from the motion of the second storey in one test.

Only the upper columns move the second storey. With its absolute displacement x_2, the drift d, and p = m_2 / k_2,
q = c_2 / k_2,

    d + q d' + p x_2'' = 0

whatever table, first storey and block do. The readings r_1 and r_2 of lasers on the ground leave a residual

    (r_2 - r_1) + q (r_2 - r_1)' + p r_2'' = (e_2 + q e_2' + p e_2'') - (e_1 + q e_1')

which is due to their errors e_1(r_1) and e_2(r_2): the motion is its own reference. With lasers on the table, p times
the acceleration of the table is added.

White noise of the readings, equal in both, has the spectrum |1 + i q omega - p omega^2|^2 + |1 + i q omega|^2 in the
equations, least near the modes. They are divided by its root, neglecting q, so that their noise is white as well, and
limited to the band of the motion. What else may be in a residual has columns of its own: changes of p and the square
and the cube of the drift (stiffness that is not constant) are further unknowns; changes of q, the sign of the rate of
the drift (friction), an offset, the table's acceleration, and the delay between the lasers, which wanders with their
free-running clocks, are projected out. With the stiffness 1 + b d + c d^2, errors of the drift count with its slope
1 + 2 b d + 3 c d^2, and so does noise: an equation has the weight 1 / (1 + |2 b d + 3 c d^2|).

The coefficients of an equation are functions of the same readings, so that their noise is correlated with that of its
right-hand side: on average, a coefficient contains the mean slope of its curve times the share of its laser in this
noise. The same applies to the acceleration of the second storey and to powers of the drift, but not to its rate, whose
noise is a quarter of a period ahead.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from bench.analysis.drift_zero import COMPLETE, shortest, strong_part
from bench.analysis.linearity import LinearFrame
from bench.analysis.signals import ACCELERATION, LASER_1, LASER_2, bridged

Array = NDArray[np.float64]
Bases = tuple[Callable[[Array], Array], Callable[[Array], Array]]

BAND = 20.0
"""Upper frequency of the equations [Hz]."""

INNER, KEPT = 10.0, 4
"""Lowest rate of the filtered signals, relative to `BAND`, and number of their samples for each equation."""

EDGE = 26.0
"""Time constants sqrt(p) between an equation and the ends of the signals: errors there decay by exp(-0.455) in each, to
7e-6.
"""

LONGEST, AROUND = 0.02, 17.0
"""Longest gap in the readings that is bridged [s]; time constants around a longer one without equations."""

KNOTS = 1.0
"""Time between the values of the wandering delay, between which it is linear [s]."""

STEP = 1e-6
"""Step of the finite differences for the slope of a curve [m]."""


@dataclass(frozen=True, eq=False)
class Equations:
    """Equations of one test, after the projection of `removed` columns: `values`, shape (number,) [m], are the sum of

    - `rows`, shape (number, n + m + 1), times the coefficients of the error curves of laser 1 and laser 2, relative to
      the error at rest, and the scale of laser 2 relative to that of laser 1, and
    - `own`, shape (number, 3), times three relative changes, reversed in sign: that of p, and those of the stiffness at
      the largest drift in proportion to the drift and to its square.

    `slopes` and `own_slopes`, shapes (n + m + 1,) and (3,), are the regression coefficients of the columns on the noise
    of the values, for constant stiffness.
    """

    rows: Array
    own: Array
    values: Array
    removed: int
    slopes: Array
    own_slopes: Array


@dataclass(frozen=True, eq=False)
class StoreyMotion:
    """Strong motion of a test at `rate` [Hz]: readings of both lasers relative to rest, shape (2, n) [m], and for
    lasers on the table its acceleration, shape (n,) [m/s2]. There is an equation at each of the samples `kept`, shape
    (number,); `nominal` [s2] is the ratio of the second storey's mass and stiffness.
    """

    rate: float
    readings: Array
    acceleration: Array | None
    kept: NDArray[np.intp]
    nominal: float

    def equations(self, bases: Bases) -> Equations:
        """Equations for the coefficients of the functions `bases` of the two error curves, which are computed for
        readings of shape (k,): shapes (n, k) and (m, k).
        """
        own = self._own()
        steady: Array = own[0]
        # the coefficients of the equation are linear in it, so that no iteration is needed
        fitted = np.linalg.lstsq(own[1:].T, -steady, rcond=None)[0]
        q, p, b, c = (float(each) for each in fitted[:4])
        drift, s = self.readings[1] - self.readings[0], self._s
        stiffer, one = 2.0 * b * drift + 3.0 * c * drift**2, np.ones(s.size)
        lower, upper = 1.0 + q * s, 1.0 + q * s + p * s**2
        first, second = (base(each) - base(np.zeros(1)) for base, each in zip(bases, self.readings, strict=True))
        rows = np.concatenate(
            (
                -self._filtered(first, lower) - self._filtered(stiffer * first, one),
                self._filtered(second, upper) + self._filtered(stiffer * second, one),
                self._filtered(self.readings[1:], upper) + self._filtered(stiffer * self.readings[1:], one),
            )
        ).T
        values = steady + q * own[1] + p * own[2]
        weight = 1.0 / (1.0 + np.abs(stiffer[self.kept]))
        rows, values = weight[:, None] * rows, weight * values
        largest = np.abs(drift[self.kept]).max()
        scales = np.array([p, 1.0 / largest, 1.0 / largest**2])
        changes = scales * (weight * own[2:5]).T
        across = np.linalg.qr((weight * np.concatenate((own[1:2], own[5:], self._delays(upper)))).T).Q
        rows, changes, values = (each - across @ (across.T @ each) for each in (rows, changes, values))
        return Equations(rows, changes, values, across.shape[1], self._slopes(bases), scales * self._own_slopes(drift))

    def _slopes(self, bases: Bases) -> Array:
        """Mean slopes of the basis functions, each times the share of its laser in the noise of an equation; the scale
        of laser 2 has the slope 1.
        """
        second = self._with_noise((1.0 - self._y) ** 2)
        # a quarter of the readings has the same mean
        read = self.readings[:, self.kept[::4]]
        slopes = [
            share * (base(each + STEP) - base(each - STEP)).mean(axis=1) / (2.0 * STEP)
            for share, base, each in zip((1.0 - second, second), bases, read, strict=True)
        ]
        return np.concatenate((*slopes, [second]))

    def _own_slopes(self, drift: Array) -> Array:
        """Regression coefficients, on the noise, of the second storey's acceleration and of the square and the cube of
        the `drift`.
        """
        bending, differing = self._with_noise(-(self._s.imag**2) * (1.0 - self._y)), self._with_noise(2.0 - self._y)
        mean, square = float(drift[self.kept].mean()), float(np.mean(drift[self.kept] ** 2))
        return np.array([bending, 2.0 * mean * differing, 3.0 * square * differing])

    def _with_noise(self, product: Array) -> float:
        """Sum, over the band, of the `product` of a response with that of the equations, relative to their noise."""
        band = self._window**2
        return float(band @ product / (band @ ((1.0 - self._y) ** 2 + 1.0)))

    @cached_property
    def _y(self) -> Array:
        return self.nominal * self._s.imag**2

    def _own(self) -> Array:
        """Filtered drift, its rate, acceleration of the second storey, square and cube of the drift, and what else may
        be in a residual, shape (terms, number).
        """
        drift = self.readings[1] - self.readings[0]
        s, one = self._s, np.ones(self._size // 2 + 1)
        bending = self._filtered(self.readings[1:], s**2)
        others = [drift**2, drift**3, np.sign(np.gradient(drift)), np.ones_like(drift)]
        if self.acceleration is not None:
            table = self._filtered(self.acceleration[None], one)
            bending = bending + table
            others.append(self.acceleration)
        terms = self._filtered(drift[None], one), self._filtered(drift[None], s), bending
        return np.concatenate((*terms, self._filtered(np.array(others), one)))

    def _delays(self, upper: NDArray[np.complex128]) -> Array:
        """Effect of a delay between the lasers at each of its knots, shape (knots, number)."""
        speed = self._filtered(self.readings[1:], upper * self._s)
        time = self.kept / self.rate
        knots = np.arange(time[0], time[-1] + KNOTS, KNOTS)
        return np.maximum(1.0 - np.abs(time - knots[:, None]) / KNOTS, 0.0) * speed

    @cached_property
    def _size(self) -> int:
        """Number of samples of a transform: the signals, continued by their first and last values."""
        from scipy.fft import next_fast_len

        return int(next_fast_len(self.readings.shape[1] + 2 * _edge(self.nominal, self.rate), real=True))

    @cached_property
    def _s(self) -> NDArray[np.complex128]:
        return np.asarray(2.0j * pi * np.fft.rfftfreq(self._size, 1.0 / self.rate), dtype=np.complex128)

    @cached_property
    def _window(self) -> Array:
        """Response that limits the band and makes the noise of the readings white."""
        noise = np.sqrt((1.0 - self._y) ** 2 + 1.0)
        return np.asarray(1.0 / (1.0 + (self._s.imag / (2.0 * pi * BAND)) ** 8) / noise)

    def _filtered(self, values: Array, response: NDArray[np.complex128] | Array) -> Array:
        """`values`, shape (k, n), with a frequency `response` within the band, at the equations, shape (k, number)."""
        edge, size = _edge(self.nominal, self.rate), self._size
        padded = np.pad(values, ((0, 0), (edge, size - edge - values.shape[1])), mode="edge")
        found = np.fft.irfft(np.fft.rfft(padded, axis=1) * (response * self._window), size, axis=1)
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
    known: NDArray[np.bool_] = np.isfinite(signals[begin:end, columns])
    if not (known.mean(axis=0) >= COMPLETE).all():
        return None
    every = max(int(sample_rate / (INNER * BAND)), 1)
    values = _slower([bridged(signals[begin:end, column]) for column in columns], every, sample_rate)
    rate, n = sample_rate / every, values.shape[1]
    edge = _edge(nominal, rate)
    first = max(ceil((during.start - begin) / every), edge)
    last = min((during.stop - begin) // every, n - edge)
    usable = ~_near_gaps(np.asarray(known.all(axis=1)), nominal, sample_rate)
    kept = first + KEPT * np.flatnonzero(usable[first * every : last * every : KEPT * every])
    if kept.size * KEPT / rate < shortest(frame):
        return None
    return StoreyMotion(rate, values[:2], None if frame.grounded else values[2], kept, nominal)


def _near_gaps(known: NDArray[np.bool_], nominal: float, rate: float) -> NDArray[np.bool_]:
    """Mask of the samples at `rate` [Hz] in and near gaps of the `known` ones, shape (n,), that are not bridged."""
    edges = np.flatnonzero(np.diff(np.concatenate(([True], known, [True])).astype(np.int8)))
    near, margin = np.zeros(known.size, dtype=np.bool_), ceil(AROUND * sqrt(nominal) * rate)
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if end - begin > LONGEST * rate:
            near[max(begin - margin, 0) : end + margin] = True
    return near


def _edge(nominal: float, rate: float) -> int:
    """Number of samples at `rate` [Hz] within which the filter forgets the ends of the signals."""
    return ceil(EDGE * sqrt(nominal) * rate)


def _slower(values: Sequence[Array], every: int, sample_rate: float) -> Array:
    """Every `every`-th of the smoothed `values`, shape (k, ceil(n / every)); the band of the equations is unchanged."""
    n = values[0].size
    pad = ceil(sample_rate / BAND)
    padded = np.pad(np.array(values), ((0, 0), (pad, pad)), mode="edge")
    passed = 1.0 / (1.0 + (np.fft.rfftfreq(padded.shape[1], 1.0 / sample_rate) / (2.5 * BAND)) ** 8)
    smooth = np.fft.irfft(np.fft.rfft(padded, axis=1) * passed, padded.shape[1], axis=1)
    return smooth[:, pad : pad + n : every]
