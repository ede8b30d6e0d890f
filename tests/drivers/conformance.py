"""What every backend must do, whatever stands behind it: the contract of `drivers.rig.Rig` as tests.

A backend's test file derives a class from `RigConformance` and gives it a `make_rig` fixture:

    class TestMine(RigConformance):
        @pytest.fixture
        def make_rig(self) -> Iterator[RigFactory]: ...

Every call of the factory opens a fresh rig that is not armed; the fixture closes them. The tests drive a rig with at
most `drive` volts for a fraction of a second, so that they may be run on hardware.
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.rig import Block, DriveUnderflow, Handwork, Rig, RigError

RigFactory = Callable[[], Rig]
AnyRig = TypeVar("AnyRig", bound=Rig)


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
    """Never armed."""
    assert rig.sample_rate > 0.0


def armed(rig: Rig) -> None:
    """Armed, nothing written."""
    rig.arm()


def loaded(rig: Rig) -> None:
    """Armed, samples waiting."""
    started(rig, 500)


def playing(rig: Rig) -> None:
    """In the middle of a drive that is not zero."""
    started(rig)
    play(rig, np.full(200, 0.1))


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


EVERY_STATE = [fresh, armed, loaded, playing, stopped, halted, starved, closed]
AT_REST = [fresh, stopped, halted, starved]


class RigConformance:
    """Derive from this and give a `make_rig` fixture; see the module."""

    drive = 0.4
    """Largest voltage that the tests play [V]."""
    reacts = "table_acceleration"
    """The channel that follows the drive most promptly."""
    reaction_time = 0.1
    """Time within which that channel must have shown a step of the drive [s]."""

    def test_channels_are_described(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        names = [channel.name for channel in rig.channels]
        assert names
        assert len(set(names)) == len(names)
        for channel in rig.channels:
            assert channel.quantity in ("displacement", "acceleration", "voltage")
            assert channel.unit
            assert channel.scale != 0.0
            low, high = channel.valid
            assert -32768 <= low < high <= 32767
            assert channel.limits[0] < channel.limits[1]

    def test_rates_and_ranges_make_sense(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        assert 0.0 < rig.sample_rate <= 1e6
        assert 0.0 < rig.drive_range <= 100.0
        assert rig.lead >= 0
        assert all(isinstance(text, str) and text for pair in rig.description.items() for text in pair)

    def test_blocks_are_contiguous_and_counted_from_arm(self, make_rig: RigFactory) -> None:
        rig = started(make_rig(), 600)
        expected = 0
        for n in (1, 7, 200, 92, 300):
            block = rig.read(n)
            assert block.first == expected
            assert len(block) == n
            assert block.counts.shape == (n, len(rig.channels))
            assert block.counts.dtype == np.int16
            expected += n

    @pytest.mark.parametrize("state", [stopped, halted, starved])
    def test_a_rig_can_be_armed_again_and_counts_from_zero(
        self, make_rig: RigFactory, state: Callable[[Rig], None]
    ) -> None:
        rig = make_rig()
        state(rig)
        assert play(started(rig), np.zeros(100))[0].first == 0

    @pytest.mark.parametrize("state", [*AT_REST, closed])
    def test_a_rig_that_is_not_armed_neither_plays_nor_reads(
        self, make_rig: RigFactory, state: Callable[[Rig], None]
    ) -> None:
        rig = make_rig()
        state(rig)
        with pytest.raises(RigError):
            rig.write(np.zeros(10))
        with pytest.raises(RigError):
            rig.read(1)

    @pytest.mark.parametrize("state", [armed, loaded, playing, closed])
    def test_arming_twice_or_after_close_is_refused(self, make_rig: RigFactory, state: Callable[[Rig], None]) -> None:
        rig = make_rig()
        state(rig)
        with pytest.raises(RigError):
            rig.arm()

    @pytest.mark.parametrize("end", ["stop", "halt", "close"])
    @pytest.mark.parametrize("state", EVERY_STATE)
    def test_stop_halt_and_close_are_allowed_in_every_state_any_number_of_times(
        self, make_rig: RigFactory, state: Callable[[Rig], None], end: str
    ) -> None:
        rig = make_rig()
        state(rig)
        for _ in range(3):
            getattr(rig, end)()
        with pytest.raises(RigError):
            rig.read(1)

    @pytest.mark.parametrize("end", ["stop", "halt"])
    def test_what_was_waiting_is_never_played_after_an_end(self, make_rig: RigFactory, end: str) -> None:
        rig = started(make_rig(), 500)
        getattr(rig, end)()
        rig.arm()
        with pytest.raises(DriveUnderflow):
            rig.read(1)

    def test_the_lead_must_be_waiting(self, make_rig: RigFactory) -> None:
        rig = started(make_rig(), 50)
        assert len(rig.read(50)) == 50
        with pytest.raises(DriveUnderflow):
            rig.read(1)
        with pytest.raises(RigError):
            rig.read(1)

    @pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
    def test_a_drive_that_is_not_finite_is_refused(self, make_rig: RigFactory, bad: float) -> None:
        rig = started(make_rig())
        with pytest.raises(RigError):
            rig.write(np.array([0.0, bad, 0.0]))
        self.assert_nothing_was_appended(rig)

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_a_drive_beyond_the_range_is_refused(self, make_rig: RigFactory, sign: float) -> None:
        rig = started(make_rig())
        with pytest.raises(RigError):
            rig.write(np.array([0.0, sign * rig.drive_range * 1.001, 0.0]))
        self.assert_nothing_was_appended(rig)

    def test_a_drive_of_two_dimensions_is_refused(self, make_rig: RigFactory) -> None:
        rig = started(make_rig())
        with pytest.raises(RigError):
            rig.write(np.zeros((2, 5)))
        self.assert_nothing_was_appended(rig)

    def assert_nothing_was_appended(self, rig: Rig) -> None:
        with pytest.raises(RigError):
            rig.read(1)

    def test_an_input_answers_its_drive_sample_not_before_and_soon_after(self, make_rig: RigFactory) -> None:
        rig = started(make_rig())
        quiet, after = round(0.2 * rig.sample_rate), round(self.reaction_time * rig.sample_rate)
        volts = np.concatenate([np.zeros(quiet), np.full(after, self.drive)])
        # the lead of silence is played first: drive sample i is then input sample lead + i
        blocks = play(rig, volts, 50)
        last = started_at = rig.lead + quiet
        rest = play(rig, np.zeros(started_at + after - volts.size), 50) if started_at + after > volts.size else []
        column = [channel.name for channel in rig.channels].index(self.reacts)
        counts = np.concatenate([block.counts[:, column] for block in blocks + rest]).astype(float)
        noise = counts[:last]
        threshold = 6.0 * noise.std() + 2.0
        assert np.abs(noise - noise.mean()).max() <= threshold
        reaction = np.abs(counts[started_at : started_at + after] - noise.mean()) > threshold
        assert reaction.any()
        assert not reaction[0]

    def test_reading_takes_the_time_of_the_samples(self, make_rig: RigFactory) -> None:
        rig = make_rig()
        rig.arm()
        begin = rig.clock.now()
        rig.write(np.zeros(rig.lead + 400))
        for n in (100, 300):
            rig.read(n)
        assert rig.clock.now() - begin >= 0.95 * 400 / rig.sample_rate

    @pytest.mark.parametrize("state", [armed, loaded, playing])
    def test_hands_stay_off_an_armed_rig(self, make_rig: RigFactory, state: Callable[[Rig], None]) -> None:
        rig = make_rig()
        state(rig)
        with pytest.raises(RigError):
            rig.handwork(Handwork.REMOVE_BLOCK)

    @pytest.mark.parametrize("state", [fresh, stopped])
    def test_handwork_is_told_to_a_stopped_rig(self, make_rig: RigFactory, state: Callable[[Rig], None]) -> None:
        rig = make_rig()
        state(rig)
        rig.handwork(Handwork.MOUNT_SPRING, 0.4 * 213.44)
        rig.handwork(Handwork.STAND_BLOCK_UP)
        rig.handwork(Handwork.REMOVE_BLOCK)
        assert play(started(rig), np.zeros(10))[0].first == 0
