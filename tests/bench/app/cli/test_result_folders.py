"""Folders for results: runs that begin in the same second get one each, and a refused run leaves none."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from bench.app import run as script
from bench.app.folders import make_folder, remove_unused
from sim.errors import InvalidInput
from tests.command_line import FakeSession, main_with

SAME_SECOND = """
import json, os, sys
from contextlib import redirect_stderr, redirect_stdout
from datetime import datetime
from io import StringIO
from pathlib import Path
import bench.app.folders as output
import bench.app.preflight
import bench.app.session
from bench.app.cli.main import main
from bench.app.session import SessionResult

dated = output.default_folder
output.default_folder = lambda protocol, now: dated(protocol, datetime(2026, 1, 2, 3, 4, 5))

def start(protocol, configuration, *, out, **_):
    out.mkdir(parents=True, exist_ok=True)
    with open(out / "campaign.h5", "x") as file:
        file.write(sys.argv[1])
    return SessionResult("completed", "", {"points": []}, "", False)

bench.app.preflight.load_bench = lambda *_: None
bench.app.session.run_session = start
for folder, *arguments in json.loads(sys.argv[2]):
    os.chdir(folder)
    print("ready", flush=True)
    sys.stdin.readline()
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()) as errors:
        code = main(["run", "laser-calibration", "--yes", *arguments])
    print(json.dumps([code, errors.getvalue()]), flush=True)
"""
"""Runs with a clock that stands still and without their bench: what is left is the command and the folder. The
protocol is one that computes nothing before it begins."""

SAME = "laser-calibration-2026-01-02T03-04-05"

Together = dict[Path, list[tuple[int, str]]]
"""The code and standard error of each of two runs that were let go in a folder at the same moment."""


@pytest.fixture(scope="module")
def together(tmp_path_factory: pytest.TempPathFactory) -> Together:
    """Two processes, which run at the same moment in a folder, then in one with an older result in `mine`, and in one
    in which a run of the same second has begun already."""
    free, taken, begun = (tmp_path_factory.mktemp(name) for name in ("free", "taken", "begun"))
    (taken / "mine").mkdir()
    (taken / "mine" / "campaign.h5").write_text("older")
    (begun / "runs" / SAME).mkdir(parents=True)
    (begun / "runs" / SAME / "campaign.h5").write_text("earlier")
    rounds = json.dumps([[str(free)], [str(taken), "--out", "mine"], [str(begun)]])
    running = [
        subprocess.Popen(
            [sys.executable, "-c", SAME_SECOND, name, rounds], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        for name in ("first", "second")
    ]
    found: Together = {free: [], taken: [], begun: []}
    for ended in found.values():
        for process in running:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
        for process in running:
            assert process.stdin is not None
            process.stdin.write("\n")
            process.stdin.flush()
        for process in running:
            assert process.stdout is not None
            code, errors = json.loads(process.stdout.readline())
            ended.append((code, errors))
    for process in running:
        process.communicate()
    assert [process.returncode for process in running] == [0, 0]
    return found


def test_two_runs_in_the_same_second_have_a_folder_each(together: Together) -> None:
    folder, ended = next(iter(together.items()))
    assert [code for code, _ in ended] == [0, 0]
    folders = sorted(path.name for path in (folder / "runs").iterdir())
    assert folders == [SAME, f"{SAME}-2"]
    assert {(folder / "runs" / each / "campaign.h5").read_text() for each in folders} == {"first", "second"}


def test_a_folder_that_was_named_is_never_exchanged_for_another(together: Together) -> None:
    folder, ended = [*together.items()][1]
    for code, errors in ended:
        assert code == 2
        assert "it already contains campaign.h5" in errors
    assert sorted(path.name for path in folder.iterdir()) == ["mine"]
    assert (folder / "mine" / "campaign.h5").read_text() == "older"


def test_a_run_of_the_same_second_that_wrote_already_keeps_its_folder(together: Together) -> None:
    folder, ended = [*together.items()][2]
    assert [code for code, _ in ended] == [0, 0]
    texts = {path.name: (path / "campaign.h5").read_text() for path in (folder / "runs").iterdir()}
    assert texts.pop(SAME) == "earlier"
    assert sorted(texts) == [f"{SAME}-2", f"{SAME}-3"]
    assert {*texts.values()} == {"first", "second"}


def test_a_run_of_a_script_in_the_same_second_has_its_own_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = FakeSession()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(script, "run_session", session)
    monkeypatch.setattr(script, "default_folder", _same_folder)
    Path("runs", SAME).mkdir(parents=True)
    Path("runs", SAME, "campaign.h5").touch()
    monkeypatch.setattr(script, "Campaign", Path)
    assert script.run("laser-calibration") == session.calls[0]["out"] == Path("runs", f"{SAME}-2")


def _same_folder(*_: object) -> Path:
    return Path("runs", SAME)


def test_many_processes_that_ask_at_once_get_different_folders(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from bench.app.folders import make_folder, remove_unused\n"
        "for i in range(60):\n"
        "    folder = make_folder(Path('runs', 'same'))\n"
        "    if i % 2: remove_unused(folder)\n"
        "    else: (folder / 'mine').touch(exist_ok=False)\n"
    )
    running = [subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path, stderr=subprocess.PIPE) for _ in range(3)]
    for process in running:
        assert process.communicate()[1] == b""
    assert len(list((tmp_path / "runs").iterdir())) == len(list((tmp_path / "runs").glob("*/mine"))) == 90


def test_numbers_follow_the_first_name_and_leave_out_what_is_taken(tmp_path: Path) -> None:
    first = tmp_path / "runs" / "check"
    made = [make_folder(first, {tmp_path / "runs" / "check-3"}) for _ in range(3)]
    assert [path.name for path in made] == ["check", "check-2", "check-4"]
    (made[0] / "file").touch()
    for path in made:
        remove_unused(path)
    assert [path.name for path in first.parent.iterdir()] == ["check"]


def test_what_stands_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "runs").touch()
    with pytest.raises(InvalidInput, match="runs is a file; choose a folder"):
        make_folder(tmp_path / "runs" / "check")


def test_a_run_that_is_refused_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    def start(*_: object, **__: object) -> object:
        raise InvalidInput("drift", 0.1, "below the limit")

    assert main_with(start, ["run", "laser-calibration", "--yes"]) == 2  # pyright: ignore[reportArgumentType]
    assert list(tmp_path.iterdir()) == []
