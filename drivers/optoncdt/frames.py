"""Assembly of a sensor's data words into measurements with index and time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.errors import ConnectionLost, RigError
from drivers.optoncdt.codec import Words
from sim.errors import InvalidInput

BITS_PER_VALUE = 30
"""Bits per value on the line: three bytes, each with a start and a stop bit."""

_WISHES = (("COUNTER", "TIMESTAMP"), ("COUNTER",))
"""Sets of additional output signals, in order of preference."""
_VALUES = {"TIMESTAMP": ("TIMESTAMP_LO", "TIMESTAMP_HI")}
"""Signals that are output as several values: the time stamp occupies two values of 16 bits (manual, p. 66)."""


@dataclass(frozen=True)
class Layout:
    """Positions of the values in a measurement of `size` values; the distance is at position 0. `time` holds the
    positions of the lower and upper half of the time stamp; it is None if no time stamp is output.
    """

    size: int
    counter: int
    time: tuple[int, int] | None


def additional_signals(rate: float, baud: int) -> tuple[str, ...]:
    """The additional signals that a line at `baud` can carry at the measuring rate `rate` [1/s]: counter and time
    stamp, or the counter alone.

    Raises InvalidInput if the counter does not fit, since without it a lost value would go unnoticed.
    """
    for signals in _WISHES:
        if (1 + len(_values(signals))) * rate * BITS_PER_VALUE <= baud:
            return signals
    most = baud / (2 * BITS_PER_VALUE)
    allowed = (
        f"{baud} baud allows at most {most:.0f} measurements/s with the counter;"
        " choose a lower rate, or a higher baud rate in the sensor's web interface"
    )
    raise InvalidInput("hardware.lasers.rate", rate, allowed)


def layout_in(who: str, reported: list[str], signals: tuple[str, ...]) -> Layout:
    """The layout of a measurement, from the signals `reported` by GETOUTINFO_RS422, in the order of output (manual, p.
    109).

    Raises RigError if the layout does not begin with the distance or lacks one of `signals`.
    """
    values = _values(tuple(reported))
    needed = _values(signals)
    if not values or not values[0].startswith("DIST") or any(values.count(value) != 1 for value in needed):
        message, sent = ", ".join(signals).lower(), " ".join(reported) or "nothing"
        raise RigError(
            f"{who} sends {sent} instead of distance, {message};"
            " its firmware is not supported: update it, or use the analogue output"
        )
    time = (values.index("TIMESTAMP_LO"), values.index("TIMESTAMP_HI")) if "TIMESTAMP" in signals else None
    return Layout(len(values), values.index("COUNTER"), time)


def _values(signals: tuple[str, ...]) -> list[str]:
    return [value for signal in signals for value in _VALUES.get(signal, (signal,))]


COUNTER_TURN = 2**18
"""Period of the counter, in measurements (manual, p. 66)."""
CLOCK_TURN = 2**32
"""Period of the time stamp, in ticks."""
TICK = 10e-6
"""Resolution of the time stamp [s] (manual, p. 66)."""

_LOCK = 8
"""Number of measurements that must each continue the previous one before values are accepted."""
_FACTORY = 100
"""Number of consecutive single-word measurements after which the sensor is assumed to send only distances."""
_SLACK = 2.0
"""Largest accepted deviation of the time-stamp step between consecutive measurements from one period [periods]."""
_RATE_SLACK = 0.01
"""Largest accepted relative difference between the steps of time stamp and counter over a longer gap."""


@dataclass(frozen=True)
class Frames:
    """Measurements: their index, time on the sensor's clock [s] and distance word, each of shape (n,)."""

    index: NDArray[np.int64]
    time: NDArray[np.float64]
    code: NDArray[np.int32]


