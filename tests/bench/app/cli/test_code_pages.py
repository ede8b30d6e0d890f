"""A console with the code page of western Windows (cp1252), which has no α, ✓ or β: no command fails for it."""

import os
import subprocess
import sys
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest

from bench.app.cli.process import _carry_out  # pyright: ignore[reportPrivateUsage]
from tests.patience import LONG

COMMANDS = (
    "predict steady --omega 16 --beta 0.4",
    "file info FILE",
    "config check",
    "doctor",
    "predict steady --help",
    "file info --help",
    "run harmonic --help",
)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from tests.bench.datafile.living import begin, hand_over

    path = tmp_path_factory.mktemp("recorded") / "α ± ✓.h5"
    recorder = begin(path)
    hand_over(recorder, 0)
    recorder.close("completed", "α ± ✓ done")
    return path


@pytest.mark.parametrize(("page", "command"), [*(("cp1252", each) for each in COMMANDS), ("cp437", COMMANDS[1])])
def test_a_console_without_the_character_shows_a_substitute(
    page: str, command: str, recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(
        sys, "argv", ["rockbench", *(str(recorded) if each == "FILE" else each for each in command.split())]
    )
    # strict, as a console of Windows
    streams = [TextIOWrapper(BytesIO(), encoding=page, errors="strict") for _ in range(2)]
    with monkeypatch.context() as console:
        console.setattr(sys, "stdout", streams[0])
        console.setattr(sys, "stderr", streams[1])
        code = _carry_out()
    for stream in streams:
        stream.flush()
    said, errors = (stream.buffer.getvalue().decode(page) for stream in streams)  # type: ignore[attr-defined]
    assert "Traceback" not in errors
    assert "UnicodeEncodeError" not in errors + said
    # the check of the computer ends with 1 where it finds a fault
    assert code in ((0, 1) if command == "doctor" else (0, 2)), errors
    assert said or code == 2
    if "FILE" in command:
        # cp437 lacks the check mark only
        assert {"cp1252": "? ± ?", "cp437": "α ± ?"}[page] in said


def test_a_process_with_such_a_console_shows_a_substitute(recorded: Path, tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONIOENCODING": "cp1252:strict", "PYTHONUTF8": "0", "COLUMNS": "200"}
    line = [sys.executable, "-m", "bench", "file", "info", str(recorded)]
    done = subprocess.run(line, env=environment, cwd=tmp_path, capture_output=True, timeout=LONG)
    assert done.returncode == 0, done.stderr
    assert b"UnicodeEncodeError" not in done.stderr
    assert "? ± ?" in done.stdout.decode("cp1252")
