"""The sensor without its serial line: clock, measurements and output bytes."""

from dataclasses import replace
from math import floor

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from drivers.emulation.optoncdt.evaluation import WORD_BITS, Evaluation, Fault, Optics, faults_of, words
from drivers.emulation.optoncdt.settings import Mastering, Settings
from drivers.emulation.plant import Sight
from sim.sensors import Laser

TICKS = 100_000
"""Time-stamp ticks per second of the sensor's clock (manual of the optoNCDT 1420, p. 66)."""


class Zero:
    """Resettable zero of a counter; values before a reset are counted from the previous zero."""

    def __init__(self, now: float) -> None:
        self._before = self.now = now

    def reset(self, now: float) -> None:
        self._before, self.now = self.now, now

    def since(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Ascending `values`, shape (n,) with n > 0, each counted from its zero."""
        if values[0] >= self.now:
            return values - self.now
        return values - np.where(values < self.now, self._before, self.now)


class Grid:
    """Exposures at equal intervals of the sensor's clock, which has the relative error `clock_error`.

    Times are host times [s]. Exposures are numbered from power-up; the numbers continue through changes of the rate.
    """

    def __init__(self, rate: float, clock_error: float, origin: float) -> None:
        self._pace = 1.0 + clock_error
        self.rate = rate * self._pace
        self._origin, self.first = origin, 0
        self.epoch = Zero(origin)
        self.count = Zero(0)

    def change(self, rate: float, now: float) -> None:
        """Measure `rate` times per second of the sensor's clock from `now` on."""
        self.first = self.end(now)
        self.rate = rate * self._pace
        self._origin = now + 1.0 / self.rate

    def end(self, now: float) -> int:
        """Number of the first exposure after `now`."""
        return self.first + max(floor((now - self._origin) * self.rate) + 1, 0)

    def times(self, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
        """Times of the exposures `numbers` [s]."""
        return self._origin + (numbers - self.first) / self.rate

    def counters(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """The 18-bit counters of the exposures `numbers`."""
        return self.count.since(numbers.astype(np.float64)).astype(np.int64) & 0x3FFFF

    def stamps(self, times: NDArray[np.float64]) -> NDArray[np.int64]:
        """The 32-bit time stamps of exposures at `times`, in ticks."""
        return np.floor(self.epoch.since(times) * (self._pace * TICKS)).astype(np.int64) & 0xFFFFFFFF

    @property
    def stamp_lag(self) -> float:
        """Time from the last tick of the time stamp to the first exposure at the present rate [s]. All later exposures
        have the same lag if a cycle is a whole number of ticks, as at all rates except 8 kHz.
        """
        ticks = (float(self.times(np.array([self.first]))[0]) - self.epoch.now) * self._pace * TICKS
        return (ticks - floor(ticks)) / TICKS


PIPELINE = 3
"""Measuring cycles between exposure and output (manual of the optoNCDT 1420, p. 52, and of the 1320, p. 42)."""
_PAST = 10.0
"""Longest stall of the computer without loss of measurements [s]."""
_EXPOSURE = 1000
"""Exposure time reported by the sensor, in tenths of a microsecond."""
_INTENSITY = 32736
"""Intensity reported by the sensor: 50 %."""
_STATES = {
    0: 1 << 16,
    Fault.NO_PEAK: 2 << 16 | 1 << 2,
    Fault.TOO_CLOSE: 2 << 16 | 1 << 5,
    Fault.TOO_FAR: 2 << 16 | 1 << 6,
}
"""Status words: bits 16 and 17 give the colour of the LED, green (1) or red (2); bits 2, 5 and 6 give the reason for
red (manual of the optoNCDT 1420, p. 66).
"""

Codes = NDArray[np.int64]


class Sensor:
    """Measures the target `sight` from the host time `now` [s] on; `as_found` are its settings at power-up."""

    def __init__(
        self, sight: Sight, laser: Laser, clock_error: float, random: Generator, as_found: Settings, now: float
    ) -> None:
        self._sight = sight
        self._clock_error = clock_error
        self._phase = float(random.uniform())
        self._optics = Optics(laser, random)
        self._evaluation = Evaluation(laser.measuring_range)
        self.measuring_range = laser.measuring_range
        self.stored = as_found
        self.beam = True
        """Whether the on/off input of the laser is closed, so that the laser is on."""
        self.switching = np.zeros(0)
        """Ascending host times [s] at which the on/off input of the laser is opened and closed in turn."""
        self.target: Fault | None = None
        """Fault that a substitute for the target causes; None while the target is `sight`."""
        self.boot(now)

    def boot(self, ready: float) -> None:
        """Enter the power-up state at the instant `ready`."""
        self.ready = ready
        self.settings = self.stored
        self.grid = Grid(self.settings.rate, self._clock_error, ready + self._phase / self.settings.rate)
        self._following = 0
        self._evaluation.restart()

    def apply(self, settings: Settings, now: float) -> None:
        if settings.rate != self.settings.rate:
            self.grid.change(settings.rate, now)
            self._following = self.grid.first
            self._evaluation.restart()
        self.settings = settings

    def stream(self, now: float) -> NDArray[np.uint8]:
        """The bytes output since the last call, in whole blocks."""
        settings = self.settings
        if settings.output != "RS422" or settings.trigger != "NONE":
            self._following = self.grid.end(now)
            self._evaluation.restart()
            return np.empty(0, dtype=np.uint8)
        sending = self.values * WORD_BITS / settings.baud
        end = self.grid.end(now - PIPELINE / self.grid.rate - sending)
        if end <= self._following:
            return np.empty(0, dtype=np.uint8)
        numbers = np.arange(max(self._following, self.grid.end(now - _PAST)), end)
        self._following = end
        return words(self._blocks(numbers))

    @property
    def values(self) -> int:
        """Number of values in a block; a time stamp occupies two."""
        return 1 + len(self.settings.additional) + ("TIMESTAMP" in self.settings.additional)

    def look(self, now: float) -> float | None:
        """The present distance as a fraction of the measuring range; None if it is invalid."""
        shares, faults = self._measure(np.array([now]))
        return None if faults[0] else float(shares[0])

    def master(self, value: float, now: float) -> bool:
        """Master the present distance to `value` [m]; returns False if the distance is invalid."""
        place = self.look(now)
        if place is None:
            return False
        self.settings = replace(self.settings, mastering=Mastering(place, value))
        return True

    def _measure(self, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], Codes]:
        """Fractions of the measuring range and faults at `times`, shape (n,) each; the fractions are meaningless where
        there is a fault.
        """
        if not self.beam or self.settings.laser_power == "OFF":
            return np.full(times.size, np.nan), np.full(times.size, Fault.LASER_OFF)
        if self.target is not None:
            return np.full(times.size, np.nan), np.full(times.size, self.target)
        shares = self._optics.shares(self._sight.displacement(times))
        faults = faults_of(shares)
        # another thread may replace the attribute
        switching = self.switching
        if switching.size:
            dark = np.searchsorted(switching, times, side="right") % 2 == 1
            shares[dark], faults[dark] = np.nan, Fault.LASER_OFF
        return shares, faults

    def _blocks(self, numbers: Codes) -> Codes:
        """Transmitted values of the exposures `numbers`, shape (n, values)."""
        times = self.grid.times(numbers)
        shares, faults = self._measure(times)
        codes = self._evaluation.codes(shares, faults, self.settings)
        every = self.settings.reduction if "RS422" in self.settings.reduced else 1
        too_much = self.values * WORD_BITS * self.grid.rate / every / self.settings.baud
        if too_much > 1.0:
            # every distance is replaced by an error, in as many blocks as fit on the line
            codes = np.full(numbers.size, Fault.DATA_VOLUME)
            every = int(np.ceil(every * too_much))
        blocks = np.array([codes, *self._additional(numbers, times, shares, faults)]).T
        return blocks if every == 1 else blocks[numbers % every == 0]

    def _additional(
        self, numbers: Codes, times: NDArray[np.float64], shares: NDArray[np.float64], faults: Codes
    ) -> list[Codes]:
        """The additional values sent with the distances, shape (n,) each, in the order of transmission."""
        columns: list[Codes] = []
        for name in self.settings.additional:
            match name:
                case "COUNTER":
                    columns.append(self.grid.counters(numbers))
                case "TIMESTAMP":
                    stamps = self.grid.stamps(times)
                    columns += [stamps & 0xFFFF, stamps >> 16]
                case "SHUTTER":
                    columns.append(np.full(numbers.size, _EXPOSURE))
                case "INTENSITY":
                    columns.append(np.where(np.isnan(shares), 0, _INTENSITY))
                case "STATE":
                    columns.append(np.array([_STATES.get(fault, 0) for fault in faults.tolist()], dtype=np.int64))
                case _:
                    raw = np.where(np.isnan(shares), 0.0, np.clip(shares, 0.0, 1.0))
                    columns.append(np.rint(raw * 0x3FFFF).astype(np.int64))
        return columns
