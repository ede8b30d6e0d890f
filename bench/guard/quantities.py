"""Magnitudes of the limited quantities of table motion, shaker load and lasers, block by block."""

from collections.abc import Mapping, Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from bench.guard.conversion import Extremes
from bench.guard.shaker import ShakerModel, exponential_mean
from drivers.rig import Channel
from sim.channel import COIL_CURRENT, STOREYS, TABLE_ACCELERATION, TABLE_DISPLACEMENT, TABLE_FORCE

Array = NDArray[np.float64]

VELOCITY_WINDOW = 0.02
"""Interval of the difference quotient for the velocity [s]: long enough to suppress noise, short compared with the
usual periods of the motion.
"""

MOST_SKIPPED = 4000
"""Number of skipped samples after which the heating is updated."""

RESERVE = 0.1
"""Distance from zero of the middle of a laser's valid counts, relative to half their range, up to which zero is taken
for mid range.
"""

ROUNDING = 1e-9
"""Relative allowance for the rounding errors of a mean over `MOST_SKIPPED` samples."""


class WatchedQuantities:
    """Conversion of blocks of channel values to magnitudes of the limited quantities.

    A missing value of a table channel counts as infinite: its converter is probably saturated. A missing value of a
    laser is ignored here; `bench.guard.sensors` checks for the loss of a sensor.

    A block is either converted by `of` or skipped: `bounds` returns upper bounds of its magnitudes, and `skip` stores
    the state required by later blocks.

    `laser_ranges` are the measuring ranges of the two lasers [m]. The valid counts of a laser may have a reserve beyond
    the measuring range, also at one end only; without a range, or with a smaller one, they are its range.
    """

    def __init__(
        self,
        channels: tuple[Channel, ...],
        sample_rate: float,
        heating_time: float,
        shaker: ShakerModel | None,
        laser_ranges: Sequence[float] | None = None,
    ) -> None:
        self._names = [channel.name for channel in channels]
        self._columns = {channel.name: column for column, channel in enumerate(channels)}
        self._shaker = shaker
        self._span = max(round(VELOCITY_WINDOW * sample_rate), 1)
        self._span_time = self._span / sample_rate
        self._tail = self._long = np.zeros(0)
        self._forget = float(np.exp(-1.0 / (heating_time * sample_rate)))
        # load the compiled function here, not while the table moves
        self._heat = exponential_mean(np.zeros(1), self._forget)[1]
        self._skipped: list[Array] = []
        self._skipped_samples, self._skipped_current = 0, 0.0
        ranges = {} if laser_ranges is None else dict(zip(STOREYS, laser_ranges, strict=True))
        self._places = [
            (k, *_middle(channels[k], ranges.get(name))) for name, k in self._columns.items() if name in STOREYS
        ]

    @property
    def heat(self) -> float:
        """Exponential mean of the squared current [A2] up to the last block."""
        self._catch_up()
        return self._mean_square()

    def warm(self, heat: float) -> None:
        """Set the exponential mean of the squared current before the first block to `heat` [A2]."""
        self._heat = np.array([heat * self._forget])

    def of(self, values: Array) -> dict[str, Array]:
        """Magnitude of each measured or estimated quantity, shape (n,), by key in `WATCHED`."""
        self._catch_up()
        found: dict[str, Array] = {}
        x, a = self._column(values, TABLE_DISPLACEMENT), self._column(values, TABLE_ACCELERATION)
        if x is not None:
            found["displacement"] = _magnitude(x)
            found["velocity"] = _magnitude(self._velocity(x))
        if a is not None:
            found["acceleration"] = _magnitude(a)
        self._add_load(found, values)
        if (place := self._laser_place(values)) is not None:
            found["laser_range"] = place
        return found

    def bounds(self, values: Array, extremes: Extremes) -> dict[str, float]:
        """Upper bound of each magnitude that `of` would return for a block without missing samples.

        Every rounded operation is monotonic. The bounds are therefore bit-identical to the largest magnitudes, except
        that current and heating may be below their bounds.
        """
        found: dict[str, float] = {}
        columns, shaker = self._columns, self._shaker
        x, a = columns.get(TABLE_DISPLACEMENT), columns.get(TABLE_ACCELERATION)
        force, current = columns.get(TABLE_FORCE), columns.get(COIL_CURRENT)
        displaced, accelerated = 0.0, 0.0
        if x is not None:
            found["displacement"] = displaced = extremes.magnitude(x)
            self._long = np.concatenate((self._tail, values[:, x]))
            change = self._long[self._span :] - self._long[: -self._span]
            found["velocity"] = largest(change) / self._span_time if change.size else 0.0
        if a is not None:
            found["acceleration"] = accelerated = extremes.magnitude(a)
        if force is not None:
            found["force"] = extremes.magnitude(force)
        elif shaker is not None and a is not None:
            found["force"] = shaker.largest_force(accelerated)
        if current is not None:
            found["current"] = extremes.magnitude(current)
        elif shaker is not None and a is not None:
            found["current"] = shaker.largest_current(accelerated, displaced)
        if "current" in found:
            found["heating"] = self._largest_heating(found["current"])
        if self._places:
            found["laser_range"] = max(
                [max(middle - extremes.low[k], extremes.high[k] - middle) / half for k, middle, half in self._places]
            )
        return found

    def displayed(self, values: Array, magnitudes: Mapping[str, float]) -> dict[str, float]:
        """Magnitudes of a block for display: the current itself instead of its bound, the heating at its last update,
        about `MOST_SKIPPED` samples ago at most, and the position of each laser within its range instead of the largest
        one.
        """
        found = {key: value for key, value in magnitudes.items() if key != "laser_range"}
        if "current" in found and (current := self._load(values)[1]) is not None:
            found["current"] = largest(np.nan_to_num(current))
            found["heating"] = sqrt(self._mean_square())
        for k, middle, half in self._places:
            # NaN for a laser without a valid sample
            found[self._names[k]] = float(np.fmax.reduce(np.abs(values[:, k] - middle))) / half
        return found

    def skip(self, values: Array, bounds: dict[str, float]) -> None:
        """Skip a block without missing samples; `bounds` are those that the method `bounds` returned for this block."""
        self._tail = self._long[-self._span :]
        if "current" in bounds:
            self._skipped.append(values)
            self._skipped_samples += len(values)
            self._skipped_current = max(self._skipped_current, bounds["current"])
            if self._skipped_samples > MOST_SKIPPED:
                self._catch_up()

    def _largest_heating(self, current: float) -> float:
        """Upper bound of the heating up to the end of a block whose largest current is `current` [A]: the running mean
        of the squares is at most the greater of its initial value and the largest square since.
        """
        return sqrt(max(self._mean_square(), self._skipped_current**2, current**2) * (1.0 + ROUNDING))

    def _mean_square(self) -> float:
        return max(float(self._heat[0]), 0.0) / self._forget if self._forget > 0.0 else 0.0

    def _catch_up(self) -> None:
        """Update the heating for the skipped blocks."""
        if self._skipped:
            values = np.concatenate(self._skipped)
            self._skipped, self._skipped_samples, self._skipped_current = [], 0, 0.0
            if (current := self._load(values)[1]) is not None:
                self._heating(np.nan_to_num(current))

    def _load(self, values: Array) -> tuple[Array | None, Array | None]:
        """Force [N] and current [A], measured or estimated; None where neither is possible."""
        x, a = self._column(values, TABLE_DISPLACEMENT), self._column(values, TABLE_ACCELERATION)
        force, current = self._column(values, TABLE_FORCE), self._column(values, COIL_CURRENT)
        if (shaker := self._shaker) is not None and a is not None:
            known = np.nan_to_num(a)
            if force is None:
                force = shaker.force(known)
            if current is None:
                current = shaker.current(known, np.zeros(known.size) if x is None else np.nan_to_num(x))
        return force, current

    def _add_load(self, found: dict[str, Array], values: Array) -> None:
        force, current = self._load(values)
        if force is not None:
            found["force"] = _magnitude(force)
        if current is not None:
            found["current"] = _magnitude(current)
            found["heating"] = self._heating(np.nan_to_num(current))

    def _heating(self, current: Array) -> Array:
        """Root of the exponential mean of the squared current [A], a measure of the coil's temperature."""
        mean, self._heat = exponential_mean(current**2, self._forget, self._heat)
        return np.sqrt(mean)

    def _velocity(self, x: Array) -> Array:
        long = filled(np.concatenate((self._tail, x)))
        speed = np.zeros(x.size)
        if long.size > self._span:
            differenced = (long[self._span :] - long[: -self._span]) / self._span_time
            speed[-min(differenced.size, x.size) :] = differenced[-x.size :]
        self._tail = long[-self._span :]
        return speed

    def _laser_place(self, values: Array) -> Array | None:
        places = [np.abs(np.nan_to_num((values[:, k] - middle) / half)) for k, middle, half in self._places]
        return np.maximum.reduce(places) if places else None

    def _column(self, values: Array, name: str) -> Array | None:
        column = self._columns.get(name)
        return None if column is None else values[:, column]


def filled(x: Array) -> Array:
    """`x`, shape (n,), with missing samples replaced by the last valid one before them, or by 0 if there is none."""
    missing = np.isnan(x)
    if not missing.any():
        return x
    last = np.maximum.accumulate(np.where(missing, 0, np.arange(x.size)))
    return np.nan_to_num(x[last])


def _magnitude(x: Array) -> Array:
    return np.where(np.isnan(x), np.inf, np.abs(x))


def _middle(channel: Channel, measuring_range: float | None) -> tuple[float, float]:
    """Middle and half of the range of a laser [m]."""
    low, high = channel.limits
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    if measuring_range is None or measuring_range >= 2.0 * half:
        return middle, half
    # values relative to mid range, with a reserve that may be at one end only
    return (0.0 if abs(middle) <= RESERVE * half else middle), 0.5 * measuring_range


def largest(x: Array) -> float:
    """Largest magnitude of values of shape (n,), n > 0; NaN if one is missing."""
    return max(-float(np.minimum.reduce(x)), float(np.maximum.reduce(x)))
