"""Values of a serial sensor that a busy computer passes on late: what a block waits for, in virtual time."""

import numpy as np
import pytest

from drivers.hardware.tracks import MARKS, Track, Tracks, longest_wait
from drivers.optoncdt.codec import LATE
from drivers.optoncdt.stream import Readings
from drivers.rig import Channel
from drivers.timebase.sensor_track import SensorTrack

RATE, MEASURED = 2000.0, 4000.0
BLOCK = 200
USUAL = 0.004
"""Transfer of a value [s]."""


class Machine:
    """A clock that passes only while somebody waits for it."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        return self.time

    def wait_until(self, instant: float) -> None:
        self.time = max(self.time, instant)


class Delayed:
    """A sensor whose values are all passed on at the end of the stall in which they arrive."""

    def __init__(self, machine: Machine, stall: tuple[float, float]) -> None:
        self._machine, self._stall = machine, stall
        self._taken = 0
        self.silent = False

    def start(self) -> None:
        pass

    def _arrivals(self, index: np.ndarray) -> np.ndarray:
        arrival = index / MEASURED + USUAL
        begin, end = self._stall
        return np.where((arrival > begin) & (arrival < end), end, arrival)

    def take(self) -> Readings:
        index = np.arange(self._taken, int(self._machine.time * MEASURED) + 1)
        arrival = self._arrivals(index)
        there = arrival <= self._machine.time
        index, arrival = index[there], arrival[there]
        self._taken += index.size
        return Readings(index, index / MEASURED, (index % 1000).astype(np.int32), arrival)

    def wait(self, timeout: float) -> bool:
        due = float(self._arrivals(np.array([self._taken]))[0])
        self._machine.time = min(max(due, self._machine.time), self._machine.time + timeout)
        return due <= self._machine.time

    def close(self) -> None:
        pass


def late_in(monkeypatch: pytest.MonkeyPatch, lead: float, stall: float) -> tuple[int, float]:
    """Number of late samples in a run of 3 s with such a stall [s], and the longest delay of a block [s]."""
    machine = Machine()
    monkeypatch.setattr("drivers.hardware.tracks.now", machine.now)
    sensor = Delayed(machine, (4.0, 4.0 + stall))
    placing = SensorTrack("tilt", MEASURED, 0.006, lambda code: code.astype(np.int16), 32_000, MARKS)
    tracks = Tracks([Track(sensor, Channel("tilt", "angle", "rad", 1e-4, 0.0, (-1, 1), "made"), placing, 2.0)])
    tracks.begin(RATE, machine)
    began, late, longest = machine.time, 0, 0.0
    for first in range(0, round(3.0 * RATE), BLOCK):
        machine.wait_until(began + (first + BLOCK) / RATE)
        tracks.observe(machine.time, int((machine.time - began) * RATE) + 1, machine.time)
        late += int(np.count_nonzero(tracks.counts(first, BLOCK, round(lead * RATE)) == LATE))
        longest = max(longest, machine.time - began - (first + BLOCK) / RATE)
    return late, longest


@pytest.mark.parametrize(("lead", "stall"), [(0.1, 0.04), (0.4, 0.29), (1.5, 0.39)])
def test_a_block_waits_for_values_that_the_queued_drive_allows_to_wait_for(
    monkeypatch: pytest.MonkeyPatch, lead: float, stall: float
) -> None:
    late, longest = late_in(monkeypatch, lead, stall)
    assert late == 0
    assert longest < lead


@pytest.mark.parametrize(("lead", "wait"), [(0.01, 0.005), (0.1, 0.05), (0.4, 0.3), (1.5, 0.4)])
def test_the_wait_leaves_time_for_the_next_write(monkeypatch: pytest.MonkeyPatch, lead: float, wait: float) -> None:
    late, longest = late_in(monkeypatch, lead, 1.0)
    assert late > 0
    # half a millisecond is a sample
    assert longest == pytest.approx(wait, abs=1e-3)


def test_a_block_that_is_itself_late_still_waits_for_what_a_stall_has_left_in_the_pipe() -> None:
    assert longest_wait(1.5, 0.45) == pytest.approx(0.05)
    assert longest_wait(0.4, 0.35) == pytest.approx(0.025)
    assert longest_wait(0.1, 0.2) == 0.0


@pytest.mark.parametrize(("first", "waited"), [(0.0, 0.0), (0.3, 0.3), (5.0, 0.0)])
def test_a_sensor_is_observed_from_its_first_value_on(
    monkeypatch: pytest.MonkeyPatch, first: float, waited: float
) -> None:
    """Measured from `first` [s] on; a sensor that is still silent at the end of the observation is not waited for."""
    machine = Machine()
    monkeypatch.setattr("drivers.hardware.tracks.now", machine.now)
    sensor = Delayed(machine, (0.0, 0.0))
    sensor._taken = round(first * MEASURED)
    placing = SensorTrack("tilt", MEASURED, 0.006, lambda code: code.astype(np.int16), 32_000, MARKS)
    tracks = Tracks([Track(sensor, Channel("tilt", "angle", "rad", 1e-4, 0.0, (-1, 1), "made"), placing, 1.0)])
    tracks.begin(RATE, machine)
    assert machine.time == pytest.approx(1.0 + waited, abs=0.06)
    assert (placing.history >= 1.0) is (first < 1.0)
