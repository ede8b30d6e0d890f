"""Folders for results: runs that begin in the same second get one each, and a refused run leaves none."""

import subprocess
import sys
from pathlib import Path

import pytest

from bench.app.folders import make_folder, remove_unused
from sim.errors import InvalidInput
from tests.command_line import main_with

SAME_SECOND = """
import sys, time
from datetime import datetime
from pathlib import Path
import bench.app.folders as output
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

print("ready", flush=True)
sys.stdin.readline()
bench.app.session.run_session = start
sys.exit(main(["run", "harmonic", "--omega", "16", "--yes", *sys.argv[2:]]))
"""
"""A run with a clock that stands still and without its bench: what is left is the command and the folder."""


def together(folder: Path, *arguments: str) -> list[tuple[int, str]]:
    """Two runs let go at the same moment; the code and standard error of each."""
    running = [
        subprocess.Popen(
            [sys.executable, "-c", SAME_SECOND, name, *arguments],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for name in ("first", "second")
    ]
    for process in running:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    for process in running:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    ended = [process.communicate()[1] for process in running]
    return [(process.returncode, errors) for process, errors in zip(running, ended, strict=True)]


def test_two_runs_in_the_same_second_have_a_folder_each(tmp_path: Path) -> None:
    assert [code for code, _ in together(tmp_path)] == [0, 0]
    name = "harmonic-2026-01-02T03-04-05"
    folders = sorted(path.name for path in (tmp_path / "runs").iterdir())
    assert folders == [name, f"{name}-2"]
    assert {(tmp_path / "runs" / folder / "campaign.h5").read_text() for folder in folders} == {"first", "second"}


def test_a_folder_that_was_named_is_never_exchanged_for_another(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "campaign.h5").write_text("older")
    for code, errors in together(tmp_path, "--out", "mine"):
        assert code == 2
        assert "it already contains campaign.h5" in errors
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine"]
    assert (tmp_path / "mine" / "campaign.h5").read_text() == "older"


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

    assert main_with(start, ["run", "harmonic", "--omega", "16", "--yes"]) == 2  # pyright: ignore[reportArgumentType]
    assert list(tmp_path.iterdir()) == []
