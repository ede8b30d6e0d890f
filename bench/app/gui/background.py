"""Background work: functions in a thread or in the reading process, and commands in a separate process."""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from threading import Lock, Thread
from time import monotonic
from typing import IO
from weakref import WeakSet

from PySide6.QtCore import QBuffer, QObject, QTimer, Signal
from PySide6.QtGui import QImageReader

from bench.app.reading_process import ReadingProcess
from sim.errors import RockbenchError

LOOK = 100
"""Interval between checks of a process [ms]."""
BELOW_NORMAL = 0x4000
"""BELOW_NORMAL_PRIORITY_CLASS (Windows)."""
ENDING = 0.2
"""Longest wait for the threads of the readers when the program ends [s]."""

_files = ReadingProcess()
_threads = WeakSet[Thread]()


def png_reader(data: QBuffer) -> QImageReader:
    """Reader of a PNG picture that may be used in a thread.

    To find out the format, Qt asks the SVG plug-in, which connects signals. The thread then waits for Qt's lock of
    connections while it holds Python's, and the program stops for ever if the main thread, which deletes a widget,
    holds the former and waits for the latter.
    """
    reader = QImageReader(data, b"png")  # pyright: ignore[reportArgumentType]
    reader.setAutoDetectImageFormat(False)
    return reader


class _Answers(QObject):
    """Emits from the thread. It belongs to no window: the thread keeps it while it may still emit."""

    done = Signal(int, object)


class Reader(QObject):
    """Calls functions in a thread, one at a time; `found` emits the result of the last call only, in the window's
    thread. The functions must not use widgets, which the slots of `found` may update.
    """

    found = Signal(object)
    """Emits the value that the function returned, or the error that it raised. Errors other than RockbenchError and
    OSError are raised in the window's thread as well.
    """

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._answers = _Answers()
        self._latest = self._told = 0
        self._lock = Lock()
        self._waiting: tuple[int, Callable[[], object]] | None = None
        self._busy = False
        self._answers.done.connect(self._tell)

    @property
    def busy(self) -> bool:
        """Whether the result of the last call has not been emitted yet."""
        return self._told < self._latest

    def call(self, function: Callable[[], object]) -> None:
        """Schedule a call of `function`; earlier calls that have not started are dropped."""
        self._latest += 1
        with self._lock:
            self._waiting = (self._latest, function)
            if self._busy:
                return
            self._busy = True
        # no QThreadPool: its deletion waits for its threads, indefinitely if the window's thread holds Python's GIL
        thread = Thread(target=self._work, daemon=True)
        _threads.add(thread)
        thread.start()

    def drop(self) -> None:
        """Drop all earlier calls: their results are not emitted."""
        self._latest += 1
        self._told = self._latest
        with self._lock:
            self._waiting = None

    def _work(self) -> None:
        while True:
            with self._lock:
                if self._waiting is None:
                    self._busy = False
                    return
                number, function = self._waiting
                self._waiting = None
            try:
                answer: object = function()
            except Exception as error:
                # reported by the window's thread, like every error
                answer = error
            # the application may have ended
            with suppress(RuntimeError):
                self._answers.done.emit(number, answer)

    def _tell(self, number: int, answer: object) -> None:
        if number == self._latest:
            self._told = number
            self.found.emit(answer)
        if isinstance(answer, Exception) and not isinstance(answer, RockbenchError | OSError):
            raise answer


class FileReader(Reader):
    """A `Reader` that calls its functions in the reading process, which all share: for HDF5, which stops every thread
    of its process while a disk stalls. Functions and results are pickled.
    """

    def call(self, function: Callable[[], object]) -> None:
        """Schedule a call as `Reader.call` does."""
        super().call(partial(_files.call, function))


def start_reading() -> None:
    """Start the reading process, which files will soon need."""
    _files.start()


def end_reading() -> bool:
    """End the reading process; returns whether all threads of readers have ended. The disk may block one: it would
    also block a normal end of this process, in which HDF5 closes its files.
    """
    _files.end()
    end = monotonic() + ENDING
    for thread in list(_threads):
        thread.join(max(0.0, end - monotonic()))
    return not any(thread.is_alive() for thread in _threads)


class Command(QObject):
    """A `rockbench` command in a separate process at low priority, which continues when the window closes."""

    over = Signal(int, str)
    """Emits exit code and output."""

    def __init__(self, arguments: Sequence[str], parent: QObject) -> None:
        super().__init__(parent)
        self._written: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        nice = shutil.which("nice") if sys.platform != "win32" else None
        self._process = subprocess.Popen(
            [*([nice, "-n", "10"] if nice else []), sys.executable, "-P", "-m", "bench", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=self._written,
            stderr=subprocess.STDOUT,
            creationflags=BELOW_NORMAL if sys.platform == "win32" else 0,
            start_new_session=sys.platform != "win32",
        )
        self._timer = QTimer(self, interval=LOOK)
        self._timer.timeout.connect(self._look)
        self._timer.start()

    def _look(self) -> None:
        code = self._process.poll()
        if code is not None:
            self._timer.stop()
            self._written.seek(0)
            text = self._written.read().decode(errors="replace").strip()
            self._written.close()
            self.over.emit(code, text)
