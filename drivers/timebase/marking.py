"""Alignment of a sensor's clock by pulses of the DAQ device that switch the beam of the sensor off.

Pulses that begin with the sample clock of a run give the offset between the clocks; pulses between the runs, over a
longer time, give their rate. Each rising edge occurs between the last measurement with the beam and the first one
without it, which bounds the offset between the clocks to one measuring cycle. The spacing of the edges is a whole
number of cycles plus the golden-ratio fraction of a cycle, so that their phases are almost evenly distributed over the
cycle: if the clocks agree, the bounds from 89 edges differ by at most 1.4 % of a cycle, 3.4 us at 4000 1/s (three-gap
theorem), and by at most 8 % if they differ by 60 ppm.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GOLDEN = 0.6180339887498949
"""Golden-ratio fraction: its multiples modulo 1 are distributed almost evenly over the unit interval."""
_EDGES = (89, 55, 34, 21)
"""Numbers of pulses at the beginning of a run: with a Fibonacci number, the phases leave no wide gap."""
_DURATION = 1.5
"""Longest duration of these pulses [s]; the drive played meanwhile must fit into the buffer of the output."""
_SPACING = 0.0125
"""Approximate time between two pulses [s]."""
_CYCLES = 16
"""Minimum number of measuring cycles between two pulses."""
_BEGIN = 0.05
"""Time from the start of the sample clock to the first pulse [s], during which the sensor measures with its beam on."""
_ENOUGH = 20
"""Minimum number of edges that must be found for an alignment."""


@dataclass(frozen=True)
class Pulses:
    """A train of `number` pulses on the sample clock, the first one at `delay` [s]; each lasts `high` [s], followed by
    a pause of `low` [s].
    """

    delay: float
    high: float
    low: float
    number: int

    @property
    def spacing(self) -> float:
        """Time from one pulse to the next [s]."""
        return self.high + self.low

    @property
    def edges(self) -> NDArray[np.float64]:
        """Times at which the pulses begin [s], shape (number,)."""
        return self.delay + self.spacing * np.arange(self.number, dtype=np.float64)

    @property
    def end(self) -> float:
        """End of the pause after the last pulse [s]."""
        return self.delay + self.spacing * self.number


def golden_pulses(rate: float) -> Pulses:
    """Pulses for the alignment of a sensor with measuring rate `rate` [1/s]."""
    spacing = _spacing(_SPACING, rate)
    number = next((number for number in _EDGES if number * spacing <= _DURATION), _EDGES[-1])
    half = _exact(0.5 * spacing)
    return Pulses(_BEGIN, half, half, number)


_DARK = 4
"""Length of a pulse between the runs, in measuring cycles: short, since the beam also serves to aim the sensor."""
_CLOSE = 0.004
"""Approximate time between two pulses between the runs [s]: the shorter, the less a difference between the clocks
changes the phases.
"""
_LONGEST = 1200.0
"""Approximate duration of the pulses between two runs [s]."""


def observation_pulses(rate: float) -> Pulses:
    """Pulses between the runs, for the rate of the clock of a sensor with measuring rate `rate` [1/s]."""
    spacing, high = _spacing(_CLOSE, rate), _exact(_DARK / rate)
    return Pulses(_BEGIN, high, _exact(spacing - high), round(_LONGEST / spacing))


def _spacing(seconds: float, rate: float) -> float:
    """Time of about `seconds` [s] between two pulses for the measuring rate `rate` [1/s]."""
    return (max(round(seconds * rate), _CYCLES) + GOLDEN) / rate


_TICKS = 1e7
"""Rate of which the rates of all usual timebases (20, 80 and 100 MHz) are multiples [1/s]: a device rounds the times of
its pulses to ticks, and a tick of 10 ns of a spacing of 4 ms would change the rate by 2.4 ppm.
"""


def _exact(seconds: float) -> float:
    """The nearest time that a counter outputs without rounding [s]."""
    return round(seconds * _TICKS) / _TICKS


def expected_uncertainty(rate: float) -> float:
    """Standard uncertainty [s] of the alignment of a sensor with measuring rate `rate` [1/s], without jitter."""
    return _ERROR / rate


_ERROR = 0.007
"""Root mean square error of the midpoint between the bounds from 89 edges, in measuring cycles, for clocks that differ
by up to 60 ppm: such a difference changes the phases.
"""
_DEVIATIONS = np.linspace(-4.0, 4.0, 301)
"""Deviations from the given rate that are searched, in standard uncertainties of that rate."""


@dataclass(frozen=True)
class Rate:
    """Seconds of the sample clock per second of a sensor's clock, with the standard uncertainty `uncertainty` [1]."""

    value: float
    uncertainty: float

    def aged(self, seconds: float) -> "Rate":
        """The rate `seconds` [s] before or after it was measured."""
        return Rate(self.value, float(np.hypot(self.uncertainty, _DRIFT * abs(seconds))))

    def combined(self, other: "Rate") -> "Rate":
        """Mean of two independent estimates, weighted by their uncertainties, of which at least one is finite."""
        weights = self.uncertainty**-2, other.uncertainty**-2
        value = np.average([self.value, other.value], weights=weights)
        return Rate(float(value), float(np.sum(weights)) ** -0.5)


