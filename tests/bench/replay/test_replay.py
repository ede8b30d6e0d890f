"""A recorded campaign replays as it was, however it ended; what does not is told where it parts."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pytest

from bench.analysis.signals import ACCELERATION
from bench.app.cli.main import main
from bench.config.model import BenchConfiguration
from bench.config.sections import Acquisition, Simulation
from bench.control.oscillator import DriveCalibration, Segment
from bench.datafile.reader import open_datafile
from bench.engine.interface import Requests
from bench.engine.steps import Arm, Calibrate, Dwell, Measured, OperatorAction, Plan, Publish, RampOut, Sweep
from bench.events import Acquired, Event, PointFinished, Warned
from bench.guard.limits import Limits
from bench.live_values import Estimate
from bench.provenance import software
from bench.replay import session
from bench.replay.compare import DRIVE, JOURNAL, POINTS
from bench.replay.session import LONGEST_WAIT, PacedClock, Replayed, replay, stored_configuration
from bench.testing.loopback import LoopbackRig
from drivers.clock import VirtualClock
from drivers.errors import DeviceTimeout
from drivers.rig import Alignment, Block, OperatorTask
from sim.errors import CauseCode, InvalidInput
from sim.parameters import Parameters, quantity
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.recorded import recorded
from tests.undrawn import undrawn

BENCH = BenchConfiguration(
    acquisition=Acquisition(lead=0.1),
    simulation=Simulation(bench=VirtualBenchParameters(sample_rate=1000.0)),
    limits=Limits(velocity=50.0),
)
OMEGA = 20.0
BARE = Specimen().bare()


class Found(Parameters):
    peak: float = quantity(..., "m/s2", "peak of the table")
    doubt: float | None = quantity(None, "m/s2", "nothing is known of it")
    good: bool | None = quantity(True, "1", "whether it is good")
    reason: str = quantity("", "", "in words")


class Two:
    """Two tests, each after a person's work; the second goes on from what the first has measured."""

    def check(self, configuration: BenchConfiguration) -> None:
        pass

    def plan(self, configuration: BenchConfiguration) -> Plan:  # noqa: ARG002
        amplitude = 1.0
        for work in ("Take the block off.", "Put it back."):
            yield OperatorAction(OperatorTask.REMOVE_BLOCK, BARE, work)
            yield Arm(0.5)
            yield Calibrate(DriveCalibration.flat(1.0))
            yield Sweep((Segment(1.0, amplitude, OMEGA),))
            outcome = yield Dwell(4)
            assert isinstance(outcome, Measured)
            peak = float(np.mean([cycle.peak[ACCELERATION] for cycle in outcome.cycles]))
            yield Publish(Estimate(OMEGA, None, 4, peak, math.nan, math.nan, 1.0))
            yield Publish(PointFinished(Found(peak=peak, reason="ä" * 400)))
            yield RampOut()
            amplitude = 1.0 + peak / 3.0


@dataclass
class Person:
    """Declines, or asks for the end of the run, when the second question comes."""

    requests: Requests
    declines: bool = False
    stops: bool = False
    asked: int = 0
    name: str = "somebody (at the bench)"

    def confirm(self, request: str) -> bool:  # noqa: ARG002
        self.asked += 1
        if self.asked == 2 and self.stops:
            self.requests.stop()
        return not (self.asked == 2 and self.declines)


@dataclass
class Mishap:
    """What happens when block 17 has been read."""

    rig: LoopbackRig
    requests: Requests
    do: Callable[["Mishap"], None]
    blocks: int = field(default=0)

    def __call__(self, event: Event) -> None:
        self.blocks += isinstance(event, Acquired)
        if isinstance(event, Acquired) and self.blocks == 17:
            self.do(self)

    def fail(self) -> None:
        def read(n: int) -> Block:
            raise DeviceTimeout(f"no {n} samples came")

        self.rig.read = read  # type: ignore[method-assign]

    def open(self) -> None:
        self.rig.safety = {"emergency stop": False, "door": True, "fence": False}

    def late(self) -> None:
        """The next block comes 3 s late, and those after it at their intervals: blocks at one time have no order."""
        self.rig.clock.wait_until(self.rig.clock.now() + 3.0)
        self.rig._started += 3.0


def loopback(lead: int = BENCH.lead_samples) -> LoopbackRig:
    """Its lasers see enough not to look stuck; one has a clock of its own."""
    rig = LoopbackRig(lead=lead)
    rig.alignments = (Alignment("laser_1", 0.1, 1.00003, 2e-6, 0.0035, 4000, 1),)
    rig.response |= {"laser_1": lambda volts: 0.01 * volts, "laser_2": lambda volts: 0.02 * volts}
    return rig