class Assembler:
    """Assembles words into measurements at nominally `rate` [1/s] with the given `layout`.

    A burst of lost bytes can join the start of one measurement to the end of a later one. Therefore a measurement is
    accepted only if its counter and time stamp continue those of the previous one, so each gap costs one more
    measurement. Without a time stamp, the time is the index divided by the nominal rate. `values` is the number of
    measurements returned.
    """

    def __init__(self, who: str, layout: Layout, rate: float) -> None:
        self.values = 0
        self._who = who
        self._layout = layout
        self._rate = rate
        self._code = np.empty(0, dtype=np.int32)
        self._first = np.empty(0, dtype=np.bool_)
        self._run = 0
        self._alone = 0
        self._neighbour: tuple[int, int] | None = None
        self._counter, self._ticks = -1, 0
        self._index, self._elapsed = 0, 0

    def feed(self, words: Words) -> Frames:
        """The measurements completed by `words`.

        Raises ConnectionLost if the counter or the time stamp jumps and continues from its new value, or if only
        distances are received: the sensor has restarted, or was silent for too long.
        """
        code, counter, ticks = self._blocks(words)
        if not code.size:
            return Frames(np.empty(0, dtype=np.int64), np.empty(0), code)
        trusted = self._trusted(counter, ticks)
        code, counter, ticks = code[trusted], counter[trusted], ticks[trusted]
        index, elapsed = self._unwrapped(counter, ticks)
        if self._layout.time is None:
            return Frames(index, index.astype(np.float64) / self._rate, code)
        return Frames(index, elapsed.astype(np.float64) * TICK, code)

    def _blocks(self, words: Words) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int64]]:
        """Distance, counter and time stamp (0 if not output) of the complete measurements; an incomplete one is kept
        until more words arrive.
        """
        code = np.concatenate((self._code, words.code))
        first = np.concatenate((self._first, words.first))
        start = np.flatnonzero(first)
        size = np.empty_like(start)
        np.subtract(start[1:], start[:-1], out=size[:-1])
        size[-1:] = code.size - start[-1:]
        kept = int(start[-1]) if start.size and size[-1] < self._layout.size else code.size
        self._code, self._first = code[kept:], first[kept:]
        self._require_no_factory_stream(size)
        start = start[size >= self._layout.size]
        counter = code[start + self._layout.counter].astype(np.int64)
        if self._layout.time is None:
            return code[start], counter, np.zeros_like(counter)
        low, high = (code[start + place].astype(np.int64) & 0xFFFF for place in self._layout.time)
        return code[start], counter, high << 16 | low

    def _require_no_factory_stream(self, size: NDArray[np.int64]) -> None:
        """Raise ConnectionLost if the sensor sends only distances, as it does with its factory settings."""
        whole = np.flatnonzero(size != 1)
        self._alone = size.size - 1 - int(whole[-1]) if whole.size else self._alone + size.size
        if self._layout.size > 1 and self._alone >= _FACTORY:
            raise ConnectionLost(
                f"{self._who} sends distances without a counter: it has restarted with its factory settings; check its"
                " power supply, and reopen the sensor"
            )

    def _trusted(self, counter: NDArray[np.int64], ticks: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Mask of the measurements that continue the previous one; initially only after `_LOCK` of them in a row."""
        before = self._neighbour or (int(counter[0]), int(ticks[0]))
        follows = _steps(counter, before[0], COUNTER_TURN) == 1
        if self._layout.time is not None:
            periods = _steps(ticks, before[1], CLOCK_TURN) * (TICK * self._rate)
            follows &= np.abs(periods - 1.0) <= _SLACK
        self._neighbour = int(counter[-1]), int(ticks[-1])
        if self.values:
            return follows
        # number of measurements in a row, up to each one, that continue the previous one
        place = np.arange(counter.size)
        run = place - np.maximum.accumulate(np.where(follows, -1 - self._run, place))
        self._run = int(run[-1])
        return np.logical_or.accumulate(run > _LOCK) & follows

    def _unwrapped(
        self, counter: NDArray[np.int64], ticks: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Unwrapped index and ticks of each measurement."""
        if not counter.size:
            return counter, ticks
        if not self.values:
            self._counter = self._index = int(counter[0]) - 1
            self._ticks = self._elapsed = int(ticks[0])
        steps = _steps(counter, self._counter, COUNTER_TURN)
        passed = _steps(ticks, self._ticks, CLOCK_TURN)
        steps = self._checked(steps, passed)
        index = self._index + np.cumsum(steps)
        elapsed = self._elapsed + np.cumsum(passed)
        self.values += counter.size
        self._counter, self._ticks = int(counter[-1]), int(ticks[-1])
        self._index, self._elapsed = int(index[-1]), int(elapsed[-1])
        return index, elapsed

    def _checked(self, steps: NDArray[np.int64], passed: NDArray[np.int64]) -> NDArray[np.int64]:
        """The steps of the index, with the wraps of the counter within gaps added; `passed` holds the ticks between
        measurements.
        """
        if self._layout.time is None:
            jump = steps > COUNTER_TURN // 2
        else:
            expected = passed * (TICK * self._rate)
            turns = np.maximum(np.rint((expected - steps) / COUNTER_TURN), 0.0).astype(np.int64)
            steps = steps + turns * COUNTER_TURN
            # after a long gap the clocks may differ by half a period of the counter; the number of wraps is then
            # ambiguous
            slack = 2.0 * _SLACK + _RATE_SLACK * expected
            jump = (np.abs(expected - steps) > slack) | (slack > COUNTER_TURN // 2)
        if jump.any():
            raise ConnectionLost(
                f"{self._who} restarted its counter or was silent for too long; check its power, and reopen the sensor"
            )
        return steps


def _steps(values: NDArray[np.int64], before: int, turn: int) -> NDArray[np.int64]:
    """Forward steps from `before` to the first value and between values; the counts wrap at `turn`, a power of 2."""
    steps = np.empty_like(values)
    steps[0] = values[0] - before
    np.subtract(values[1:], values[:-1], out=steps[1:])
    return steps & (turn - 1)