_DRIFT = 2e-9
"""Standard deviation of the change of the rate per second [1/s]: 2 ppm while a sensor warms up for 20 minutes."""


@dataclass(frozen=True)
class Mark:
    """A point common to two clocks: `time` [s] on the sensor's clock is `seconds` on the sample clock, with the
    standard uncertainty `uncertainty` [s].
    """

    time: float
    seconds: float
    uncertainty: float


def marked_point(
    pulses: Pulses, time: NDArray[np.float64], is_lit: NDArray[np.bool_], rate: Rate, rough: float
) -> Mark | None:
    """The common point in the middle of the pulses, which depends least on the rates of the clocks.

    `time`, shape (n,), contains the ascending times of the measurements on the sensor's clock [s]; `is_lit`, shape
    (n,), is False for those without the beam. `rough` is the time on the sample clock at which the sensor's clock reads
    0 [s], known to within half the time between two pulses. Returns None if fewer than 20 edges are found.
    """
    onsets, cycle = _onsets(time, is_lit)
    if not onsets.size:
        return None
    # the first onset of darkness is attributed to the nearest edge according to the rough offset
    candidates = pulses.edges - rate.value * float(time[onsets[0]])
    rough = float(candidates[np.argmin(np.abs(candidates - rough))])
    offsets = pulses.edges[:, None] - rate.value * time[onsets]
    edge = np.argmin(np.abs(offsets - rough), axis=0)
    found = np.abs(offsets[edge, np.arange(onsets.size)] - rough) < 2.0 * cycle
    if np.count_nonzero(found) < _ENOUGH:
        return None
    onsets, edges = onsets[found], pulses.edges[edge[found]]
    middle = 0.5 * float(time[onsets[0]] + time[onsets[-1]])
    rates = rate.value + rate.uncertainty * _DEVIATIONS
    low, high = _bounds(edges, time[onsets] - middle, time[onsets - 1] - middle, rates)
    # the point is assumed uniformly distributed between the bounds at each rate, and the rate normally distributed
    width, centre = high - low, 0.5 * (low + high)
    weight = np.maximum(width, 0.0) * np.exp(-0.5 * _DEVIATIONS**2)
    if not weight.any():
        # because of the sensor's jitter, the bounds may contradict each other at every rate
        weight[np.argmax(width)] = 1.0
    weight /= weight.sum()
    seconds = float(weight @ centre)
    return Mark(middle, seconds, float(np.sqrt(weight @ ((centre - seconds) ** 2 + width**2 / 12.0))))


_ZOOMS = 8
"""Number of successively finer searches for the rate at which the bounds are farthest apart."""
_NEAR = 0.6
"""Largest distance of an onset from the fitted line, in measuring cycles."""
_REGULAR = 0.8
"""Smallest fraction of onsets that must fit the spacing of the pulses; others may be due to a hand in the beam."""