ENDINGS: dict[str, tuple[Callable[[Mishap], None] | None, dict[str, bool]]] = {
    "completed": (None, {}),
    "stop": (lambda m: m.requests.stop(), {}),
    "client lost": (lambda m: m.requests.stop("the window was closed", CauseCode.CLIENT_LOST), {}),
    "abort": (lambda m: m.requests.abort(), {}),
    "halt": (lambda m: m.requests.halt(), {}),
    "declined": (None, {"declines": True}),
    "stopped in a question": (None, {"stops": True}),
    "emergency stop": (Mishap.open, {}),
    "late": (Mishap.late, {}),
    "error": (Mishap.fail, {}),
}
TIGHT = BENCH.model_copy(update={"limits": BENCH.limits.model_copy(update={"displacement": 0.005})})
ALONE = {"alone": BENCH, "alone, with a tight limit": TIGHT}
"""Runs without an operator, with no warning before."""


def record_run(path: Path, ending: str) -> None:
    if (bench := ALONE.get(ending)) is not None:
        recorded(path, Two().plan(bench), loopback(), bench, Found)
        return
    do, person = ENDINGS[ending]
    rig, requests = loopback(), Requests()
    recorded(
        path,
        Two().plan(BENCH),
        rig,
        BENCH,
        Found,
        requests=requests,
        operator=Person(requests, **person),
        subscribers=[] if do is None else [Mishap(rig, requests, do)],
        first=[Warned("the stroke is nearly used up", time=0.0)],
    )


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The data file of a run by its ending, recorded once: what changes it takes a copy."""
    folder = tmp_path_factory.mktemp("kept")

    @cache
    def run(ending: str) -> Path:
        path = folder / f"{ending}.h5"
        record_run(path, ending)
        return path

    return run


@pytest.fixture(scope="module")
def again(kept: Callable[[str], Path]) -> Callable[[str], Replayed]:
    """The replay of an unchanged run by its ending, carried out once."""
    return cache(lambda ending: played(kept(ending)))


@pytest.fixture
def path(kept: Callable[[str], Path], tmp_path: Path) -> Path:
    """A copy of the completed run."""
    return copied(kept("completed"), tmp_path)


def copied(path: Path, folder: Path) -> Path:
    (folder / "run.h5").write_bytes(path.read_bytes())
    return folder / "run.h5"


def played(path: Path, bench: BenchConfiguration = BENCH) -> Replayed:
    before = path.read_bytes()
    with open_datafile(path) as record:
        configuration = stored_configuration(record)
        assert configuration == bench
        replayed = replay(record, Two().plan(configuration), configuration, clock=VirtualClock(), subscribers=[])
    assert path.read_bytes() == before
    return replayed


@pytest.mark.parametrize(
    ("ending", "status"),
    [
        ("completed", "completed"),
        ("stop", "stopped"),
        ("abort", "aborted"),
        ("halt", "halted"),
        ("declined", "aborted"),
        ("stopped in a question", "stopped"),
        ("emergency stop", "halted"),
    ],
)
def test_every_ending_comes_again(again: Callable[[str], Replayed], ending: str, status: str) -> None:
    replayed = again(ending)
    assert replayed.found.differences == []
    assert replayed.identical
    assert (replayed.status, replayed.ended) == (status, None)
    assert replayed.played == replayed.rows > 1500
    points = {"completed": 2}.get(status, bool(ENDINGS[ending][1]))
    assert replayed.found.compared[POINTS] == len(replayed.points) == points
    assert replayed.found.compared["estimates"] == len(replayed.points)


@pytest.fixture(scope="module")
def led(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The data file of a run on a rig whose lead is 7 samples longer than the configured one."""
    path, lead = tmp_path_factory.mktemp("led") / "run.h5", BENCH.lead_samples + 7
    recorded(path, Two().plan(BENCH), loopback(lead=lead), BENCH, Found, {"lead": f"{lead}"})
    return path


def with_lead(path: Path, folder: Path, stored: str | None) -> Path:
    """A copy of a run; `stored` is what it says of the lead."""
    path = copied(path, folder)
    with h5py.File(path, "r+") as file:
        metadata = file["entry/metadata"]
        del metadata["lead"]
        if stored is not None:
            metadata["lead"] = stored
    return path


def test_the_lead_of_the_open_rig_counts_not_the_configured_one(led: Path) -> None:
    assert played(led).identical


