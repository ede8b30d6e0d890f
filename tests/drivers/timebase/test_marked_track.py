"""A laser aligned by pulses on made clocks: its beam is switched off between the runs and at the beginning of a run."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.timebase.clocks import SampleClock
from drivers.timebase.marking import Pulses, golden_pulses, observation_pulses
from drivers.timebase.sensor_track import SensorTrack
from tests.drivers.timebase.made_clocks import SWITCHED_ON, Daq, Stream, stream
from tests.drivers.timebase.test_sensor_track import MARKS, marked

RATE, SAMPLE_RATE = 4000.0, 2000.0
SENSOR, DAQ = 30e-6, -20e-6
OFF = 262082
BETWEEN, AT_ARMING = observation_pulses(RATE), golden_pulses(RATE)


def dark(seconds: NDArray[np.float64], pulses: Pulses) -> NDArray[np.bool_]:
    since = seconds - pulses.delay
    return (since >= 0.0) & (seconds < pulses.end) & (np.mod(since, pulses.spacing) < pulses.high)


class Laboratory:
    """A laser that is observed for `observed` [s] before runs whose sample clock is known exactly;
    the values are fetched in steps of `step` [s]."""

    def __init__(self, sent: Stream, observed: float, pulses: Pulses | None = BETWEEN, step: float = 0.1) -> None:
        self.sent, self.pulses, self.step = sent, pulses, step
        self.laser = SensorTrack("laser_1", RATE, 0.0, marked, 32760, MARKS)
        self.code = np.full(sent.index.size, 32760, np.int32)
        self._fed = 0
        self._daq = Daq(1, SWITCHED_ON, DAQ)
        self.rest(SWITCHED_ON, SWITCHED_ON + observed)

    def rest(self, begin: float, end: float) -> None:
        """Pulses between the runs, from `begin` to `end` [s of true time]."""
        if self.pulses is not None:
            taken = self.sent.taken
            self.code[dark((taken - begin) * (1.0 + DAQ), self.pulses) & (taken < end)] = OFF
        self.now = end

    def arm(self) -> bool:
        """Begin a run; returns whether its pulses were found."""
        self._feed(self.now)
        if self.pulses is not None:
            self.laser.observe_pulses(self.pulses.spacing)
        self.laser.begin()
        self._daq = Daq(7, self.now + 0.1, DAQ)
        self.clock = SampleClock(SAMPLE_RATE)
        self.code[dark(self.true(self.sent.taken), AT_ARMING)] = OFF
        self.run(AT_ARMING.end + 0.05)
        return self.laser.mark(self.clock, AT_ARMING)

    def run(self, end: float) -> None:
        """Acquire up to second `end` of the sample clock."""
        while (passed := float(self.true(np.array([self.now]))[0])) < end:
            self._daq.wait_for(round((passed + self.step) * SAMPLE_RATE))
            for _ in range(6):
                self.clock.observe(*self._daq.look())
            self.now = self._daq.now
            self._feed(self.now)
            self.laser.reach(self.clock)

    def true(self, moment: NDArray[np.float64]) -> NDArray[np.float64]:
        """Seconds of the sample clock at true times [s]."""
        return (moment - self._daq.started) * (1.0 + DAQ)

    def error(self) -> float:
        """Error of the alignment at the newest value [s]."""
        one, last = self.laser.alignment(self.clock), self._fed - 1
        placed = one.offset + one.rate * self.sent.time[last]
        return placed - float(self.true(self.sent.taken[last : last + 1])[0])

    def error_at_arming(self) -> float:
        """Error of the alignment in the middle of the pulses [s]."""
        one = self.laser.alignment(self.clock)
        value = int(np.searchsorted(self.true(self.sent.taken), 0.5 * AT_ARMING.end))
        return one.offset + one.rate * self.sent.time[value] - float(self.true(self.sent.taken[value : value + 1])[0])

    def _feed(self, until: float) -> None:
        new = slice(self._fed, int(np.searchsorted(self.sent.arrival, until)))
        self.laser.add(self.sent.index[new], self.sent.time[new], self.code[new], self.sent.arrival[new])
        self._fed = new.stop


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.soak) for seed in (2, 3, 4))])
def test_half_a_minute_is_aligned_within_10_microseconds(seed: int) -> None:
    """Whatever the arrivals: they are late by half a millisecond on average, and now and then by 50 ms."""
    laboratory = Laboratory(stream(seed, 45.0, SENSOR), 10.0 + 0.1 * seed, step=0.25)
    assert laboratory.arm()
    for second in (2.0, 5.0, 15.0, 30.0):
        laboratory.run(second)
        assert abs(laboratory.error()) < 10e-6
        assert abs(laboratory.error_at_arming()) < 10e-6


def test_without_pulses_between_the_runs_the_arrivals_give_the_rate() -> None:
    laboratory = Laboratory(stream(5, 30.0, SENSOR), 10.0, pulses=None)
    assert laboratory.arm()
    assert abs(laboratory.error_at_arming()) < 10e-6
    laboratory.run(15.0)
    assert 1e-6 < abs(laboratory.error()) < 200e-6


def test_a_beam_that_does_not_follow_leaves_the_arrivals() -> None:
    laboratory = Laboratory(stream(6, 20.0, SENSOR), 10.0, replace(BETWEEN, high=0.0, low=BETWEEN.spacing))
    laboratory.code[:] = 32760
    assert laboratory.arm()
    assert abs(laboratory.error_at_arming()) < 10e-6


def test_the_rate_is_kept_for_a_run_that_follows_at_once() -> None:
    laboratory = Laboratory(stream(7, 30.0, SENSOR), 10.0)
    assert laboratory.arm()
    laboratory.run(3.0)
    begin = laboratory.now
    laboratory.rest(begin + 0.02, begin + 0.05)
    assert laboratory.arm()
    laboratory.run(8.0)
    assert abs(laboratory.error()) < 10e-6


@pytest.mark.soak
def test_a_rate_that_drifts_during_a_long_run_is_followed_by_the_arrivals() -> None:
    """It changes by 2 ppm after 50 s: with the rate at arming, the alignment would be wrong by 500 us after 300 s."""
    laboratory = Laboratory(stream(8, 325.0, 1e-6, turn=60.0), 10.0, step=1.0)
    assert laboratory.arm()
    laboratory.run(300.0)
    assert abs(laboratory.error()) < 200e-6
