"""Alignment of a sensor's clock by pulses on the sample clock that switch the beam of the sensor off.

Each rising edge occurs between the last measurement with the beam and the first one without it, which bounds the offset
between the clocks to one measuring cycle. The spacing of the edges is a whole number of cycles plus the golden-ratio
fraction of a cycle, so that their phases are almost evenly distributed over the cycle: the bounds from 40 edges differ
by at most 3.5 % of a cycle, 9 us at 4000 1/s (three-gap theorem).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GOLDEN = 0.6180339887498949
"""Golden-ratio fraction: its multiples modulo 1 are distributed almost evenly over the unit interval."""
_EDGES = 40
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
    def edges(self) -> NDArray[np.float64]:
        """Times at which the pulses begin [s], shape (number,)."""
        return self.delay + (self.high + self.low) * np.arange(self.number, dtype=np.float64)

    @property
    def end(self) -> float:
        """End of the pause after the last pulse [s]."""
        return self.delay + (self.high + self.low) * self.number


def golden_pulses(rate: float) -> Pulses:
    """Pulses for the alignment of a sensor with measuring rate `rate` [1/s]."""
    half = 0.5 * (max(round(_SPACING * rate), _CYCLES) + GOLDEN) / rate
    return Pulses(_BEGIN, half, half, _EDGES)


def expected_uncertainty(rate: float) -> float:
    """Standard uncertainty [s] of the alignment of a sensor with measuring rate `rate` [1/s], without jitter."""
    return _ERROR / rate


_ERROR = 0.014
"""Root mean square error, over all phases, of the midpoint between the bounds from 40 edges, in measuring cycles."""
_RATES = 1e-6 * np.arange(-150.0, 151.0)
"""Deviations from the given rate that are searched [1], up to almost four standard uncertainties."""
_RATE_SPREAD = 40e-6
"""Standard uncertainty of the given rate in the first second of a run, on a busy computer [1]."""


@dataclass(frozen=True)
class Mark:
    """A point common to two clocks: `time` [s] on the sensor's clock is `seconds` on the sample clock, with the
    standard uncertainty `uncertainty` [s].
    """

    time: float
    seconds: float
    uncertainty: float


def marked_point(
    pulses: Pulses, time: NDArray[np.float64], is_lit: NDArray[np.bool_], rate: float, rough: float
) -> Mark | None:
    """The common point in the middle of the pulses, which depends least on the rates of the clocks.

    `time`, shape (n,), contains the ascending times of the measurements on the sensor's clock [s]; `is_lit`, shape
    (n,), is False for those without the beam. `rate` is the number of seconds of the sample clock per second of the
    sensor's clock; `rough` is the time on the sample clock at which the sensor's clock reads 0 [s], known to within
    half the time between two pulses. Returns None if fewer than 20 edges are found.
    """
    onsets = np.flatnonzero(is_lit[:-1] & ~is_lit[1:]) + 1
    if not onsets.size:
        return None
    # the first onset of darkness is attributed to the nearest edge according to the rough offset
    candidates = pulses.edges - rate * float(time[onsets[0]])
    rough = float(candidates[np.argmin(np.abs(candidates - rough))])
    cycle = float(np.median(np.diff(time)))
    # onsets next to a gap are excluded
    onsets = onsets[time[onsets] - time[onsets - 1] < 1.5 * cycle]
    offsets = pulses.edges[:, None] - rate * time[onsets]
    edge = np.argmin(np.abs(offsets - rough), axis=0)
    found = np.abs(offsets[edge, np.arange(onsets.size)] - rough) < 2.0 * cycle
    if np.count_nonzero(found) < _ENOUGH:
        return None
    onsets, edges = onsets[found], pulses.edges[edge[found]]
    middle = 0.5 * float(time[onsets[0]] + time[onsets[-1]])
    rates = rate + _RATES[:, None]
    low = (edges - rates * (time[onsets] - middle)).max(axis=1)
    high = (edges - rates * (time[onsets - 1] - middle)).min(axis=1)
    # the point is assumed uniformly distributed between the bounds at each rate, and the rate normally distributed
    width, centre = high - low, 0.5 * (low + high)
    weight = np.maximum(width, 0.0) * np.exp(-0.5 * (_RATES / _RATE_SPREAD) ** 2)
    if not weight.any():
        # because of the sensor's jitter, the bounds may contradict each other at every rate
        weight[np.argmax(width)] = 1.0
    weight /= weight.sum()
    seconds = float(weight @ centre)
    return Mark(middle, seconds, float(np.sqrt(weight @ ((centre - seconds) ** 2 + width**2 / 12.0))))
