"""The program as a person starts it, in a real window, with real keys; and killed in the middle of a run."""

import os
import subprocess
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from bench.app.display import texts
from bench.datafile.hdf5_reading import DataFileError
from bench.datafile.inspection import verify
from bench.datafile.reader import open_datafile
from sim.errors import InvalidInput
from tests.bench.app.gui.virtual_screen import NEEDED, Screen, missing, until, virtual_screen

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="a virtual X server is a POSIX thing"),
    pytest.mark.skipif(bool(missing()), reason=f"needs {' and '.join(NEEDED)}; missing here: {missing()}"),
]


@pytest.fixture
def screen(tmp_path: Path) -> Generator[Screen, None, None]:
    (tmp_path / "screen").mkdir()
    with virtual_screen(tmp_path / "screen") as shown:
        yield shown


@contextmanager
def started(screen: Screen, folder: Path, *program: str) -> Generator[subprocess.Popen[bytes], None, None]:
    """A Python program with the window, in `folder`, in front."""
    path = os.pathsep.join(filter(None, (str(Path(__file__).parents[4]), os.environ.get("PYTHONPATH"))))
    settings = {"XDG_CONFIG_HOME": str(folder / "settings"), "PYTHONPATH": path}
    with subprocess.Popen(
        [sys.executable, "-m", *program], cwd=folder, env={**screen.environment, **settings}
    ) as window:
        try:
            screen.focus(texts.TITLE, lambda: window.poll() is not None)
            yield window
        finally:
            window.kill()


def _driven(folder: Path) -> bool:
    """Whether a run has begun to move the table."""
    for path in folder.glob("runs/*/campaign.h5"):
        try:
            with open_datafile(path) as record:
                return record.rows > 0 and float(np.abs(record.drive()).max()) > 0.01
        except (InvalidInput, DataFileError, OSError):
            return False
    return False


def _status(folder: Path) -> tuple[str, str]:
    with open_datafile(next(folder.glob("runs/*/campaign.h5"))) as record:
        return record.status, record.summary


def _start(folder: Path, screen: Screen) -> None:
    """Check the plan and start it, by keys, and wait until the table is driven."""
    screen.press("ctrl+2")
    screen.press("ctrl+k")

    def begun() -> bool:
        # refused until the plan was checked
        screen.press("ctrl+Return")
        if any(folder.glob("runs/*/campaign.h5")):
            # a page that is not drawn anew 35 times per second
            screen.press("ctrl+1")
        return _driven(folder)

    until(begun, "no run drove the table")


def _ended(folder: Path) -> tuple[str, str]:
    """How the run ended; its file is whole and the drive ends at zero."""
    until(lambda: _status(folder)[0] != "running", "the run did not end")
    path = next(folder.glob("runs/*/campaign.h5"))
    until(lambda: verify(path).problems == (), "the file is not whole")
    with open_datafile(path) as record:
        assert record.drive()[-1] == 0.0
        assert record.end_time
    return _status(folder)


def test_the_key_of_stop_aborts_the_tour(screen: Screen, tmp_path: Path) -> None:
    with started(screen, tmp_path, "bench", "gui") as window:
        screen.press("ctrl+2")
        screen.press("alt+r")  # in real time, so that it lasts
        _start(tmp_path, screen)
        picture = screen.picture()
        colours = picture.reshape(-1, 3) @ np.array([1, 256, 65536])
        assert len(np.unique(colours)) > 50, "the window is blank"
        red = (picture[:, :, 0] > 150) & (picture[:, :, 1:].max(axis=2) < 30)
        assert red.sum() > 5000, "STOP is not seen"
        screen.press("F12")
        status, why = _ended(tmp_path)
        assert window.poll() is None
    assert status == "aborted"
    assert why.startswith("abort requested")


def test_a_run_whose_window_is_killed_ramps_out(screen: Screen, tmp_path: Path) -> None:
    with started(screen, tmp_path, "tests.bench.app.gui.lone_window") as window:
        screen.press("ctrl+2")
        screen.press("alt+r")  # in real time, so that it lasts longer than the silence of its window is tolerated
        _start(tmp_path, screen)
        window.kill()
        status, why = _ended(tmp_path)
    assert status == "stopped"
    assert "client has disconnected" in why
