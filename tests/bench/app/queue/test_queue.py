"""A queue: what may be done with a test, the file that keeps it, and the command that runs it."""

import errno
import json
import subprocess
import sys
import threading
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.app.cli.main import main
from bench.app.preflight import DiskSpace, Preflight
from bench.app.queue.file import LEFT, Owner, QueueFile
from bench.app.queue.queue import OPEN, Queue, Queued, Stage
from bench.config.result_files import write_specimen
from bench.engine.interface import Requests, Unattended
from bench.preflight.margins import Forecast
from drivers.rig import RigError
from protocols.harmonic.protocol import HarmonicParameters
from sim.errors import InvalidInput
from sim.identified import Identified
from tests.command_line import FakeSession, main_with

ROOT = Path(__file__).parents[4]
FITS = DiskSpace(Path(), 10, 1_000)

Operation = tuple[str, int, int]
_NUMBERS = count()
"""Of the folders: whoever adds a test names one that no other has; `checked` refuses what does not."""


def _try(queue: Queue, operation: Operation) -> None:
    """Do it where it is allowed."""
    name, place, amount = operation
    if name == "add":
        queue.add(Queued(protocol="p", out=f"folder-{next(_NUMBERS)}"))
        return
    if not queue.tests:
        return
    index = place % len(queue.tests)
    try:
        match name:
            case "move":
                queue.move(index, amount - 3)
            case "repeat":
                queue.repeat(index, amount)
            case "begin" if queue.next is not None:
                queue.begin(queue.next, queue.tests[queue.next].out or "")
            case "finish" if queue.tests[index].stage is Stage.RUNNING:
                queue.finish(index, good=amount > 2, outcome="over")
            case "skip":
                queue.skip(index)
            case "edit":
                queue.replace(index, queue.tests[index].model_copy(update={"note": "edited"}))
            case _:
                queue.remove(index)
    except InvalidInput:
        assert name == "repeat" or queue.tests[index].stage not in OPEN


@settings(max_examples=60, deadline=None)
@given(
    operations=st.lists(
        st.tuples(
            st.sampled_from(["add", "move", "repeat", "begin", "finish", "skip", "edit", "remove"]),
            st.integers(0, 30),
            st.integers(0, 6),
        ),
        max_size=40,
    )
)
def test_whatever_is_done_a_test_that_began_stays_as_it_was_and_no_two_share_a_folder(
    operations: list[Operation], tmp_path_factory: pytest.TempPathFactory
) -> None:
    store = QueueFile(tmp_path_factory.mktemp("queue") / "queue.json")
    queue = Queue(store.read(), store.write)
    for operation in operations:
        begun = [test for test in queue.tests if test.stage not in OPEN]
        count = len(queue.tests)
        _try(queue, operation)
        if operation[0] in ("move", "edit", "skip"):
            assert len(queue.tests) == count
        if operation[0] not in ("begin", "finish", "remove"):
            assert [test for test in queue.tests if test.stage not in OPEN] == begun
        folders = [test.out for test in queue.tests]
        assert len(set(folders)) == len(folders)
        first = next((k for k, test in enumerate(queue.tests) if test.stage is Stage.WAITING), None)
        assert queue.next == first
    left = [
        test.model_copy(update={"stage": Stage.FAILED, "outcome": LEFT}) if test.stage is Stage.RUNNING else test
        for test in queue.tests
    ]
    assert list(QueueFile(store.path).read()) == left


def test_a_skipped_test_that_is_edited_stays_skipped() -> None:
    queue = Queue([Queued(protocol="p", out="one")])
    queue.skip(0)
    queue.replace(0, Queued(protocol="p", out="one", note="later"))
    assert (queue.tests[0].stage, queue.tests[0].note) == (Stage.SKIPPED, "later")
    assert queue.next is None


def test_a_copy_has_a_folder_that_does_not_exist_yet(tmp_path: Path) -> None:
    out = tmp_path / "one"
    queue = Queue([Queued(protocol="p", out=str(out))])
    (tmp_path / "one-2").mkdir()
    queue.repeat(0, 2)
    assert [each.out for each in queue.tests] == [str(out), f"{out}-3", f"{out}-4"]


