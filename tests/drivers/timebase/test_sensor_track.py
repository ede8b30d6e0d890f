"""A laser on a made sensor clock, resampled on a made sample clock: the motion is a sine of true time."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from drivers.timebase.clocks import SampleClock
from drivers.timebase.resampling import Marks
from drivers.timebase.sensor_track import SensorTrack
from tests.calls import calls
from tests.drivers.timebase.made_clocks import FLOOR, SWITCHED_ON, Daq, Stream, stream

LOST, NO_PEAK, OFF = -32768, -32767, -32762
LATE, IMPLAUSIBLE = 32767, 32766
MARKS = Marks(LOST, LATE, IMPLAUSIBLE)
OMEGA = 2.0 * np.pi * 2.0
AMPLITUDE = 30_000.0
SAMPLE_RATE = 2000.0
BLOCK = 200


def marked(code: NDArray[np.int32]) -> NDArray[np.int16]:
    """Codes 0 to 65520 from mid range, and two error words (manual, p. 65 and 66)."""
    counts = np.where(code <= 65520, code - 32760, LOST)
    return np.select([code == 262076, code == 262082], [NO_PEAK, OFF], counts).astype(np.int16)


def codes(taken: NDArray[np.float64]) -> NDArray[np.int32]:
    return (32760 + np.rint(AMPLITUDE * np.sin(OMEGA * taken))).astype(np.int32)


def track(delay: float = 0.0, largest_step: float = np.inf) -> SensorTrack:
    return SensorTrack("laser_1", 4000.0, delay, marked, 32760, MARKS, largest_step)


class Bench:
    """Feeds a track with what has arrived, and reads blocks as a rig does."""

    def __init__(self, sent: Stream, daq: Daq, laser: SensorTrack) -> None:
        self.sent, self.daq, self.laser = sent, daq, laser
        self.code = codes(sent.taken)
        self.clock = SampleClock(daq.sample_rate)
        self._fed = 0
        self._first = 0
        self._feed()
        laser.begin()
        for _ in range(20):
            self.clock.observe(*daq.look())

    def block(self, patience: float = 0.1) -> NDArray[np.int16]:
        self.daq.wait_for(self._first + BLOCK - 1)
        for _ in range(3):
            self.clock.observe(*self.daq.look())
        last = (self._first + BLOCK - 1) / self.daq.sample_rate
        deadline = self.daq.now + patience
        self._feed()
        while self.laser.reach(self.clock) < last and self.daq.now < deadline:
            self.daq.now += 0.002
            self._feed()
        counts = self.laser.counts(self.clock, self._first, BLOCK, self.daq.sample_rate)
        self._first += BLOCK
        return counts

    def _feed(self) -> None:
        now = slice(self._fed, int(np.searchsorted(self.sent.arrival, self.daq.now)))
        self.laser.add(self.sent.index[now], self.sent.time[now], self.code[now], self.sent.arrival[now])
        self._fed = now.stop


def delays(daq: Daq, counts: NDArray[np.int16]) -> NDArray[np.float64]:
    """By how much later than it was the motion is seen, once per second [s]: from its phase."""
    n = round(daq.sample_rate)
    seen = counts.astype(np.float64).reshape(-1, n)
    phase = OMEGA * daq.moment(np.arange(counts.size, dtype=np.float64)).reshape(-1, n)
    return -np.arctan2((seen * np.cos(phase)).mean(axis=1), (seen * np.sin(phase)).mean(axis=1)) / OMEGA


def known(rate: float = 1.0, delay: float = 0.0, largest_step: float = np.inf) -> tuple[SensorTrack, SampleClock]:
    """A track of a sensor of 4000 1/s without any delay or error, and a clock that agrees: sensor second 2 is 0."""
    laser, clock = track(delay, largest_step), SampleClock(1000.0)
    for count in range(1, 2001):
        # the look ends when sample count - 1 is taken, and begins when sample count is due: no room between
        clock.observe(102.0 + count / 1000.0, count, 102.0 + (count - 1) / 1000.0)
    index = np.arange(16_000)
    moment = index / 4000.0
    laser.add(index[:8000], moment[:8000], ramp(index[:8000]), 100.0 + rate * moment[:8000])
    laser.begin()
    return laser, clock


def ramp(index: NDArray[np.int64]) -> NDArray[np.int32]:
    """One count per value, from mid range at second 2."""
    return (32760 + index - 8000).astype(np.int32)


def feed(laser: SensorTrack, index: NDArray[np.int64], code: NDArray[np.int32] | None = None) -> None:
    laser.add(index, index / 4000.0, ramp(index) if code is None else code, 100.0 + index / 4000.0)


@pytest.mark.parametrize("seconds", [150, pytest.param(600, marks=pytest.mark.soak)])
def test_minutes_are_placed_to_50_microseconds_without_a_step(seconds: int) -> None:
    """More of them than the history of the clocks holds."""
    sent = stream(11, seconds + 4.0, 30e-6)
    bench = Bench(sent, Daq(12, SWITCHED_ON + 2.0, -30e-6), track())
    counts = np.concatenate([bench.block() for _ in range(10 * seconds)])
    assert (counts != LOST).all()
    error = delays(bench.daq, counts) - FLOOR
    assert np.abs(error).max() < 300e-6
    assert np.abs(error[8:]).max() < 50e-6
    # the slew of 50 us/s, and 12 counts of rounding averaged over a second
    assert np.abs(np.diff(error[12:])).max() < 51e-6
    alignment = bench.laser.alignment(bench.clock)
    assert alignment.rate == pytest.approx((1.0 + 30e-6) * (1.0 - 30e-6), abs=1e-6)
    assert alignment.lost == 0
    assert alignment.values == pytest.approx(seconds * 4000.0, rel=1e-3)
    assert alignment.residual < 1e-3


@pytest.mark.parametrize("seed", [21, *(pytest.param(seed, marks=pytest.mark.soak) for seed in (22, 23))])
@pytest.mark.parametrize("error", [30e-6, -30e-6])
def test_half_a_minute_is_placed_to_50_microseconds_after_ten_seconds(seed: int, error: float) -> None:
    bench = Bench(stream(seed, 34.0, error), Daq(seed + 50, SWITCHED_ON + 2.0, 20e-6), track())
    found = delays(bench.daq, np.concatenate([bench.block() for _ in range(300)])) - FLOOR
    assert np.abs(found[8:]).max() < 50e-6


def test_the_configured_delay_places_values_later() -> None:
    bench = Bench(stream(31, 16.0, 0.0), Daq(32, SWITCHED_ON + 2.0, 0.0), track(-FLOOR))
    found = delays(bench.daq, np.concatenate([bench.block() for _ in range(120)]))
    assert np.abs(found[10:]).max() < 50e-6
    assert bench.laser.alignment(bench.clock).delay == -FLOOR


def test_nothing_jumps_between_blocks_while_the_clocks_become_known() -> None:
    """A value per 0.25 ms; at most 12 counts of motion per sample, and never 500 us/s of slew: 0.2 counts more."""
    bench = Bench(stream(41, 16.0, 40e-6), Daq(42, SWITCHED_ON + 2.0, -40e-6), track())
    blocks = [bench.block().astype(np.float64) for _ in range(120)]
    step = AMPLITUDE * OMEGA / SAMPLE_RATE
    assert max(abs(after[0] - before[-1]) for before, after in pairwise(blocks)) < 1.001 * step + 2.0


def test_a_block_costs_little() -> None:
    """Calls of Python and of compiled code, which a slow machine makes as well; no more after 30 s than after 3 s."""
    bench = Bench(stream(51, 34.0, 30e-6), Daq(52, SWITCHED_ON + 2.0, 0.0), track())
    costs = [calls(bench.block) for _ in range(300)]
    # a median of 1060: a dozen looks for new values, each a few scores of calls on arrays
    assert np.median(costs) < 1300
    assert np.median(costs[-30:]) <= np.median(costs[:30])


def test_values_between_two_readings_are_on_the_straight_line() -> None:
    laser, clock = known(delay=0.125e-3)
    feed(laser, np.arange(8000, 9000))
    counts = laser.counts(clock, 10, 100, 1000.0)
    # sample i is at value 4 i, half a value later by the delay; one count either side for rounding
    np.testing.assert_allclose(counts, 4 * np.arange(10, 110) - 0.5, atol=1.01)


def test_a_fault_marks_every_sample_that_it_touches_and_no_other() -> None:
    laser, clock = known(delay=0.125e-3)
    index = np.arange(8000, 9000)
    code = ramp(index)
    code[200], code[400] = 262076, 262082
    feed(laser, index, code)
    counts = laser.counts(clock, 0, 200, 1000.0)
    faulty = np.flatnonzero((counts < -32760) | (counts > 32760))
    assert set(faulty) == {50, 100}
    assert (counts[50], counts[100]) == (NO_PEAK, OFF)


def test_lost_values_mark_the_samples_between_them() -> None:
    laser, clock = known(delay=0.125e-3)
    index = np.concatenate((np.arange(8000, 8201), np.arange(8241, 9000)))
    feed(laser, index)
    counts = laser.counts(clock, 0, 200, 1000.0)
    # values 8201 to 8240 are missing: those of samples 51 to 60, and half a value before them
    np.testing.assert_array_equal(np.flatnonzero(counts == LOST), np.arange(51, 61))
    assert laser.alignment(clock).lost == 40


def test_flipped_bits_are_marked_and_counted_and_their_neighbours_are_not() -> None:
    laser, clock = known(largest_step=400.0)
    index = np.arange(8000, 9000)
    code = ramp(index)
    # bits 14, 10 and 15 of single values, and two in a row
    for place, bit in ((200, 14), (400, 10), (600, 15), (601, 13)):
        code[place] ^= 1 << bit
    feed(laser, index, code)
    counts = laser.counts(clock, 0, 200, 1000.0)
    plain, again = known()
    feed(plain, index)
    marked = counts == IMPLAUSIBLE
    assert set(np.flatnonzero(marked)) <= {49, 50, 51, 99, 100, 101, 149, 150, 151}
    assert marked.sum() >= 3
    np.testing.assert_array_equal(counts[~marked], plain.counts(again, 0, 200, 1000.0)[~marked])
    assert laser.alignment(clock).implausible == 4
    assert laser.alignment(clock).lost == 0


def test_a_target_that_really_jumps_is_found_again() -> None:
    laser, clock = known(largest_step=400.0)
    index = np.arange(8000, 9000)
    code = ramp(index)
    code[200:] += 20_000
    feed(laser, index, code)
    counts = laser.counts(clock, 0, 200, 1000.0)
    # three values at 4 kHz are doubted, then the guard must see the motion
    assert laser.alignment(clock).implausible == 3
    assert 1 <= np.count_nonzero(counts == IMPLAUSIBLE) <= 2
    assert np.abs(counts[53:]).max() < 32760


def test_a_beam_that_flickers_between_two_distances_is_shown_to_the_guard() -> None:
    laser, clock = known(largest_step=400.0)
    index = np.arange(8000, 9000)
    code = ramp(index)
    code[np.arange(1000) % 3 > 0] += 20_000
    feed(laser, index, code)
    counts = laser.counts(clock, 0, 200, 1000.0)
    assert laser.alignment(clock).implausible <= 4
    assert np.count_nonzero(counts == IMPLAUSIBLE) <= 3


def test_a_first_value_with_a_flipped_bit_does_not_doubt_those_after_it() -> None:
    laser, clock = known(largest_step=400.0)
    index = np.arange(8000, 9000)
    code = ramp(index)
    code[0] += 20_000
    feed(laser, index, code)
    assert laser.alignment(clock).implausible <= 3


def test_a_sensor_that_restarts_its_clock_is_plausible_again() -> None:
    laser, clock = known(largest_step=400.0)
    feed(laser, np.arange(8000, 8400))
    index = np.arange(7000)
    laser.add(index, index / 4000.0, ramp(index + 8400) + 15_000, 102.1 + index / 4000.0)
    assert laser.alignment(clock).implausible == 0


def test_repeated_values_change_nothing() -> None:
    once, clock = known()
    again, _ = known()
    feed(once, np.arange(8000, 9000))
    feed(again, np.arange(8000, 8600))
    feed(again, np.arange(8300, 8600))
    feed(again, np.concatenate((np.arange(8500, 8900), np.arange(8700, 9000))))
    np.testing.assert_array_equal(once.counts(clock, 0, 200, 1000.0), again.counts(clock, 0, 200, 1000.0))
    assert again.alignment(clock).values == 1000
    assert again.alignment(clock).lost == 0


def test_no_readings_are_nothing_new() -> None:
    laser, clock = known()
    before = laser.alignment(clock)
    feed(laser, np.zeros(0, dtype=np.int64))
    assert laser.alignment(clock) == before


def test_a_silent_sensor_is_late_from_its_last_value_on() -> None:
    laser, clock = known()
    feed(laser, np.arange(8000, 8401))
    assert laser.reach(clock) == pytest.approx(0.1, abs=1e-5)
    counts = laser.counts(clock, 0, 200, 1000.0)
    np.testing.assert_array_equal(counts == LATE, np.arange(200) >= np.count_nonzero(counts != LATE))
    assert np.count_nonzero(counts != LATE) in (100, 101)
    assert laser.alignment(clock).late == np.count_nonzero(counts == LATE)
    # 99 ms are missing up to the last sample that was asked for
    assert laser.alignment(clock).lost == pytest.approx(0.099 * 4000.0, abs=1.0)
    assert (laser.counts(clock, 200, 50, 1000.0) == LATE).all()


def test_samples_before_the_first_value_are_lost() -> None:
    laser, clock = track(), SampleClock(1000.0)
    for count in range(1, 2001):
        clock.observe(102.0 + count / 1000.0, count, 102.0 + (count - 1) / 1000.0)
    feed(laser, np.arange(8400, 16_000))
    counts = laser.counts(clock, 0, 200, 1000.0)
    assert (counts[:99] == LOST).all()
    assert (counts[101:] != LOST).all()


def test_a_sensor_that_was_never_heard_is_late() -> None:
    laser, clock = track(), SampleClock(1000.0)
    clock.observe(100.0, 1, 100.001)
    assert laser.reach(clock) == -np.inf
    assert (laser.counts(clock, 0, 1000, 1000.0) == LATE).all()
    alignment = laser.alignment(clock)
    assert np.isnan([alignment.offset, alignment.rate, alignment.residual]).all()
    assert (alignment.values, alignment.lost) == (0, 4000)


def test_nothing_is_placed_on_a_sample_clock_that_is_not_known() -> None:
    laser, _ = known()
    assert laser.reach(SampleClock(1000.0)) == -np.inf
    assert (laser.counts(SampleClock(1000.0), 0, 10, 1000.0) == LATE).all()


def test_a_clock_that_was_watched_for_less_than_a_second_places_nothing() -> None:
    laser, (_, clock) = track(), known()
    feed(laser, np.arange(8000, 11_000))
    assert (laser.counts(clock, 0, 100, 1000.0) == LATE).all()
    feed(laser, np.arange(11_000, 12_400))
    assert (laser.counts(clock, 100, 100, 1000.0) != LATE).all()


def test_a_sensor_that_restarts_its_clock_is_found_again() -> None:
    laser, clock = known()
    feed(laser, np.arange(8000, 8400))
    # its counters begin again 0.1 s into the run
    index = np.arange(7000)
    laser.add(index, index / 4000.0, ramp(index + 8400), 102.1 + index / 4000.0)
    assert (laser.counts(clock, 0, 100, 1000.0) == LOST).all()
    counts = laser.counts(clock, 200, 1000, 1000.0)
    np.testing.assert_allclose(counts, 4 * np.arange(200, 1200), atol=1.01)


def test_reach_says_up_to_where_samples_are_not_lost() -> None:
    bench = Bench(stream(61, 10.0, 50e-6), Daq(62, SWITCHED_ON + 2.0, -50e-6), track())
    for _ in range(60):
        assert (bench.block(patience=1.0) != LOST).all()


def test_a_new_run_begins_its_own_account() -> None:
    laser, clock = known()
    feed(laser, np.arange(8000, 9000))
    laser.counts(clock, 0, 100, 1000.0)
    assert laser.alignment(clock).values == 1000
    laser.begin()
    assert laser.alignment(clock).values == 0
    # what is known of the sensor's clock stays: its values are placed at once
    assert (laser.counts(clock, 0, 100, 1000.0) != LOST).all()


@settings(max_examples=30, deadline=None)
@given(cuts=st.lists(st.integers(8000, 9000), max_size=8))
def test_values_are_the_same_however_they_are_handed_over(cuts: list[int]) -> None:
    whole, clock = known()
    parts, _ = known()
    feed(whole, np.arange(8000, 9000))
    for begin, end in pairwise([8000, *sorted(cuts), 9000]):
        feed(parts, np.arange(begin, end))
    np.testing.assert_array_equal(whole.counts(clock, 0, 200, 1000.0), parts.counts(clock, 0, 200, 1000.0))
