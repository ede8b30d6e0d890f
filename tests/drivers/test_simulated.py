from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.testing.conformance import RigConformance, RigFactory, play, started
from drivers.clock import VirtualClock, WallClock
from drivers.rig import Counts, DriveUnderflow, OperatorTask, Rig, RigError
from drivers.simulated import SimulatedRig
from sim.block_face import rotation
from sim.errors import InvalidInput
from sim.sensors import Laser
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters

COUPLED = Specimen(beta=0.64)


def simulated(specimen: Specimen | None = None, seed: int = 1, **parts: object) -> SimulatedRig:
    return SimulatedRig(VirtualBenchParameters.model_validate(parts), specimen or Specimen(), seed=seed)


class TestSimulated(RigConformance):
    @pytest.fixture
    def make_rig(self) -> Iterator[RigFactory]:
        rigs: list[Rig] = []

        def make() -> Rig:
            rigs.append(simulated(sample_rate=1000.0))
            return rigs[-1]

        yield make
        for rig in rigs:
            rig.close()


def measured(rig: SimulatedRig, volts: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """A channel in its unit while `volts` are written; the lead was written before."""
    column = [channel.name for channel in rig.channels].index(name)
    counts = np.concatenate([block.counts for block in play(rig, volts)])
    return rig.channels[column].to_unit(counts[:, column])


def toppled(rig: SimulatedRig) -> SimulatedRig:
    """The rig stopped, its block in the catch."""
    started(rig)
    play(rig, 8.0 * np.sin(9.0 * np.arange(8000) / rig.sample_rate))
    rig.stop()
    return rig


def test_drive_sample_i_acts_after_input_sample_i() -> None:
    """Truth, no filter between: the table is at rest up to and with the sample of the step."""
    rig = SimulatedRig(VirtualBenchParameters(), Specimen(), seed=1, lead=0)
    rig.arm()
    volts = np.zeros(300)
    volts[200:] = 1.0
    rig.write(volts)
    rig.read(300)
    velocity = rig.bench.truth.v
    # 3 V on 0.8 ohm and 50 N/A push 50 kg: 3.75 m/s2 for the first half millisecond
    assert abs(velocity[200]) < 1e-4
    assert velocity[201] == pytest.approx(3.75 / 2000.0, rel=0.1)


def test_both_ends_of_the_drive_range_are_allowed() -> None:
    rig = started(simulated())
    rig.write(np.array([10.0, -10.0]))
    assert len(rig.read(2)) == 2


def test_the_lead_is_fifty_milliseconds_unless_told() -> None:
    assert simulated().lead == 100
    assert SimulatedRig(VirtualBenchParameters(), Specimen(), seed=1, lead=7).lead == 7
    with pytest.raises(InvalidInput, match="lead"):
        SimulatedRig(VirtualBenchParameters(), Specimen(), seed=1, lead=-1)


def test_a_refused_drive_ends_the_run() -> None:
    rig = started(simulated(), 500)
    with pytest.raises(RigError, match="11"):
        rig.write(np.full(3, 11.0))
    with pytest.raises(RigError, match="not armed"):
        rig.read(1)


def test_underflow_says_what_was_missing() -> None:
    rig = started(simulated(), 20)
    rig.read(20)
    with pytest.raises(DriveUnderflow, match="sample 20: 100 of 105 required samples were queued"):
        rig.read(5)


def test_reading_nothing_is_refused() -> None:
    with pytest.raises(InvalidInput, match="samples to read"):
        started(simulated(), 20).read(0)


def test_the_bench_is_at_rest_when_it_is_armed_again() -> None:
    rig = started(simulated())
    swinging = measured(rig, 0.6 * np.sin(6.3 * np.arange(6000) / 2000.0), "laser_2")
    rig.stop()
    still = measured(started(rig), np.zeros(4000), "laser_2")
    assert np.ptp(swinging) > 0.02
    # a storey still to 0.2 mm/s moves less than 0.05 mm; the laser steps by 0.05 mm
    assert np.ptp(still) < 4e-4
    assert abs(still.mean()) < 1e-3


@pytest.mark.parametrize("end", ["stop", "halt"])
def test_the_output_is_at_zero_at_once_after_an_end(end: str) -> None:
    """The coil brakes the table: its velocity dies away with the time constant m R / Bl^2 = 16 ms."""
    rig = started(simulated())
    play(rig, np.full(400, 1.0))
    rig.write(np.full(1000, 1.0))
    getattr(rig, end)()
    before = rig.bench.truth.v[-1]
    rig.bench.coast(0.1)
    assert before > 0.05
    assert abs(rig.bench.truth.v[-1]) < 0.06 * before


def test_a_toppled_block_shows_in_laser_1_until_it_is_stood_up() -> None:
    rig = toppled(simulated(COUPLED, laser_1=Laser(reference="table"), laser_2=Laser(reference="table")))
    fallen = measured(started(rig), np.zeros(400), "laser_1").mean()
    rig.stop()
    rig.perform(OperatorTask.STAND_BLOCK_UP)
    upright = measured(started(rig), np.zeros(400), "laser_1").mean()
    assert abs(fallen) > 0.01
    assert abs(upright) < 1e-3


def test_removing_the_block_leaves_the_bare_frame_and_mounting_a_spring_couples_it() -> None:
    rig = simulated(COUPLED)
    rig.perform(OperatorTask.REMOVE_BLOCK)
    assert rig.bench.specimen == Specimen()
    with pytest.raises(RigError, match="no block"):
        rig.perform(OperatorTask.STAND_BLOCK_UP)
    rig.perform(OperatorTask.MOUNT_SPRING, 0.25 * 213.44)
    assert rig.bench.specimen == Specimen(beta=0.25)


def test_a_locked_frame_moves_with_the_table_until_it_is_unlocked() -> None:
    rig = simulated(laser_1=Laser(reference="table"), laser_2=Laser(reference="table"))
    volts = 0.4 * np.sin(6.3 * np.arange(2000) / 2000.0)
    moved: list[float] = []
    for work in (OperatorTask.LOCK_FRAME, OperatorTask.UNLOCK_FRAME):
        rig.perform(work)
        moved.append(float(np.ptp(measured(started(rig), volts, "laser_2"))))
        rig.stop()
    assert moved[0] < 0.05 * moved[1]


def test_mounting_a_spring_needs_its_stiffness() -> None:
    with pytest.raises(InvalidInput, match="stiffness"):
        simulated().perform(OperatorTask.MOUNT_SPRING)


def test_a_tilted_block_is_let_go_seconds_after_arming_and_tilted_again() -> None:
    rig = simulated()
    rig.perform(OperatorTask.LOCK_TABLE)
    rig.perform(OperatorTask.WATCH_BLOCK, 0.3)
    for tilt in (0.08, -0.06):
        rig.perform(OperatorTask.TILT_BLOCK, tilt)
        seen = rotation(measured(started(rig), np.zeros(14_000), "laser_2"), 0.3, rig.bench.specimen.block)
        rig.stop()
        # the laser's linearity, 0.16 mm of its range, over 300 mm
        held = np.abs(seen - tilt) < 1e-3
        assert held[: int(2.9 * 2000)].all()
        assert not held[int(5.5 * 2000) :].all()
        assert seen.min() < -0.03
        assert seen.max() > 0.03
        assert not rig.bench.fallen
    # what was rocking when it was stopped has come to rest before the next test
    seen = measured(started(rig), np.zeros(2000), "laser_2")
    assert np.abs(rig.bench.truth.theta).max() == 0.0
    assert np.ptp(seen) < 4e-4


def test_a_frame_held_when_a_test_is_stopped_is_held_in_the_next() -> None:
    rig = simulated()
    rig.perform(OperatorTask.PULL_FRAME, 0.02)
    for end in (rig.stop, rig.halt):
        still = measured(started(rig), np.zeros(5600), "laser_2")
        assert np.abs(still - 0.02).max() < 1e-3
        end()
    swinging = measured(started(rig), np.zeros(12_000), "laser_2")
    assert swinging.min() < -0.015


def test_a_refused_task_of_the_operator_changes_nothing() -> None:
    rig = simulated(catch_angle=0.1)
    rig.perform(OperatorTask.WATCH_BLOCK, 0.3)
    before = rig.bench.arrangement
    for work, amount in (
        (OperatorTask.MOUNT_SPRING, 100.0),
        (OperatorTask.TILT_BLOCK, 0.11),
        (OperatorTask.PULL_FRAME, None),
    ):
        with pytest.raises((RigError, InvalidInput)):
            rig.perform(work, amount)
        assert rig.bench.arrangement == before


def test_the_same_seed_gives_the_same_session_however_it_is_read() -> None:
    volts = 2.0 * np.sin(16.0 * np.arange(3000) / 2000.0)
    sessions: list[Counts] = []
    for block, seed in ((100, 3), (37, 3), (100, 4)):
        rig = simulated(COUPLED, seed)
        runs: list[Counts] = []
        for _ in range(2):
            started(rig)
            runs += [b.counts for b in play(rig, volts, block)]
            rig.stop()
        sessions.append(np.concatenate(runs))
    np.testing.assert_array_equal(sessions[0], sessions[1])
    assert (sessions[0] != sessions[2]).any()


def test_virtual_time_is_the_time_of_the_samples() -> None:
    clock = VirtualClock()
    clock.wait_until(5.0)
    rig = SimulatedRig(VirtualBenchParameters(), Specimen(), seed=1, clock=clock)
    play(started(rig), np.zeros(3000))
    assert clock.now() == pytest.approx(5.0 + 1.5)


@pytest.mark.seconds
def test_under_a_wall_clock_reading_paces_the_reader() -> None:
    clock = WallClock()
    rig = SimulatedRig(VirtualBenchParameters(), Specimen(), seed=1, clock=clock)
    started(rig)
    begin = clock.now()
    play(rig, np.zeros(400), 100)
    assert 0.19 <= clock.now() - begin < 1.0


def test_the_rig_closes_itself_as_a_context() -> None:
    with simulated() as rig:
        started(rig)
    with pytest.raises(RigError, match="closed"):
        rig.arm()
