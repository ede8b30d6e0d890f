"""`rockbench gui` where no window can be shown: one line and exit code 2, in a process as a person starts it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("PySide6", reason="the extra gui is not installed")
pytestmark = pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="a display there is always")

GUI = "import sys; from bench.app.cli.main import main; sys.exit(main(['gui']))"
WITHOUT_LIBRARY = """
import builtins, sys
if not sys.argv[1:]:
    import bench.app.cli.window as window
    window.PROBE = "import sys; sys.argv.append('probe'); exec(open(%r).read())" % __file__
    from bench.app.cli.main import main
    sys.exit(main(['gui']))
raise ImportError("libEGL.so.1: cannot open shared object file: No such file or directory")
"""


def gui(folder: Path, *command: str, **variables: str) -> tuple[int, str]:
    unset = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    environment = {name: value for name, value in os.environ.items() if name not in unset} | variables
    done = subprocess.run(
        [sys.executable, *(command or ("-c", GUI))], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert done.stdout == ""
    assert list(folder.glob("runs")) == []
    return done.returncode, done.stderr


def test_without_a_display_the_variables_are_named(tmp_path: Path) -> None:
    code, line = gui(tmp_path)
    assert code == 2
    assert "neither DISPLAY nor WAYLAND_DISPLAY is set" in line
    assert "ssh -X" in line
    assert "rockbench run" in line


@pytest.mark.parametrize(
    ("name", "value"), [("DISPLAY", ":4711"), ("WAYLAND_DISPLAY", "nobody"), ("QT_QPA_PLATFORM", "nonsense")]
)
def test_a_display_that_cannot_be_used_is_named_or_the_library_that_it_lacks(
    tmp_path: Path, name: str, value: str
) -> None:
    code, line = gui(tmp_path, **{name: value})
    assert code == 2
    lacks = name != "QT_QPA_PLATFORM" and "is missing; install" in line
    assert lacks or f"Qt cannot use {name} = '{value}'" in line


def test_a_missing_library_is_named_with_its_package(tmp_path: Path) -> None:
    script = tmp_path / "gui.py"
    script.write_text(WITHOUT_LIBRARY)
    code, line = gui(tmp_path, str(script), DISPLAY=":4711", PYTHONPATH=os.getcwd())
    assert code == 2
    assert "the library libEGL.so.1 is missing" in line
    assert "apt install libegl1" in line
