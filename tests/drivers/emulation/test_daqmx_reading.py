"""Reading from the emulated device through the real client: nothing lost, nothing doubled, in time."""

import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from nidaqmx.constants import READ_ALL_AVAILABLE
from nidaqmx.errors import DaqError, DaqReadError
from nidaqmx.stream_readers import AnalogMultiChannelReader, AnalogUnscaledReader

from drivers.emulation.daqmx.models import compact_rio
from tests.drivers.emulation.daqmx_loopback import CYCLE, LSB, STILL, Desk, counts
from tests.patience import LONG, eventually


@pytest.fixture
def desk() -> Iterator[Desk]:
    with Desk(speed=4.0) as desk:
        yield desk


def assert_contiguous(clock: np.ndarray, step: int = 1) -> None:
    assert (np.diff(clock.astype(int)) % CYCLE == step).all()


def test_samples_follow_each_other_without_gap_whatever_the_block(desk: Desk) -> None:
    task = desk.inputs()
    task.start()
    blocks = [counts(task, n) for n in (1, 7, 200, 92, 2000, 1, 1700)]
    all_counts = np.concatenate(blocks)
    assert len(all_counts) == 4001
    assert_contiguous(all_counts[:, 1])
    assert (all_counts[:, 2] == STILL).all()


def test_every_second_tick_at_half_the_rate(desk: Desk) -> None:
    task = desk.inputs(rate=1000.0)
    task.start()
    assert_contiguous(np.concatenate([counts(task, 50), counts(task, 51)])[:, 1], 2)


def test_volts_are_the_counts_times_the_coefficients(desk: Desk) -> None:
    task = desk.inputs("Dev1/ai2:3")
    volts = np.empty((2, 100))
    assert AnalogMultiChannelReader(task.in_stream).read_many_sample(volts, 100, 20.0) == 100
    assert tuple(task.ai_channels[0].ai_dev_scaling_coeff) == (0.0, LSB)
    assert (volts[0] == STILL * LSB).all()
    assert (volts[1] == 32767 * LSB).all()


def test_channels_come_in_the_order_of_the_task(desk: Desk) -> None:
    task = desk.inputs("Dev1/ai3, Dev1/ai2, Dev1/ai17")
    first = counts(task, 10)
    assert (first == [32767, STILL, 0]).all()


def test_a_narrower_range_is_chosen_for_narrower_limits(desk: Desk) -> None:
    task = desk.inputs("Dev1/ai2", limit=4.0)
    channel = task.ai_channels[0]
    assert (channel.ai_rng_low, channel.ai_rng_high) == (-5.0, 5.0)
    assert channel.ai_dev_scaling_coeff[1] == 10.0 / 65536.0
    assert (counts(task, 10) == 2 * STILL).all()


def test_a_stopped_task_is_started_by_a_read(desk: Desk) -> None:
    task = desk.inputs()
    assert task.in_stream.total_samp_per_chan_acquired == 0
    counts(task, 10)
    assert task.in_stream.total_samp_per_chan_acquired >= 10


def test_a_read_that_is_given_up_returns_what_there_was_and_nothing_is_lost(desk: Desk) -> None:
    task = desk.inputs()
    task.start()
    before = counts(task, 1)[-1, 1]
    n = 19_000
    raw = np.full((4, n), -1, np.int16)
    with pytest.raises(DaqReadError) as error:
        AnalogUnscaledReader(task.in_stream).read_int16(raw, n, 0.1)
    assert error.value.error_code == -200284
    got = error.value.samps_per_chan_read
    assert 0 < got < n
    # packed without gaps, and zeros behind
    partial = raw.ravel()[: 4 * got].reshape(4, got)
    assert not raw.ravel()[4 * got :].any()
    assert_contiguous(np.concatenate([[before], partial[1], counts(task, 5)[:, 1]]))


def test_who_reads_too_late_has_lost_samples(desk: Desk) -> None:
    task = desk.inputs(buffer=100)
    task.in_stream.input_buf_size = 1000
    assert task.in_stream.input_buf_size == 1000
    counts(task, 10)
    desk.plant.pass_ticks(1100)
    with pytest.raises(DaqReadError) as error:
        counts(task, 10)
    assert error.value.error_code == -200279
    with pytest.raises(DaqError) as error:
        counts(task, 10)
    assert error.value.error_code == -200279
    task.stop()
    assert_contiguous(counts(task, 10)[:, 1])


def test_the_driver_makes_the_buffer_as_large_as_its_manual_says(desk: Desk) -> None:
    task = desk.inputs(buffer=100)
    assert task.in_stream.input_buf_size == 10_000


def test_the_counter_follows_the_clock_whoever_reads(desk: Desk) -> None:
    task = desk.inputs()
    task.start()
    first = int(counts(task, 1)[0, 1])
    seen = []
    for _ in range(50):
        earliest = desk.plant.tick()
        acquired = task.in_stream.total_samp_per_chan_acquired
        latest = desk.plant.tick()
        # sample k is taken at tick first + k
        assert earliest - first + 1 <= acquired <= latest - first + 1
        seen.append(acquired)
    assert seen == sorted(seen)
    assert seen[-1] > seen[0]
    assert task.in_stream.curr_read_pos == 1
    assert task.in_stream.avail_samp_per_chan >= seen[-1] - 2


