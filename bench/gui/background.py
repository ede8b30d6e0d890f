"""Work that takes a while, done beside the window: in a thread, or as a command in a process of its own."""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import IO

from PySide6.QtCore import QObject, QThreadPool, QTimer, Signal

from sim.errors import RockbenchError

LOOK = 100
"""Between two looks at a process [ms]."""
BELOW_NORMAL = 0x4000
"""BELOW_NORMAL_PRIORITY_CLASS of Windows."""


class Reader(QObject):
    """Calls one function after another in a thread; only the answer to the last call is given, in the window's thread.

    A thread only computes: whatever is drawn is drawn by who hears `found`.
    """

    found = Signal(object)
    """What the function returned, or the RockbenchError or OSError that it raised. Another error is the program's own:
    it is raised in the window's thread, and `found` is given it too, so that nobody waits for ever.
    """
    _done = Signal(int, object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._pool = QThreadPool(self)
        self._pool.setMaxThreadCount(1)
        self._latest = 0
        self._done.connect(self._tell)

    def call(self, function: Callable[[], object]) -> None:
        """Have `function` called; calls that still wait are given up."""
        self._latest += 1
        number = self._latest
        self._pool.clear()

        def work() -> None:
            try:
                answer: object = function()
            except Exception as error:
                # told by the window's thread, as every error is
                answer = error
            # the window may be gone by now
            with suppress(RuntimeError):
                self._done.emit(number, answer)

        self._pool.start(work)

    def _tell(self, number: int, answer: object) -> None:
        if number == self._latest:
            self.found.emit(answer)
        if isinstance(answer, Exception) and not isinstance(answer, RockbenchError | OSError):
            raise answer


class Command(QObject):
    """A command of `rockbench` in a process of its own, with less priority than a run; closing the window does not end
    it.
    """

    over = Signal(int, str)
    """Its exit code, and what it wrote."""

    def __init__(self, arguments: Sequence[str], parent: QObject) -> None:
        super().__init__(parent)
        self._written: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        nice = shutil.which("nice") if sys.platform != "win32" else None
        self._process = subprocess.Popen(
            [*([nice, "-n", "10"] if nice else []), sys.executable, "-m", "bench", *arguments],
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
