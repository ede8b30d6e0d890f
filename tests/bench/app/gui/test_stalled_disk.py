"""A disk that stalls delays neither the window, nor its run, nor the end of the program."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.gui import background, file_opener
from bench.app.gui.window import Window
from bench.app.reading_process import ReadingProcess
from sim.errors import RockbenchError
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.gui.run_files import made, point, settle, show
from tests.bench.app.ipc.experiment import order
from tests.patience import LONG, LONG_MS
from tests.read_functions import mistaken, refused, stalled

pytestmark = pytest.mark.skipif(os.name != "posix", reason="a file that stalls is made with a FIFO")


@dataclass(frozen=True)
class Stall:
    """A file that stalls until `rescue` writes to it, since a test that stalls could not fail."""

    path: Path
    rescue: subprocess.Popen[bytes]

    @property
    def lasts(self) -> bool:
        return self.rescue.poll() is None


@pytest.fixture
def stall(tmp_path: Path) -> Generator[Stall]:
    path = tmp_path / "stalled.h5"
    os.mkfifo(path)
    with subprocess.Popen(["sh", "-c", 'sleep 40; echo > "$0"', str(path)], start_new_session=True) as rescue:
        yield Stall(path, rescue)
        with suppress(ProcessLookupError):
            os.killpg(rescue.pid, signal.SIGKILL)


@pytest.fixture
def files(monkeypatch: pytest.MonkeyPatch) -> Generator[ReadingProcess]:
    """A reading process of this test, which ends with it."""
    own = ReadingProcess()
    monkeypatch.setattr(background, "_files", own)
    yield own
    own.end()


@pytest.mark.usefixtures("without_live_plots", "files")
def test_the_main_loop_goes_on_while_a_typed_path_stalls(
    window: Window, qtbot: QtBot, spoken: type[ScriptedClient], stall: Stall, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = window.results
    window.pages.setCurrentWidget(page)
    page.show_run()
    show(page, made(stall.path.parent / "open", point(16.0, 0.2)))
    monkeypatch.setattr(file_opener, "read_path", stalled)
    page.path.setText(str(stall.path))
    page.path.returnPressed.emit()
    assert page.reading.text() == texts.OPENING.format(path=stall.path)
    window._controller.start(order(Path("never")))
    # the run is told that its window responds
    qtbot.waitUntil(lambda: spoken.latest.beats >= 3, timeout=LONG_MS)
    assert stall.lasts
    assert page.opener.current == stall.path
    assert page.reading.isVisible()
    window.header.stop.click()
    assert spoken.latest.asked == ["abort"]
    # HDF5 may close it before anything is written
    with suppress(BrokenPipeError):
        stall.path.write_bytes(b"no HDF5")
    qtbot.waitUntil(lambda: page.opener.current is None, timeout=LONG_MS)
    assert page.reading.isHidden()
    assert "Unable to" in page.message.text()
    assert [file.name for file in page.files.ticked] == ["open"]


@pytest.mark.usefixtures("without_live_plots", "spoken")
def test_typed_paths_are_opened_during_a_run_too(window: Window, tmp_path: Path) -> None:
    page = window.results
    first, second = (made(tmp_path / name, point(16.0, 0.2)) for name in ("monday", "tuesday"))
    show(page, first)
    window._controller.start(order(tmp_path / "next"))
    # an open file is read again
    for path in (second, first):
        page.path.setText(str(path))
        page.path.returnPressed.emit()
        settle(page)
    assert {file.name for file in page.files.ticked} == {"monday", "tuesday"}


def test_a_process_that_a_file_has_ended_is_replaced(files: ReadingProcess, tmp_path: Path) -> None:
    with pytest.raises(RockbenchError, match="has ended"):
        files.call(partial(os._exit, 3))
    assert files.call(tmp_path.exists) is True


def test_errors_have_their_kind_and_message(files: ReadingProcess, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as missing:
        files.call((tmp_path / "none").stat)
    assert missing.value.filename == str(tmp_path / "none")
    with pytest.raises(RockbenchError, match="colour = 'red' is refused: blue") as refusal:
        files.call(refused)
    assert type(refusal.value) is RockbenchError
    with pytest.raises(RuntimeError, match="ZeroDivisionError: ours") as mistake:
        files.call(mistaken)
    assert "in mistaken" in "".join(mistake.value.__notes__)


PROGRAM = """
import io, sys, threading, time
from functools import partial
from pathlib import Path
import h5py
from PySide6.QtCore import QTimer
from bench.app.cli import window as command
from bench.app.gui import background, window
from tests.read_functions import stalled

class Stalled(io.RawIOBase):
    def readable(self): return True
    def seekable(self): return True
    def seek(self, place, whence=0): return 4096 if whence == 2 else place
    def readinto(self, into):
        time.sleep(1e3)

attend = window.attend

def begin(shown, controller, application):
    def close():
        print(time.monotonic(), flush=True)
        shown.close()
        application.quit()
    # within HDF5, in the reading process and in a thread of this one
    for reader, read in ((background.FileReader(shown), partial(stalled, Path(sys.argv[1]))),
                         (background.Reader(shown), lambda: h5py.File(Stalled(), "r"))):
        reader.call(read)
    QTimer.singleShot(600, close)
    return attend(shown, controller, application)

window.attend = begin
sys.exit(command.gui())
"""


@pytest.mark.seconds
def test_the_program_ends_when_its_window_is_closed_while_the_disk_stalls(stall: Stall, tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(stall.path)],
        cwd=Path(__file__).parents[4],
        env=os.environ | {"XDG_CONFIG_HOME": str(tmp_path), "QT_QPA_PLATFORM": "offscreen"},
        stdout=subprocess.PIPE,
        text=True,
    ) as program:
        try:
            assert program.stdout is not None
            closed = float(program.stdout.readline())
            assert program.wait(LONG) == 0
            assert time.monotonic() - closed <= 2.0
            assert stall.lasts
        finally:
            program.kill()
