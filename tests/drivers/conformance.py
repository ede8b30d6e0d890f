"""What every backend must do, whatever stands behind it: the contract of `drivers.rig.Rig` as tests.

A backend's test file derives a class from `RigConformance` and gives it a `make_rig` fixture:

    class TestMine(RigConformance):
        @pytest.fixture
        def make_rig(self) -> Iterator[RigFactory]: ...

Every call of the factory opens a fresh rig that is not armed; the fixture closes them. What a rig stands on, such as a
server or an emulated instrument, runs before the factory is handed out and until the last rig is closed. The tests
drive a rig with at most `drive` volts for a fraction of a second and open about twenty rigs in all, so that they may
be run on hardware and in real time. All sizes are times of the rig's own sample rate.
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.rig import Block, DriveUnderflow, Handwork, Rig, RigError
from tests.drivers.held import held, held_at_last

RigFactory = Callable[[], Rig]
AnyRig = TypeVar("AnyRig", bound=Rig)


def samples(rig: Rig, seconds: float) -> int:
    """How many samples a rig takes in a time."""
    return max(round(seconds * rig.sample_rate), 1)


def started(rig: AnyRig, ahead: int = 0) -> AnyRig:
    """The rig armed, with its lead and `ahead` more samples of silence written."""
    rig.arm()
    rig.write(np.zeros(rig.lead + ahead))
    return rig


def play(rig: Rig, volts: NDArray[np.float64], block: int = 100) -> list[Block]:
    """Write and read `volts` block by block on a rig whose lead is filled."""
    blocks: list[Block] = []
    for start in range(0, volts.size, block):
        part = volts[start : start + block]
        rig.write(part)
        blocks.append(rig.read(part.size))
    return blocks


def fresh(rig: Rig) -> None:
    """Never armed, or stopped."""
    assert rig.sample_rate > 0.0


def armed(rig: Rig) -> None:
    """Armed, nothing written."""
    rig.arm()


def loaded(rig: Rig) -> None:
    """Armed, samples waiting."""
    started(rig, samples(rig, 0.25))


def playing(rig: Rig) -> None:
    """In the middle of a drive that is not zero."""
    started(rig)
    play(rig, np.full(samples(rig, 0.1), 0.1), samples(rig, 0.05))


def stopped(rig: Rig) -> None:
    """Armed and stopped."""
    rig.arm()
    rig.stop()


def halted(rig: Rig) -> None:
    """Halted while playing."""
    playing(rig)
    rig.halt()


def starved(rig: Rig) -> None:
    """Run out of drive samples."""
    started(rig)
    with pytest.raises(DriveUnderflow):
        rig.read(1)


def closed(rig: Rig) -> None:
    """Closed while playing."""
    playing(rig)
    rig.close()


BEFORE_CLOSE = [fresh, armed, loaded, playing, stopped, halted, starved]
"""Every state of a rig that is open."""
AT_REST = [fresh, stopped, halted, starved]
UNDER_WAY = [armed, loaded, playing]
QUANTITIES = ("displacement", "acceleration", "force", "current", "voltage")


def refuses_to_play_and_to_read(rig: Rig) -> None:
    """A rig that is not armed."""
    with pytest.raises(RigError):
        rig.write(np.zeros(10))
    with pytest.raises(RigError):
        rig.read(1)


class RigConformance:
    """Derive from this and give a `make_rig` fixture; see the module."""

    drive = 0.4
    """Largest voltage that the tests play [V]."""
    reacts = "table_acceleration"
    """The channel that follows the drive most promptly."""
    reaction_time = 0.1
    """Time within which that channel must have shown a step of the drive [s]."""

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
            # two clocks of quartz, each right to 50 ppm and known after a fraction of a second
            assert alignment.rate == pytest.approx(1.0, abs=1e-3)
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
            with pytest.raises(RigError):
                rig.arm()
            rig.stop()

    @pytest.mark.parametrize("end", ["stop", "halt"])
    def test_stop_and_halt_are_allowed_in_every_state_any_number_of_times(self, make_rig: RigFactory, end: str) -> None:
        rig = make_rig()
        for state in (*BEFORE_CLOSE, closed):
            state(rig)
            for _ in range(3):
                getattr(rig, end)()
            refuses_to_play_and_to_read(rig)

    def test_close_is_allowed_in_every_state_any_number_of_times_and_leaves_nothing_behind(
        self, make_rig: RigFactory
    ) -> None:
        # what libraries keep for ever, they have after the first rig
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
            with pytest.raises(DriveUnderflow):
                rig.read(1)

    def test_the_lead_must_be_waiting(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        ahead = samples(rig, 0.05)
        started(rig, ahead)
        assert len(rig.read(ahead)) == ahead
        with pytest.raises(DriveUnderflow):
            rig.read(1)
        with pytest.raises(RigError):
            rig.read(1)

    def test_a_drive_that_is_not_finite_beyond_the_range_or_of_two_dimensions_is_refused_and_ends_the_run(
        self, make_rig: RigFactory
    ) -> None:
        rig = make_rig()
        beyond = 1.001 * rig.drive_range
        single = [np.array([0.0, bad, 0.0]) for bad in (np.nan, np.inf, -np.inf, beyond, -beyond)]
        for volts in (*single, np.zeros((2, 5))):
            started(rig, samples(rig, 0.05))
            with pytest.raises(RigError):
                rig.write(volts)
            refuses_to_play_and_to_read(rig)

    def test_both_ends_of_the_drive_range_are_taken(self, make_rig: RigFactory) -> None:
        rig = started(make_rig())
        rig.write(np.array([rig.drive_range, -rig.drive_range]))
        rig.write(np.zeros(0))
        # none of it is played: the lead of silence comes first
        assert len(rig.read(1)) == 1
        rig.stop()

    def test_an_input_answers_its_drive_sample_not_before_and_soon_after(self, make_rig: RigFactory) -> None:
        rig = started(make_rig())
        quiet, after = samples(rig, 0.2), samples(rig, self.reaction_time)
        # the lead of silence is played first: drive sample i is then input sample lead + i
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

    def test_hands_stay_off_a_rig_that_is_armed_or_closed(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        for state in (*UNDER_WAY, closed):
            state(rig)
            with pytest.raises(RigError):
                rig.handwork(Handwork.REMOVE_BLOCK)
            rig.stop()

    def test_handwork_is_told_to_a_stopped_rig(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        for state in (fresh, stopped):
            state(rig)
            rig.handwork(Handwork.MOUNT_SPRING, 0.4 * 213.44)
            rig.handwork(Handwork.STAND_BLOCK_UP)
            rig.handwork(Handwork.REMOVE_BLOCK)
            rig.handwork(Handwork.LOCK_FRAME)
            rig.handwork(Handwork.UNLOCK_FRAME)
            rig.handwork(Handwork.HOLD_BLOCK, 0.4 * 213.44)
            rig.handwork(Handwork.LOCK_TABLE)
            rig.handwork(Handwork.WATCH_BLOCK, 0.3)
            rig.handwork(Handwork.TILT_BLOCK, 0.05)
            rig.handwork(Handwork.STAND_BLOCK_UP)
            rig.handwork(Handwork.REMOVE_BLOCK)
            rig.handwork(Handwork.WATCH_STOREYS)
            rig.handwork(Handwork.UNLOCK_TABLE)
            rig.handwork(Handwork.PULL_FRAME, 0.005)
        assert play(started(rig), np.zeros(samples(rig, 0.05)))[0].first == 0
