from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition, Simulation
from bench.datafile.reader import open_datafile
from bench.datafile.recorder import Recorder
from bench.events import Acquired
from bench.replay.recording import DataFileRecording
from bench.testing.conformance import RigConformance, RigFactory, play, samples, started
from drivers.clock import VirtualClock, WallClock
from drivers.replay import RecordedRun, ReplayRig
from drivers.rig import Block, Channel, Counts, Rig, RigError
from drivers.simulated import SimulatedRig
from sim.errors import InvalidInput
from sim.parameters import Parameters
from sim.virtual_bench import VirtualBenchParameters

BENCH = BenchConfiguration(
    acquisition=Acquisition(lead=0.05), simulation=Simulation(bench=VirtualBenchParameters(sample_rate=1000.0))
)


def simulated() -> SimulatedRig:
    bench = BENCH.simulation.bench
    return SimulatedRig(bench, BENCH.specimen, seed=1, lead=BENCH.lead_samples)


def recorded(path: Path, volts: NDArray[np.float64], runs: int, configured: bool = True) -> list[list[Block]]:
    """Record `runs` runs of a simulated rig with its lead of silence and then `volts`; the blocks that it gave."""
    rig = simulated()
    metadata = {"configuration": BENCH.model_dump_json()} if configured else {}
    recorder = Recorder(
        path, channels=rig.channels, sample_rate=rig.sample_rate, point_type=Parameters, metadata=metadata
    )
    given: list[list[Block]] = []
    for run in range(1, runs + 1):
        given.append(play(started(rig), volts))
        for block in given[-1]:
            recorder(Acquired(run, block, np.zeros(len(block)), time=0.0))
        rig.stop()
    recorder.close("completed")
    return given


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The drive of the conformance tests, as often as the longest of them arms its rig."""
    path = tmp_path_factory.mktemp("replay") / "conformance.h5"
    step = np.full(round(RigConformance.reaction_time * BENCH.sample_rate), RigConformance.drive)
    recorded(path, np.concatenate([np.zeros(200), step, np.zeros(700)]), runs=10)
    return path


class TestReplay(RigConformance):
    @pytest.fixture
    def make_rig(self, path: Path) -> Iterator[RigFactory]:
        with ExitStack() as opened:
            recording = DataFileRecording(opened.enter_context(open_datafile(path)))
            yield lambda: opened.enter_context(ReplayRig(recording))


def test_the_recorded_blocks_come_again_run_by_run(tmp_path: Path) -> None:
    given = recorded(tmp_path / "runs.h5", 0.4 * np.sin(9.0 * np.arange(2000) / 1000.0), runs=2)
    with open_datafile(tmp_path / "runs.h5") as record, ReplayRig(DataFileRecording(record)) as rig:
        assert rig.channels == simulated().channels
        assert (rig.sample_rate, rig.drive_range, rig.lead) == (1000.0, simulated().drive_range, 50)
        for run in given:
            again = play(started(rig), np.zeros(2000), 37)
            rig.stop()
            np.testing.assert_array_equal(
                np.concatenate([block.counts for block in again]), np.concatenate([block.counts for block in run])
            )


def test_a_file_without_the_configuration_of_its_bench_is_refused(tmp_path: Path) -> None:
    recorded(tmp_path / "bare.h5", np.zeros(100), runs=1, configured=False)
    with open_datafile(tmp_path / "bare.h5") as record, pytest.raises(InvalidInput, match="configuration"):
        DataFileRecording(record)


def test_gaps_between_recorded_blocks_are_gaps_between_stretches(tmp_path: Path) -> None:
    rig = simulated()
    metadata = {"configuration": BENCH.model_dump_json()}
    recorder = Recorder(
        tmp_path / "gap.h5", channels=rig.channels, sample_rate=1000.0, point_type=Parameters, metadata=metadata
    )
    blocks = play(started(rig), np.zeros(600))
    for block in (*blocks[:2], *blocks[4:]):
        recorder(Acquired(1, block, np.zeros(len(block)), time=0.0))
    recorder.close("completed")
    with open_datafile(tmp_path / "gap.h5") as record:
        (run,) = DataFileRecording(record).runs
        assert run.stretches == [(0, 200), (400, 200)]
        np.testing.assert_array_equal(run.counts(450, 150), np.concatenate([b.counts for b in blocks])[450:])
        for first, n in ((199, 2), (300, 1), (599, 2)):
            with pytest.raises(InvalidInput, match="sample"):
                run.counts(first, n)


@dataclass
class MadeRun:
    """Sample i of the only channel counts i."""

    stretches: Sequence[tuple[int, int]]

    def counts(self, first: int, n: int) -> Counts:
        return np.arange(first, first + n, dtype=np.int32).reshape(-1, 1)


@dataclass
class Made:
    runs: Sequence[RecordedRun]
    channels: tuple[Channel, ...] = (
        Channel("level", "voltage", "V", 1e-3, 0.0, (-100_000, 100_000), "made", (1e-9,), {100_001: "saturated"}),
    )
    sample_rate: float = 1000.0
    drive_range: float = 10.0
    lead: int = 0
    description: dict[str, str] = field(default_factory=lambda: {"backend": "made"})


def test_a_gap_ends_a_block_and_the_next_one_begins_behind_it() -> None:
    rig = ReplayRig(Made([MadeRun([(0, 130), (200, 70), (300, 100)])]))
    rig.arm()
    rig.write(np.zeros(500))
    blocks = [rig.read(100) for _ in range(4)]
    assert [(block.first, len(block)) for block in blocks] == [(0, 100), (100, 30), (200, 70), (300, 100)]
    assert all((block.counts[:, 0] == block.first + np.arange(len(block))).all() for block in blocks)
    # what is played has the time of the gap too
    assert rig.clock.now() == pytest.approx(0.4)


def test_a_recording_that_begins_late_begins_late() -> None:
    rig = ReplayRig(Made([MadeRun([(1000, 10)])]))
    rig.arm()
    rig.write(np.zeros(10))
    assert rig.read(10).first == 1000


def test_a_run_that_is_over_ends_the_replay_of_it() -> None:
    rig = ReplayRig(Made([MadeRun([(0, 50)]), MadeRun([(0, 10)])]))
    rig.arm()
    rig.write(np.zeros(500))
    assert len(rig.read(100)) == 50
    with pytest.raises(RigError, match="at sample 50"):
        rig.read(1)
    with pytest.raises(RigError, match="not armed"):
        rig.write(np.zeros(1))
    rig.arm()
    rig.write(np.zeros(10))
    assert len(rig.read(10)) == 10


def test_there_is_no_run_after_the_last() -> None:
    rig = ReplayRig(Made([MadeRun([(0, 50)])]))
    rig.arm()
    rig.stop()
    with pytest.raises(RigError, match="no recorded run remains"):
        rig.arm()
    with pytest.raises(RigError, match="not armed"):
        rig.read(1)


def test_what_the_channels_say_of_their_counts_is_kept(tmp_path: Path) -> None:
    made = Made([])
    metadata = {"configuration": BENCH.model_dump_json()}
    recorder = Recorder(
        tmp_path / "wide.h5", channels=made.channels, sample_rate=1000.0, point_type=Parameters, metadata=metadata
    )
    recorder(Acquired(1, Block(0, np.array([[70_000], [100_001]], dtype=np.int32)), np.zeros(2), time=0.0))
    recorder.close("completed")
    with open_datafile(tmp_path / "wide.h5") as record, ReplayRig(DataFileRecording(record), lead=0) as rig:
        assert rig.channels == made.channels
        assert rig.description["backend"] == "replay"
        rig.arm()
        rig.write(np.zeros(2))
        block = rig.read(2)
    assert block.counts.dtype == np.int32
    # 70 V and 1e-9 V for the square of the count
    np.testing.assert_allclose(rig.channels[0].to_unit(block.counts[:, 0]), [70.0 + 4.9, np.nan])


def test_the_lead_is_that_of_the_recording_unless_told() -> None:
    assert ReplayRig(Made([], lead=80)).lead == 80
    assert ReplayRig(Made([], lead=80), lead=7).lead == 7
    with pytest.raises(InvalidInput, match="lead"):
        ReplayRig(Made([]), lead=-1)


@pytest.mark.seconds
def test_under_a_wall_clock_a_block_comes_when_it_was_measured() -> None:
    clock = WallClock()
    rig: Rig = ReplayRig(Made([MadeRun([(0, 200)])]), clock=clock)
    rig.arm()
    begin = clock.now()
    rig.write(np.zeros(samples(rig, 0.2)))
    rig.read(samples(rig, 0.2))
    assert 0.19 <= clock.now() - begin < 2.0


def test_virtual_time_goes_on_from_run_to_run() -> None:
    clock = VirtualClock()
    rig = ReplayRig(Made([MadeRun([(0, 100)]), MadeRun([(0, 100)])]), clock=clock)
    for _ in range(2):
        rig.arm()
        rig.write(np.zeros(100))
        rig.read(100)
        rig.stop()
    assert clock.now() == pytest.approx(0.2)