def test_a_change_that_cannot_be_kept_is_not_made(tmp_path: Path) -> None:
    store = QueueFile(tmp_path / "queue.json")
    queue = Queue(store.read(), store.write)
    queue.add(Queued(protocol="one"))
    other = QueueFile(store.path)
    Queue(other.read(), other.write).add(Queued(protocol="another's"))
    with pytest.raises(InvalidInput, match="another program has changed the file"):
        queue.add(Queued(protocol="two"))
    assert [test.protocol for test in queue.tests] == ["one"]
    assert [test.protocol for test in other.read()] == ["one", "another's"]
    assert [path.name for path in tmp_path.iterdir()] == ["queue.json"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "cannot be read as JSON"),
        ("[]", '"format"'),
        ('{"format": "rocking-bench queue", "format_version": 9}', '"format_version": 1'),
        ('{"tests": [{"protocol": "harmonic"}]}', '"format"'),
        ('{"format": "rocking-bench queue", "format_version": 1, "tests": [{}]}', "tests[0].protocol"),
        (
            '{"format": "rocking-bench queue", "format_version": 1, "tests": [{"protocol": "a", "stage": "soon"}]}',
            "queue.json: tests[0].stage = 'soon'",
        ),
        ('{"format": "rocking-bench queue", "format_version": 1, "test": []}', "there is no such key"),
    ],
)
def test_a_file_that_is_wrong_is_refused_and_left_alone(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "queue.json"
    path.write_text(text, encoding="utf-8")
    store = QueueFile(path)
    with pytest.raises(InvalidInput) as refused:
        store.read()
    assert said in str(refused.value)
    with pytest.raises(InvalidInput, match="another program"):
        store.write([])
    assert path.read_text(encoding="utf-8") == text


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeSession:
    """The session and the plan are stand-ins; files are real."""
    monkeypatch.chdir(tmp_path)
    plan = Preflight(Forecast(duration=60.0), (), FITS, "hash")
    monkeypatch.setattr("bench.app.preflight.compile_run", lambda *_asked: plan)
    return FakeSession()


def _write(*tests: dict[str, Any]) -> None:
    content = {"format": "rocking-bench queue", "format_version": 1, "tests": list(tests)}
    Path("queue.json").write_text(json.dumps(content), encoding="utf-8")


def _stages() -> list[Stage]:
    return [test.stage for test in QueueFile(Path("queue.json")).read()]


def _queue(session: FakeSession, *arguments: str) -> int:
    return main_with(session, ["queue", "queue.json", *arguments])


def test_a_file_of_the_first_edition_keeps_its_outcomes(tmp_path: Path) -> None:
    tests = [{"protocol": "harmonic", "stage": "done", "told": "completed: the plan was carried out"}]
    path = tmp_path / "queue.json"
    path.write_text(json.dumps({"format": "rocking-bench queue", "format_version": 1, "tests": tests}))
    file = QueueFile(path)
    (test,) = file.read()
    assert test.outcome == "completed: the plan was carried out"
    file.write([test])
    assert "told" not in path.read_text()


def test_what_is_added_is_what_is_run(session: FakeSession, capsys: pytest.CaptureFixture[str]) -> None:
    add = ["run", "harmonic", "--starts", "3", "--omega", "14", "--queue", "queue.json"]
    assert main_with(session, [*add, "--out", "first", "--realtime"]) == 0
    assert main_with(session, [*add, "--note", "once more"]) == 0
    assert main_with(session, ["check", "--queue", "queue.json"]) == 0
    assert session.calls == []
    assert not Path("first").exists()
    capsys.readouterr()
    session.during = lambda _requests: print("a library that talks")

    class Session(FakeSession):
        def __call__(self, *asked: Any, **how: Any) -> Any:
            ended = super().__call__(*asked, **how)
            return ended if len(self.calls) < 3 else type(ended)("completed", "", {"points": []}, "", False)

    run = Session(during=session.during)
    assert _queue(run, "--json") == 0
    shown = capsys.readouterr()
    assert [test["stage"] for test in json.loads(shown.out)["tests"]] == ["done"] * 3
    assert [call["parameters"] for call in run.calls[:2]] == [HarmonicParameters(starts=3, omega=(14.0,))] * 2
    assert [call["realtime"] for call in run.calls] == [True, False, False]
    folders = [call["out"] for call in run.calls]
    assert folders[0] == Path("first")
    assert len(set(folders)) == 3
    assert all(call["operator"] == Unattended("the bench itself") for call in run.calls)
    assert _queue(run) == 0, "nothing waits any more"
    assert len(run.calls) == 3


def _raising(error: BaseException) -> Callable[[Requests], None]:
    def during(_requests: Requests) -> None:
        raise error

    return during


@pytest.mark.parametrize(
    ("status", "during", "code", "stage", "outcome"),
    [
        ("stopped", None, 1, Stage.DONE, "stopped: why it ended"),
        ("aborted", None, 1, Stage.FAILED, "aborted: why it ended"),
        ("completed", _raising(RigError("the rig went away")), 1, Stage.FAILED, "failed: the rig went away"),
        ("completed", _raising(InvalidInput("omega", 2.0, "too slow")), 1, Stage.FAILED, "refused: omega = 2.0"),
        ("completed", _raising(KeyboardInterrupt()), 130, Stage.FAILED, "before anything moved"),
    ],
)
def test_what_waits_goes_on_waiting_after_a_test_that_did_not_end_well(
    session: FakeSession,
    status: str,
    during: Callable[[Requests], None] | None,
    code: int,
    stage: Stage,
    outcome: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    test = {"protocol": "laser-calibration"}
    _write({**test, "stage": "skipped"}, test, test)
    session.status = status
    if during is not None:
        session.during = during
    assert _queue(session) == code
    assert _stages() == [Stage.SKIPPED, stage, Stage.WAITING]
    assert len(session.calls) == 1
    assert outcome in capsys.readouterr().out
    session.status, session.during = "completed", FakeSession().during
    assert _queue(session) == 0
    assert _stages() == [Stage.SKIPPED, stage, Stage.DONE]


@pytest.mark.parametrize(
    ("second", "said"),
    [
        ({"protocol": "harmonics"}, "test 2: protocol = 'harmonics' is refused: one of check, "),
        ({"protocol": "harmonic", "parameters": {"omega": [99.0]}}, "test 2: omega[0] = 99.0"),
        ({"protocol": "check", "parameters": {"velocity": 0.5}}, "test 2: omega = "),
        ({"protocol": "harmonic", "out": "full"}, "test 2: --out = 'full' is refused: it already contains campaign.h5"),
        ({"protocol": "harmonic", "out": "./one"}, "test 2: out = './one' is refused: test 1 has the same folder"),
    ],
)
def test_nothing_begins_when_one_of_them_cannot(
    session: FakeSession, second: dict[str, Any], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("full").mkdir()
    Path("full", "campaign.h5").touch()
    _write({"protocol": "harmonic", "out": "one"}, second)
    before = Path("queue.json").read_bytes()
    assert _queue(session) == 2
    assert said in capsys.readouterr().err
    assert session.calls == []
    assert Path("queue.json").read_bytes() == before


def test_tests_that_fit_one_by_one_must_fit_together(
    session: FakeSession, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    big = Preflight(Forecast(duration=60.0), (), DiskSpace(Path(), 600_000_000, 1_000_000_000), "hash")
    monkeypatch.setattr("bench.app.preflight.compile_run", lambda *_asked: big)
    _write({"protocol": "laser-calibration"}, {"protocol": "laser-calibration"})
    assert _queue(session) == 2
    assert "may need 1.20 GB, but 1.00 GB are free" in capsys.readouterr().err


def test_a_dry_run_tells_of_every_plan_and_runs_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """With the true plan: the drift of the second one is beyond its limit."""
    monkeypatch.chdir(tmp_path)
    point = {"omega": [13.0], "beta": [0.4], "starts": 1}
    _write(
        {"protocol": "harmonic", "parameters": point},
        {"protocol": "harmonic", "parameters": {**point, "omega": [16.0]}},
    )
    Path("bench.toml").write_text("[limits]\ndrift = 0.05\n", encoding="utf-8")
    assert main(["queue", "queue.json", "--dry-run", "--config", "bench.toml"]) == 2
    shown = capsys.readouterr()
    assert [line.split()[0] for line in shown.out.splitlines()[3:]] == ["1", "2"]
    assert "test 2: limits.drift = 0.05 is refused" in shown.err
    assert _stages() == [Stage.WAITING, Stage.WAITING]


def test_a_queue_has_one_owner_and_none_when_that_one_dies(
    session: FakeSession, capsys: pytest.CaptureFixture[str]
) -> None:
    _write({"protocol": "laser-calibration"})
    before = Path("queue.json").read_bytes()
    program = (
        "import sys, time; from pathlib import Path; from bench.app.queue.file import Owner\n"
        "owner = Owner(Path(sys.argv[1]), 'another window'); print('owned', flush=True); time.sleep(60)"
    )
    command = [sys.executable, "-c", program, str(Path("queue.json").absolute())]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "owned\n"
        for refused in (["run", "harmonic", "--queue", "queue.json"], ["queue", "queue.json"]):
            assert main_with(session, refused) == 2
            told = capsys.readouterr().err
            assert f"in use by another window (process {other.pid})" in told
            assert "choose another file" in told
        assert Path("queue.json").read_bytes() == before
        assert _queue(session, "--dry-run") == 0, "what only looks is let"
        other.kill()
    # the name of the dead owner is still there; its lock is not
    assert Path("queue.json.owner").exists()
    assert session.calls == []
    assert _queue(session) == 0
    assert _stages() == [Stage.DONE]


@pytest.mark.skipif(sys.platform == "win32", reason="every file system of Windows has locks")
def test_a_file_system_without_locks_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a network share may be: a file that merely exists would be taken for a lock after its owner died."""

    def no_locks(_handle: int, _operation: int) -> None:
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr("fcntl.flock", no_locks)
    with pytest.raises(InvalidInput, match=r"queue\.json\.lock cannot be locked: Function not implemented"):
        Owner(tmp_path / "queue.json", "a window")
    assert not (tmp_path / "queue.json.owner").exists()


def test_the_lock_is_released_once_and_by_any_thread(tmp_path: Path) -> None:
    path = tmp_path / "queue.json"
    first = Owner(path, "first")
    with pytest.raises(InvalidInput, match=r"in use by first \(process \d+\)"):
        Owner(path, "second")
    thread = threading.Thread(target=first.release)
    thread.start()
    thread.join()
    second = Owner(path, "second")
    first.release()
    with pytest.raises(InvalidInput, match="second"):
        Owner(path, "third")
    second.release()


def test_while_a_queue_runs_nothing_is_added_to_it(session: FakeSession, capsys: pytest.CaptureFixture[str]) -> None:
    _write({"protocol": "laser-calibration"})
    codes: list[int] = []
    session.during = lambda _requests: codes.append(main(["run", "harmonic", "--queue", "queue.json"]))
    assert _queue(session) == 0
    assert codes == [2]
    assert "`rockbench queue` (process" in capsys.readouterr().err
    assert _stages() == [Stage.DONE]


def test_a_file_that_is_not_there_is_refused(session: FakeSession, capsys: pytest.CaptureFixture[str]) -> None:
    assert _queue(session) == 2
    assert "there is no such file" in capsys.readouterr().err


def test_a_test_that_has_run_is_told_even_if_the_file_was_changed_meanwhile(
    session: FakeSession, capsys: pytest.CaptureFixture[str]
) -> None:
    _write({"protocol": "laser-calibration"}, {"protocol": "laser-calibration"})

    def save(_requests: Requests) -> None:
        path = Path("queue.json")
        path.write_text(path.read_text() + " ")

    session.during = save
    assert _queue(session) == 1
    assert len(session.calls) == 1
    said = capsys.readouterr().err
    assert "test 1 completed" in said
    assert "another program has changed the file" in said


@pytest.mark.parametrize(
    ("options", "item"),
    [
        (["--dry-run"], "--dry-run"),
        (["--profile", "fast"], "--profile"),
        (["--seed", "7"], "--seed"),
        (["--specimen", "specimen.json"], "--specimen"),
        (["--yes", "--ask"], "--yes"),
    ],
)
def test_options_that_a_test_in_a_queue_cannot_have_are_refused(
    session: FakeSession, capsys: pytest.CaptureFixture[str], options: list[str], item: str
) -> None:
    write_specimen(Path("specimen.json"), Identified())
    assert main_with(session, ["run", "harmonic", "--queue", "queue.json", *options]) == 2
    assert f"{item} = " in capsys.readouterr().err
    assert not Path("queue.json").exists()


def test_an_added_test_is_one_object_with_json(session: FakeSession, capsys: pytest.CaptureFixture[str]) -> None:
    assert main_with(session, ["run", "harmonic", "--queue", "queue.json", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"queue": "queue.json", "test": 1}