def pulse_rate(spacing: float, time: NDArray[np.float64], is_lit: NDArray[np.bool_], rate: float) -> Rate | None:
    """The rate from pulses `spacing` [s] apart that began at an unknown time; `rate` is its approximate value.

    `time` and `is_lit`, shape (n,) each, are those of `marked_point`. The approximation must be so close that the
    clocks drift apart by less than a quarter of the spacing. Returns None if fewer than 20 edges are found, or if the
    beam was also interrupted otherwise.
    """
    onsets, cycle = _onsets(time, is_lit)
    if onsets.size < _ENOUGH:
        return None
    dark = time[onsets] - time[onsets[0]]
    phase = rate * dark / spacing
    first = float(np.angle(np.exp(2j * np.pi * phase).mean())) / (2.0 * np.pi)
    edges = spacing * np.rint(phase - first)
    line = np.polynomial.Polynomial.fit(dark, edges, 1)
    kept = np.zeros(onsets.size, dtype=np.bool_)
    for _ in range(3):
        # an onset is up to one cycle later than its edge, by half a cycle on average
        kept = np.abs(edges - line(dark)) < _NEAR * cycle
        if np.count_nonzero(kept) < max(_ENOUGH, _REGULAR * onsets.size):
            return None
        line = np.polynomial.Polynomial.fit(dark[kept], edges[kept], 1)
    edges, lit, dark = edges[kept], time[onsets - 1][kept] - time[onsets[0]], dark[kept]
    slope, span = float(line.deriv()(0.0)), float(dark[-1] - dark[0])

    def width(rates: NDArray[np.float64]) -> NDArray[np.float64]:
        low, high = _bounds(edges, dark, lit, rates)
        return high - low

    largest = cycle / span
    best, step = slope, largest
    for _ in range(_ZOOMS):
        # the width is a concave function of the rate
        rates = best + step * np.linspace(-1.0, 1.0, 11, dtype=np.float64)
        best, step = float(rates[np.argmax(width(rates))]), 0.25 * step
    if width(np.array([best])) <= 0.0:
        # the sensor's jitter exceeds the spacing of the phases: the standard uncertainty of the fitted line
        return Rate(slope, largest / float(np.sqrt(dark.size)))
    steps = np.ldexp(largest, -np.arange(20))
    below, above = (float(steps[width(best + sign * steps) <= 0.0].min(initial=largest)) for sign in (-1.0, 1.0))
    rates = np.linspace(best - below, best + above, _DEVIATIONS.size, dtype=np.float64)
    # the start of the pulses is assumed uniformly distributed between the bounds at each rate
    weight = np.maximum(width(rates), 0.0)
    value = float(np.average(rates, weights=weight))
    return Rate(value, float(np.sqrt(np.average((rates - value) ** 2, weights=weight))))


def _onsets(time: NDArray[np.float64], is_lit: NDArray[np.bool_]) -> tuple[NDArray[np.intp], float]:
    """Indices of the first measurements without the beam, except those next to a gap, and the measuring cycle [s]."""
    onsets = np.flatnonzero(is_lit[:-1] & ~is_lit[1:]) + 1
    if not onsets.size:
        return onsets, np.nan
    cycle = float(np.median(np.diff(time)))
    return onsets[time[onsets] - time[onsets - 1] < 1.5 * cycle], cycle


def _bounds(
    edges: NDArray[np.float64], dark: NDArray[np.float64], lit: NDArray[np.float64], rates: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper bounds, shape (m,) each, of the time on the sample clock at which the sensor's clock reads 0 [s],
    if its rate is one of `rates`, shape (m,). Each of the `edges` occurred after the measurement at `lit` and before
    the one at `dark`, shape (n,) each [s].
    """
    low = (edges - rates[:, None] * dark).max(axis=1)
    high = (edges - rates[:, None] * lit).min(axis=1)
    return low, high