def test_a_file_without_the_lead_of_its_rig_has_the_configured_one(led: Path, tmp_path: Path) -> None:
    """As written by earlier versions."""
    assert played(with_lead(led, tmp_path, None)).found.differences[0].part == DRIVE


@pytest.mark.parametrize("stored", ["", "-1", "7.5", "10001", "9" * 5000, "²"])
def test_a_lead_that_is_none_is_refused(led: Path, tmp_path: Path, stored: str) -> None:
    with pytest.raises(InvalidInput, match="it must be a number of samples from 0 to 10000"):
        played(with_lead(led, tmp_path, stored))


def test_a_limit_that_was_exceeded_is_exceeded_again(kept: Callable[[str], Path]) -> None:
    path = kept("alone, with a tight limit")
    replayed = played(path, TIGHT)
    assert replayed.identical
    with open_datafile(path) as record:
        assert (replayed.status, replayed.reason) == (record.status, record.summary)
        assert "displacement" in record.summary


def test_blocks_that_came_late_are_in_no_sample_an_abort_stands_for_them(again: Callable[[str], Replayed]) -> None:
    replayed = again("late")
    assert replayed.found.differences == []
    (reason,) = replayed.in_place
    assert "delay of a block of samples 3 s exceeds" in reason
    assert (replayed.status, replayed.reason) == ("aborted", reason)
    assert replayed.played == replayed.rows


