"""Hostile data files are refused, or evaluated as far as they can be: soon, in little memory, without a traceback."""

import resource
import time
from pathlib import Path

import pytest

from bench.app.cli.main import main
from tests.bench.datafile.hostile import INSTEAD, Kind, additions, kinds
from tests.installed import example
from tests.undrawn import undrawn

SOON = 2.0
"""Longest time of a command [s]; the machine of the tests may be busy, so it counts processor time."""
MEMORY = 200_000
"""Largest growth of the memory [kB]."""
pytestmark = pytest.mark.seconds
COMMANDS = ("file info", "file verify", "file recover", "export", "report", "replay", "analyse")
KINDS = kinds()
ADDED = len([*additions()])
SOME = KINDS[:4] + KINDS[4:ADDED:3] + KINDS[ADDED::35]
"""A third of the additions, and 26 replacements. Their step is prime to the number of objects and to that of what
replaces them: nearly every replacement occurs."""


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a short run of the example protocol, with every command loaded."""
    folder = tmp_path_factory.mktemp("hostile")
    with example(folder / "site", "tone_sweep"):
        out = folder / "run"
        with undrawn():
            assert main(["run", "tone-sweep", "--omega", "40", "--cycles", "4", "--out", str(out), "--json"]) == 0
        for number, command in enumerate(COMMANDS):
            assert main(_line(command, out / "campaign.h5", folder / f"sound {number}")) == 0
        yield out / "campaign.h5"


def _line(command: str, path: Path, out: Path) -> list[str]:
    more = {
        "file recover": ["--out", f"{out}.h5"],
        "export": ["--to", "csv", "--out", str(out)],
        "report": ["--html", f"{out}.html"],
        "analyse": ["--out", f"{out}.analysis.h5"],
    }
    as_json = [] if command in ("export", "report", "file recover") else ["--json"]
    return [*command.split(), str(path), *more.get(command, ()), *as_json]


def _check(kind: Kind, command: str, sound: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "hostile.h5"
    if not path.exists():
        kind.make(sound, path)
    capsys.readouterr()
    begun, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    code = main(_line(command, path, folder / f"out {command}"))
    spent, after = time.process_time() - begun, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    said = capsys.readouterr()
    assert code in (0, 1, 2)
    assert "Traceback" not in said.err
    assert "\x1b" not in said.err + said.out
    if code:
        assert "rockbench: " in said.err
    assert spent < SOON, command
    assert after - before < MEMORY, command


def test_there_are_at_least_500_kinds() -> None:
    assert len({kind.name for kind in KINDS}) >= 500
    assert len(SOME) >= 50
    replacements = [kind.name.partition(": ")[2] for kind in SOME[-(len(KINDS) - ADDED) // 35 :]]
    assert len(set(replacements)) >= 0.9 * len(INSTEAD)


@pytest.mark.parametrize("number", range(len(SOME)), ids=lambda number: SOME[number].name)
def test_a_hostile_file_is_refused_soon(
    number: int, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # one command each, in turn; the soak gives every file to every command
    _check(SOME[number], COMMANDS[number % len(COMMANDS)], sound, tmp_path, capsys)


@pytest.mark.soak
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_every_hostile_file_is_refused_by_every_command(
    kind: Kind, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in COMMANDS:
        _check(kind, command, sound, tmp_path, capsys)
