"""The sensor without its line: it measures, and what it has to send comes out as bytes."""

from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from drivers.emulation.optoncdt.evaluation import Evaluation, Optics, faults_of
from drivers.emulation.optoncdt.grid import Grid
from drivers.emulation.optoncdt.settings import Mastering, Settings
from drivers.emulation.optoncdt.words import WORD_BITS, Fault, words
from drivers.emulation.plant import Sight
from sim.sensors import Laser

PIPELINE = 3
"""Measuring cycles between exposure and output (manual of the optoNCDT 1420, p. 52, and of its sibling 1320, p. 42)."""
_PAST = 10.0
"""After a longer standstill of the machine, older measurements are lost [s]."""
_EXPOSURE = 1000
"""Exposure time that the sensor reports, in tenths of a microsecond."""
_INTENSITY = 32736
"""Intensity that the sensor reports: 50 %."""
_STATES = {
    0: 1 << 16,
    Fault.NO_PEAK: 2 << 16 | 1 << 2,
    Fault.TOO_CLOSE: 2 << 16 | 1 << 5,
    Fault.TOO_FAR: 2 << 16 | 1 << 6,
}
"""Status words: the light is green (1) or red (2), bits 2, 5 and 6 say why (manual of the optoNCDT 1420, p. 66)."""

Codes = NDArray[np.int64]


class Sensor:
    """Looks at `sight` from `now` on; `as_found` are its settings at power-up. Times are host times [s]."""

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
        """Whether the input that switches the laser on is tied to ground."""
        self.target: Fault | None = None
        """What there is to be seen instead of what the sight gives."""
        self.boot(now)

    def boot(self, ready: float) -> None:
        """Be as after power-up from the instant `ready` on."""
        self.ready = ready
        self.settings = self.stored
        self.grid = Grid(self.settings.rate, self._clock_error, ready + self._phase / self.settings.rate)
        self._following = 0
        self._evaluation.restart()

    def apply(self, settings: Settings, now: float) -> None:
        """Work with other settings from `now` on."""
        if settings.rate != self.settings.rate:
            self.grid.change(settings.rate, now)
            self._following = self.grid.first
            self._evaluation.restart()
        self.settings = settings

    def stream(self, now: float) -> NDArray[np.uint8]:
        """The bytes that came out of the sensor since the last call, in whole blocks."""
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
        """Values in a block: a time stamp takes two."""
        return 1 + len(self.settings.additional) + ("TIMESTAMP" in self.settings.additional)

    def look(self, now: float) -> float | None:
        """The distance seen now as a share of the measuring range; None when there is no valid one."""
        shares, faults = self._measure(np.array([now]))
        return None if faults[0] else float(shares[0])

    def master(self, value: float, now: float) -> bool:
        """Call the present distance `value` [m]; False when there is none."""
        place = self.look(now)
        if place is None:
            return False
        self.settings = replace(self.settings, mastering=Mastering(place, value))
        return True

    def _measure(self, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], Codes]:
        """Shares of the measuring range and faults at `times`, shape (n,) each; a share is void where a fault is."""
        if not self.beam or self.settings.laser_power == "OFF":
            return np.full(times.size, np.nan), np.full(times.size, Fault.LASER_OFF)
        if self.target is not None:
            return np.full(times.size, np.nan), np.full(times.size, self.target)
        shares = self._optics.shares(self._sight.displacement(times))
        return shares, faults_of(shares)

    def _blocks(self, numbers: Codes) -> Codes:
        """What is sent of the exposures of these numbers, shape (n, values)."""
        times = self.grid.times(numbers)
        shares, faults = self._measure(times)
        codes = self._evaluation.codes(shares, faults, self.settings)
        every = self.settings.reduction if "RS422" in self.settings.reduced else 1
        too_much = self.values * WORD_BITS * self.grid.rate / every / self.settings.baud
        if too_much > 1.0:
            # an error in place of every distance, in as many blocks as the line can carry
            codes = np.full(numbers.size, Fault.DATA_VOLUME)
            every = int(np.ceil(every * too_much))
        blocks = np.array([codes, *self._additional(numbers, times, shares, faults)]).T
        return blocks if every == 1 else blocks[numbers % every == 0]

    def _additional(
        self, numbers: Codes, times: NDArray[np.float64], shares: NDArray[np.float64], faults: Codes
    ) -> list[Codes]:
        """The values that are sent along with the distances, shape (n,) each, in the order of the line."""
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