def test_the_counter_goes_in_packets_where_samples_travel_in_packets() -> None:
    with Desk(speed=4.0, packet=64) as desk:
        task = desk.inputs()
        task.start()
        first = int(counts(task, 1)[0, 1])
        for _ in range(50):
            earliest = desk.plant.tick()
            acquired = task.in_stream.total_samp_per_chan_acquired
            latest = desk.plant.tick()
            assert acquired % 64 == 0
            assert earliest - first + 1 - 63 <= acquired <= latest - first + 1


def test_the_server_knows_when_the_first_sample_was_taken(desk: Desk) -> None:
    assert desk.server.first_sample is None
    task = desk.inputs()
    task.start()
    first = int(counts(task, 1)[0, 1])
    line = desk.task("line")
    line.do_channels.add_do_chan("Dev1/port0/line0")
    line.write(True)
    assert desk.server.first_sample == desk.plant.time_of(first)


def test_all_that_waits_can_be_read(desk: Desk) -> None:
    task = desk.inputs("Dev1/ai1:2")
    task.start()
    counts(task, 1)
    desk.plant.pass_ticks(100)
    there = task.in_stream.avail_samp_per_chan
    volts = np.array(task.read(READ_ALL_AVAILABLE, timeout=0.0))
    assert volts.shape[1] >= max(there, 100)
    assert_contiguous(np.append(np.rint(volts[0] / LSB), counts(task, 3)[:, 0]))


def test_a_read_needs_room(desk: Desk) -> None:
    task = desk.inputs("Dev1/ai1")
    reader = AnalogUnscaledReader(task.in_stream)
    reader.verify_array_shape = False
    with pytest.raises(DaqReadError) as error:
        reader.read_int16(np.empty((1, 9), np.int16), 10)
    assert error.value.error_code == -200229


def test_a_stop_ends_a_read_that_waits(desk: Desk) -> None:
    task = desk.inputs()
    task.start()
    caught: list[Any] = []

    def read() -> None:
        try:
            counts(task, 16_000, timeout=60.0)
        except DaqError as error:
            caught.append(error.error_code)

    thread = threading.Thread(target=read)
    thread.start()
    while thread.is_alive():
        # when the stop comes first, the read starts the task anew
        task.stop()
        thread.join(0.05)
    assert caught == [-88710]


def test_without_clock_the_present_is_read(desk: Desk) -> None:
    task = desk.task("now")
    task.ai_channels.add_ai_voltage_chan("Dev1/ai1:2", min_val=-10.0, max_val=10.0)
    tick, still = task.read()
    assert still == STILL * LSB
    assert abs(round(tick / LSB) - desk.plant.tick()) < 20_000
    later, _ = task.read()
    assert later > tick


def test_many_may_wait_at_once(desk: Desk) -> None:
    task = desk.inputs()
    task.start()
    reads = [threading.Thread(target=counts, args=(task, 100)) for _ in range(20)]
    for thread in reads:
        thread.start()
    eventually(lambda: task.in_stream.curr_read_pos == 2000)
    for thread in reads:
        thread.join(LONG)
    assert len(counts(task, 10)) == 10


class TestModules:
    @pytest.fixture
    def desk(self) -> Iterator[Desk]:
        with Desk(compact_rio(), speed=4.0) as desk:
            yield desk

    def test_24_bits_come_in_raw_samples_of_32(self, desk: Desk) -> None:
        task = desk.inputs("cRIO1Mod1/ai1:3")
        channel = task.ai_channels[0]
        assert (channel.ai_raw_samp_size, channel.ai_resolution) == (32, 24.0)
        raw = np.empty((3, 500), np.int32)
        assert AnalogUnscaledReader(task.in_stream).read_int32(raw, 500, 20.0) == 500
        assert_contiguous(raw[0] // 256)
        # the filter's delay is 40.016 ticks: 4 of 256 steps are missing
        assert (raw[0] % 256 == 252).all()
        assert (raw[1] == 256 * STILL).all()
        assert (raw[2] == 2**23 - 1).all()

    def test_they_do_not_fit_into_16(self, desk: Desk) -> None:
        task = desk.inputs("cRIO1Mod1/ai1")
        with pytest.raises(DaqReadError) as error:
            counts(task, 10)
        assert error.value.error_code == -200789

    def test_the_second_module_goes_on_where_the_first_ends(self, desk: Desk) -> None:
        task = desk.inputs("cRIO1Mod1/ai2, cRIO1Mod2/ai0")
        raw = np.empty((2, 10), np.int32)
        AnalogUnscaledReader(task.in_stream).read_int32(raw, 10, 20.0)
        assert (raw.T == [256 * STILL, 0]).all()