def test_the_clock_of_the_computer_is_no_part_of_the_replay(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        times = file["entry/instrument/blocks/time"]
        # published after some work, as on a wall clock; the first block longest
        times[1:] += 0.02 * np.random.default_rng(1).random(len(times) - 1)
        times[0] += 0.09
    assert played(path).identical


def test_an_error_of_the_rig_is_where_the_recording_breaks_off(again: Callable[[str], Replayed]) -> None:
    replayed = again("error")
    assert replayed.identical
    assert replayed.ended is not None
    assert "sample 1700" in replayed.ended
    assert "no 100 samples came" in replayed.ended


def test_a_killed_program_leaves_what_replays_up_to_there(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        entry = file["entry"]
        rows, time = 1637, 1.6
        entry["complete"][0] = rows
        entry["complete"][2] = int((entry["events/time"][:] < time).sum())
        entry["complete"][3:5] = 0
        entry["status"][()] = b"running"
    replayed = played(path)
    assert replayed.found.differences == []
    assert replayed.ended is not None
    assert "killed" in replayed.ended
    assert (replayed.played, replayed.rows) == (1600, rows)


@pytest.mark.parametrize(("status", "said"), [("running", "killed"), ("interrupted", "recovered")])
def test_a_program_killed_during_a_question_replays_up_to_it_with_or_without_recovery(
    path: Path, status: str, said: str
) -> None:
    with h5py.File(path, "r+") as file:
        entry = file["entry"]
        kinds = [kind.decode() for kind in entry["events/kind"][:]]
        asked = [index for index, kind in enumerate(kinds) if kind == "OperatorAsked"][1]
        runs = entry["instrument/blocks/run"][:]
        blocks = int((runs == runs[0]).sum())
        parts = entry["complete"].attrs["parts"].split()
        ends = {
            "samples": entry["instrument/blocks/row"][blocks],
            "blocks": blocks,
            "events": asked + 1,
            "state_changes": kinds[:asked].count("StateChanged"),
            "operator_requests": 2,
            **dict.fromkeys(("points", "estimates", "alignments", "operator_answers", "operator_actions"), 1),
        }
        for part, end in ends.items():
            entry["complete"][parts.index(part)] = end
        entry["status"][()] = status.encode()
        entry["summary"][()] = b"recovered from the data on the disk"
    replayed = played(path)
    assert replayed.found.differences == []
    assert said in str(replayed.ended)
    assert (len(replayed.points), replayed.found.compared[JOURNAL]) == (1, asked + 1)
    # it is compared as far as it goes
    _changed(path, "points/peak", 0, 1.01)
    _changed(path, "events/text", 3, "nobody knows")
    assert {each.part for each in played(path).found.differences} == {JOURNAL, POINTS}


def _changed(path: Path, dataset: str, row: int, value: object) -> None:
    with h5py.File(path, "r+") as file:
        file["entry"][dataset][row] = value


@pytest.mark.parametrize(
    ("dataset", "row", "value", "part", "said"),
    [
        ("points/peak", 1, 1.01, POINTS, "row 2 of points: peak was 1.01"),
        ("points/good", 0, 0, POINTS, "row 1 of points: good was False"),
        ("points/doubt", 0, 0.1, POINTS, "row 1 of points: doubt was 0.1 and is None"),
        ("estimates/predicted", 0, 1.1, "estimates", "row 1 of estimates: predicted was 1.1"),
        ("instrument/drive/voltage", 1204, 3.0, DRIVE, "the drive first differs at sample 1204 of run 1: recorded 3 V"),
        ("events/text", 3, "nobody knows", JOURNAL, "journal entry 4 was"),
        ("summary", (), "all was well", "ending", "all was well"),
    ],
)
def test_what_is_not_as_recorded_is_told(
    path: Path, dataset: str, row: int, value: object, part: str, said: str
) -> None:
    _changed(path, dataset, row, value)
    replayed = played(path)
    assert not replayed.agrees
    assert [each.part for each in replayed.found.differences] == [part]
    assert said in str(replayed.first_difference(part))


def _reworded(path: Path) -> None:
    """As an edition with other sentences would have written the file."""
    with h5py.File(path, "r+") as file:
        file.attrs["wording"] = 1
        entry = file["entry"]
        for texts in (entry["events/text"], entry["state_changes/reason"]):
            texts[:] = [b"in other words: " + bytes(text) for text in texts[:]]
        entry["summary"][()] = b"in other words"


REPLAYED = ("completed", "client lost", "halt", "declined", "stopped in a question", "emergency stop", "late", "error")
REWORDED = {"completed", "stopped in a question", "emergency stop", "error"}
"""One ending of each kind: by the plan, by a person, by the rig, by an error; the others with the mark soak."""


@pytest.mark.parametrize(
    ("ending", "reworded"),
    [
        *((ending, False) for ending in REPLAYED),
        *(pytest.param(each, True, marks=() if each in REWORDED else pytest.mark.soak) for each in REPLAYED),
    ],
)
def test_a_file_replays_by_its_columns_whatever_the_wording(
    kept: Callable[[str], Path], again: Callable[[str], Replayed], tmp_path: Path, ending: str, reworded: bool
) -> None:
    if reworded:
        path = copied(kept(ending), tmp_path)
        _reworded(path)
        replayed = played(path)
    else:
        replayed = again(ending)
    assert replayed.found.differences == []
    assert replayed.same_wording is not reworded
    assert replayed.found.compared[JOURNAL] > 7
    assert replayed.found.compared["state changes"] > 3


@pytest.mark.parametrize(
    ("dataset", "row", "value", "said"),
    [
        ("events/kind", 3, "StepStarted", "journal entry 4 was StepStarted"),
        ("events/time", 6, 0.0, "after 0 blocks and is"),
        ("state_changes/after", 2, "stopping", "after was 'stopping' and is 'armed'"),
        ("state_changes/code", 3, "limit", "code was 'limit' and is ''"),
        ("operator_actions/work", 0, "lock table", "work was 'lock table' and is"),
        ("exceeded_limits/value", 0, 0.123, "value was 0.123 and is 0.0"),
        ("exceeded_limits/unit", 0, "m/s", "unit was 'm/s' and is 'm'"),
        ("points/peak", 0, 1.01, "peak was 1.01 and is"),
    ],
)
def test_a_changed_kind_or_number_is_found_in_a_file_of_another_wording(
    kept: Callable[[str], Path], tmp_path: Path, dataset: str, row: int, value: object, said: str
) -> None:
    ending = "alone, with a tight limit" if "limits" in dataset else "alone"
    path = copied(kept(ending), tmp_path)
    _reworded(path)
    _changed(path, dataset, row, value)
    replayed = played(path, ALONE[ending])
    assert any(said in each.text for each in replayed.found.differences), replayed.found.differences
    assert not replayed.agrees


def test_the_command_says_that_another_wording_was_not_compared(
    checked: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "older.h5"
    path.write_bytes(checked.read_bytes())
    _reworded(path)
    assert main(["replay", str(path)]) == 0
    assert "older version; the wording of its messages was not compared" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("was", "now", "said"),
    [
        ("abc", "abc", ()),
        ("abc", "abd", ("git was abc and is abd",)),
        ("abc", "abc+", ("git was abc and is abc+",)),
        # files that were changed since the hash may be any
        ("abc+", "abc+", ("git is abc+ in both, which does not prove that the sources are identical",)),
        (None, "abc", ("git was unknown and is abc",)),
    ],
)
def test_other_software_is_told_by_its_git_hash_where_the_versions_are_the_same(
    was: str | None, now: str, said: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session, "revision", lambda: now)
    assert session._changed(software() | ({} if was is None else {"git": was})) == said


def test_rounding_is_told_from_difference(path: Path) -> None:
    with h5py.File(path, "r") as file:
        peak, volts = file["entry/points/peak"][0], file["entry/instrument/drive/voltage"][1204]
    _changed(path, "points/peak", 0, np.nextafter(peak, 2.0))
    _changed(path, "instrument/drive/voltage", 1204, np.nextafter(volts, np.float32(2.0)))
    replayed = played(path)
    assert replayed.agrees
    assert not replayed.identical
    assert {each.part for each in replayed.found.differences} == {POINTS, DRIVE}


def test_another_measurement_leads_to_another_drive_and_that_is_where_it_parts(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        blocks = file["entry/instrument/blocks"]
        begin = int(blocks["row"][:][blocks["run"][:] == 2][0])
        counts = file["entry/instrument/table_acceleration/counts"]
        # the amplitude of the second test follows from the first one's measurement
        counts[1600:begin] = (counts[1600:begin] * 0.9).astype(np.int16)
    replayed = played(path)
    assert "run 2" in str(replayed.first_difference(DRIVE))
    assert replayed.first_difference(POINTS) is not None


def test_the_pace_is_kept_and_nothing_is_ever_late(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a machine whose time passes only while it sleeps."""
    passed = [0.0]

    def sleep(duration: float) -> None:
        passed[0] += duration

    monkeypatch.setattr("bench.replay.session.now", lambda: passed[0])
    monkeypatch.setattr("bench.replay.session.waiting.sleep", sleep)
    clock = PacedClock(20.0)
    for step in range(1, 11):
        clock.wait_until(0.2 * step)
        if step == 5:
            sleep(0.1)
    # ten steps of 10 ms and a slow computation, which covers the first step after it
    assert passed[0] == pytest.approx(0.19)
    assert clock.now() == pytest.approx(2.0)
    clock.wait_until(3600.0)
    assert passed[0] == pytest.approx(0.19 + LONGEST_WAIT / 20.0)
    clock.wait_until(10.0)
    assert clock.now() == 3600.0


SHORT = ("--omega", "12", "18", "27", "40", "--cycles", "4", "--yes")


@pytest.fixture(scope="module")
def checked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A loop check, as the command line leaves it."""
    folder = tmp_path_factory.mktemp("check")
    with undrawn():
        assert main(["check", *SHORT, "--out", str(folder / "run")]) == 0
    return folder / "run" / "campaign.h5"


def test_the_command_replays_a_run_of_the_command_line(checked: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(checked), "--speed", "500"]) == 0
    shown = capsys.readouterr()
    assert "Bit-identical to the file" in shown.out
    assert "passed" in shown.out
    assert "Remove the clamps" in shown.err


def test_a_difference_is_an_exit_code_and_a_line(
    checked: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "changed.h5"
    path.write_bytes(checked.read_bytes())
    _changed(path, "points/verdict", 0, "failed")
    assert main(["replay", str(path), "--json"]) == 1
    shown = capsys.readouterr()
    content = json.loads(shown.out)
    assert not content["identical"]
    assert not any(each.startswith("git was") for each in content["software_changed"])
    assert content["samples"]["played"] == content["samples"]["recorded"]
    assert "verdict was 'failed' and is 'passed'" in shown.err.splitlines()[-1]


def test_what_cannot_be_played_is_refused_in_a_line(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(path.with_name("none.h5"))]) == 2
    assert "there is no such file" in capsys.readouterr().err
    assert main(["replay", str(path)]) == 2
    assert "protocol of the data file" in capsys.readouterr().err
    for speed in ("0", "fast", "-1", "nan"):
        assert main(["replay", str(path), f"--speed={speed}"]) == 2
        assert "--speed" in capsys.readouterr().err


def test_an_arming_that_was_refused_ends_no_run_before_it(tmp_path: Path) -> None:
    rig = loopback()

    class Presses:
        """Presses the emergency stop while putting the block back, and confirms."""

        name, asked = "somebody (at the bench)", 0

        def confirm(self, request: str) -> bool:  # noqa: ARG002
            self.asked += 1
            if self.asked == 2:
                rig.safety = {"emergency stop": False}
            return True

    ending = recorded(tmp_path / "run.h5", Two().plan(BENCH), rig, BENCH, Found, operator=Presses())
    assert "arming is refused: emergency stop open" in ending.reason
    replayed = played(tmp_path / "run.h5")
    assert replayed.found.differences == []
    assert len(replayed.points) == 1
    assert replayed.ended is not None
    assert "no recorded run remains" in replayed.ended
