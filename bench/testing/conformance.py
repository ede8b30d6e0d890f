"""Conformance tests of a rig: the contract of `drivers.rig.Rig`.

The tests of a backend derive a class from `RigConformance` and provide a `make_rig` fixture:

    class TestMine(RigConformance):
        @pytest.fixture
        def make_rig(self) -> Iterator[RigFactory]: ...

Every call of the factory opens a new rig that is not armed; the fixture closes all of them. A server or an instrument
behind the rig must be running before the factory is returned, and until the last rig is closed. The tests drive a rig
with at most `drive` volts (or 0.1 V, if that is larger) for a fraction of a second and open about twenty rigs in total,
so that they can run on hardware and in real time. Numbers of samples follow from durations and the rig's sample rate.

With `pytest.register_assert_rewrite("bench.testing.conformance")` in a conftest.py, pytest shows the values in a failed
assertion.
"""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bench.testing.resources import held, held_at_last
from drivers.rig import Block, DriveUnderflow, OperatorTask, Rig, RigError

RigFactory = Callable[[], Rig]
AnyRig = TypeVar("AnyRig", bound=Rig)


def samples(rig: Rig, seconds: float) -> int:
    """Number of samples that a rig acquires in `seconds`."""
    return max(round(seconds * rig.sample_rate), 1)


def started(rig: AnyRig, ahead: int = 0) -> AnyRig:
    """Arm the rig, and write zeros for its lead and for `ahead` further samples."""
    rig.arm()
    rig.write(np.zeros(rig.lead + ahead))
    return rig


def play(rig: Rig, volts: NDArray[np.float64], block: int = 100) -> list[Block]:
    """Write `volts`, shape (n,), to a rig whose lead has been written, and read as many samples, block by block."""
    blocks: list[Block] = []
    for start in range(0, volts.size, block):
        part = volts[start : start + block]
        rig.write(part)
        blocks.append(rig.read(part.size))
    return blocks


@contextmanager
def refusal(error: type[RigError] = RigError) -> Generator[None]:
    """Context manager that fails unless `error` is raised in its block."""
    try:
        yield
    except error:
        return
    raise AssertionError(f"{error.__name__} was not raised")


def fresh(rig: Rig) -> None:
    """Leave the rig unarmed, as it was opened or stopped."""
    assert rig.sample_rate > 0.0


def armed(rig: Rig) -> None:
    """Arm the rig without writing."""
    rig.arm()


def loaded(rig: Rig) -> None:
    """Arm the rig and queue samples."""
    started(rig, samples(rig, 0.25))


def playing(rig: Rig) -> None:
    """Arm the rig, play 0.1 V for 0.1 s and leave it armed."""
    started(rig)
    play(rig, np.full(samples(rig, 0.1), 0.1), samples(rig, 0.05))


def stopped(rig: Rig) -> None:
    """Arm and stop the rig."""
    rig.arm()
    rig.stop()


def halted(rig: Rig) -> None:
    """Halt the rig while it plays."""
    playing(rig)
    rig.halt()


def starved(rig: Rig) -> None:
    """Let the rig run out of drive samples."""
    started(rig)
    with refusal(DriveUnderflow):
        rig.read(1)


def closed(rig: Rig) -> None:
    """Close the rig while it plays."""
    playing(rig)
    rig.close()


BEFORE_CLOSE = [fresh, armed, loaded, playing, stopped, halted, starved]
"""Functions that bring a rig into each of its states before `close()`."""
AT_REST = [fresh, stopped, halted, starved]
UNDER_WAY = [armed, loaded, playing]
QUANTITIES = ("displacement", "acceleration", "force", "current", "voltage")


def refuses_to_play_and_to_read(rig: Rig) -> None:
    """Check that an unarmed rig refuses to write and to read."""
    with refusal():
        rig.write(np.zeros(10))
    with refusal():
        rig.read(1)


