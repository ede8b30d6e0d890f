"""A console with the code page of western Windows (cp1252), which has no α, ✓ or β: no command fails for it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

COMMANDS = ("predict steady --omega 16 --beta 0.4", "file info FILE", "config check", "doctor", "predict steady --help")


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
    page: str, command: str, recorded: Path, tmp_path: Path
) -> None:
    line = [str(recorded) if word == "FILE" else word for word in command.split()]
    # strict, as a console of Windows
    environment = os.environ | {"PYTHONIOENCODING": f"{page}:strict", "PYTHONUTF8": "0", "COLUMNS": "200"}
    done = subprocess.run(
        [sys.executable, "-m", "bench", *line], env=environment, cwd=tmp_path, capture_output=True, timeout=120.0
    )
    said, errors = done.stdout.decode(page), done.stderr.decode(page)
    assert "Traceback" not in errors
    assert "UnicodeEncodeError" not in errors + said
    assert done.returncode in (0, 2), errors
    assert said or done.returncode == 2
    if "FILE" in command:
        # cp437 lacks the check mark only
        assert {"cp1252": "? ± ?", "cp437": "α ± ?"}[page] in said