class RigConformance:
    """Conformance tests. Derive from this class and provide a `make_rig` fixture (see the module's docstring)."""

    drive = 0.4
    """Height of the step of the drive in the test of the response [V]; the other tests output at most 0.1 V."""
    reacts = "table_acceleration"
    """Name of the channel that responds to the drive first."""
    reaction_time = 0.1
    """Time within which the channel `reacts` must respond to a step of the drive [s]."""

    def test_a_rig_describes_itself(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        assert 0.0 < rig.sample_rate <= 1e6
        assert 0.0 < rig.drive_range <= 100.0
        assert rig.lead >= 0
        assert all(isinstance(text, str) and text for pair in rig.description.items() for text in pair)
        assert isinstance(rig.alignments, tuple)
        names = [channel.name for channel in rig.channels]
        assert names
        assert len(set(names)) == len(names)
        for channel in rig.channels:
            assert channel.quantity in QUANTITIES
            assert channel.unit
            assert channel.scale != 0.0
            stored = np.iinfo(channel.storage)
            assert stored.min <= channel.valid[0] < channel.valid[1] <= stored.max
            assert channel.limits[0] < channel.limits[1]
            assert not any(channel.valid[0] <= count <= channel.valid[1] for count in channel.faults)

    def test_blocks_are_contiguous_counted_from_arm_and_wide_enough_for_their_channels(
        self, make_rig: RigFactory
    ) -> None:
        rig = make_rig()
        sizes = [1, 7, samples(rig, 0.1), samples(rig, 0.05), samples(rig, 0.15)]
        started(rig, sum(sizes))
        expected = 0
        for n in sizes:
            block = rig.read(n)
            assert block.first == expected
            assert len(block) == n
            assert block.counts.shape == (n, len(rig.channels))
            assert block.counts.dtype in (np.int16, np.int32)
            assert all(np.can_cast(channel.storage, block.counts.dtype) for channel in rig.channels)
            expected += n
        assert isinstance(rig.alignments, tuple)
        for alignment in rig.alignments:
            assert alignment.sensor in [channel.name for channel in rig.channels]
            # quartz clocks agree to about 100 ppm, but a comparison over a fraction of a second is less accurate
            assert abs(alignment.rate - 1.0) <= 1e-3
            assert alignment.residual >= 0.0
            assert alignment.values > 0

    def test_a_rig_can_be_armed_again_and_counts_from_zero(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        for state in (stopped, halted, starved):
            state(rig)
            assert play(started(rig), np.zeros(samples(rig, 0.05)))[0].first == 0
            rig.stop()

    def test_a_rig_that_is_not_armed_neither_plays_nor_reads(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        for state in (*AT_REST, closed):
            state(rig)
            refuses_to_play_and_to_read(rig)

    def test_arming_twice_or_after_close_is_refused(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        for state in (*UNDER_WAY, closed):
            state(rig)
            with refusal():
                rig.arm()
            rig.stop()

    def test_stop_and_halt_are_allowed_in_every_state_any_number_of_times(self, make_rig: RigFactory) -> None:
        for end in ("stop", "halt"):
            rig = make_rig()
            for state in (*BEFORE_CLOSE, closed):
                state(rig)
                for _ in range(3):
                    getattr(rig, end)()
                refuses_to_play_and_to_read(rig)

    def test_close_is_allowed_in_every_state_any_number_of_times_and_leaves_nothing_behind(
        self, make_rig: RigFactory
    ) -> None:
        # opening the first rig loads libraries that keep some resources; `before` must include these
        make_rig().close()
        before = held()
        for state in (armed, playing, halted, starved):
            rig = make_rig()
            state(rig)
            for _ in range(3):
                rig.close()
            refuses_to_play_and_to_read(rig)
            now = held_at_last(before)
            assert all(count <= before[kind] for kind, count in now.items()), (state.__doc__, before, now)

    def test_what_was_waiting_is_never_played_after_an_end(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        for end in (rig.stop, rig.halt):
            loaded(rig)
            end()
            rig.arm()
            with refusal(DriveUnderflow):
                rig.read(1)

    def test_the_lead_must_be_waiting(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        ahead = samples(rig, 0.05)
        started(rig, ahead)
        assert len(rig.read(ahead)) == ahead
        with refusal(DriveUnderflow):
            rig.read(1)
        with refusal():
            rig.read(1)

    def test_a_drive_that_is_not_finite_beyond_the_range_or_of_two_dimensions_is_refused_and_ends_the_run(
        self, make_rig: RigFactory
    ) -> None:
        rig = make_rig()
        beyond = 1.001 * rig.drive_range
        single = [np.array([0.0, bad, 0.0]) for bad in (np.nan, np.inf, -np.inf, beyond, -beyond)]
        for volts in (*single, np.zeros((2, 5))):
            started(rig, samples(rig, 0.05))
            with refusal():
                rig.write(volts)
            refuses_to_play_and_to_read(rig)

    def test_both_ends_of_the_drive_range_are_taken(self, make_rig: RigFactory) -> None:
        rig = started(make_rig())
        rig.write(np.array([rig.drive_range, -rig.drive_range]))
        rig.write(np.zeros(0))
        # none of these values is played, because the lead of zeros is played first
        assert len(rig.read(1)) == 1
        rig.stop()

    def test_an_input_answers_its_drive_sample_not_before_and_soon_after(self, make_rig: RigFactory) -> None:
        rig = started(make_rig())
        quiet, after = samples(rig, 0.2), samples(rig, self.reaction_time)
        # the lead of zeros is played first: drive sample i corresponds to input sample lead + i
        step = rig.lead + quiet
        volts = np.concatenate([np.zeros(quiet), np.full(after, self.drive), np.zeros(rig.lead)])
        blocks = play(rig, volts, samples(rig, 0.05))
        column = [channel.name for channel in rig.channels].index(self.reacts)
        counts = np.concatenate([block.counts[:, column] for block in blocks]).astype(float)
        noise = counts[:step]
        threshold = 6.0 * noise.std() + 2.0
        assert np.abs(noise - noise.mean()).max() <= threshold
        reaction = np.abs(counts[step : step + after] - noise.mean()) > threshold
        assert reaction.any()
        assert not reaction[0]

    def test_reading_takes_the_time_of_the_samples(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        sizes = (samples(rig, 0.1), samples(rig, 0.3))
        started(rig, sum(sizes))
        begin = rig.clock.now()
        for n in sizes:
            rig.read(n)
        assert rig.clock.now() - begin >= 0.95 * sum(sizes) / rig.sample_rate

    def test_work_at_the_bench_is_refused_while_the_rig_is_armed_or_closed(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        for state in (*UNDER_WAY, closed):
            state(rig)
            with refusal():
                rig.perform(OperatorTask.REMOVE_BLOCK)
            rig.stop()

    def test_work_at_the_bench_is_taken_by_a_stopped_rig(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        for state in (fresh, stopped):
            state(rig)
            rig.perform(OperatorTask.MOUNT_SPRING, 0.4 * 213.44)
            rig.perform(OperatorTask.STAND_BLOCK_UP)
            rig.perform(OperatorTask.REMOVE_BLOCK)
            rig.perform(OperatorTask.LOCK_FRAME)
            rig.perform(OperatorTask.UNLOCK_FRAME)
            rig.perform(OperatorTask.HOLD_BLOCK, 0.4 * 213.44)
            rig.perform(OperatorTask.LOCK_TABLE)
            rig.perform(OperatorTask.WATCH_BLOCK, 0.3)
            rig.perform(OperatorTask.TILT_BLOCK, 0.05)
            rig.perform(OperatorTask.STAND_BLOCK_UP)
            rig.perform(OperatorTask.REMOVE_BLOCK)
            rig.perform(OperatorTask.WATCH_STOREYS)
            rig.perform(OperatorTask.UNLOCK_TABLE)
            rig.perform(OperatorTask.PULL_FRAME, 0.005)
        assert play(started(rig), np.zeros(samples(rig, 0.05)))[0].first == 0
