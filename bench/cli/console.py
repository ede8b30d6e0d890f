"""Shows a run on the terminal while it goes on."""

import threading
from collections import deque
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TextIO

from bench.cli.plain import LogLines, PlainLines
from bench.cli.scene import Notice, Scene
from bench.events import Acquired, Event, OperatorAsked

if TYPE_CHECKING:
    from rich.console import Console
    from rich.live import Live

    from bench.protocol import Protocol

REDRAW_INTERVAL = 0.125
"""Shortest time between two drawings [s]."""


class LiveConsole:
    """A subscriber that keeps a picture of the run on a terminal; a context manager that leaves the terminal as it was.

    Events only change the picture in memory. A thread of its own draws it, when something has changed, so that the
    engine never waits for a terminal. When a `person_answers` the questions, the picture goes away while one stands.
    """

    def __init__(self, console: "Console", person_answers: bool = False) -> None:
        self._console = console
        self._person_answers = person_answers
        self._scene = Scene()
        self._grave: deque[Notice] = deque()
        self._lock = threading.Lock()
        self._changed = threading.Event()
        self._closing = threading.Event()
        self._live: Live | None = None
        self._painter = threading.Thread(target=self._paint, name="console", daemon=True)

    def __enter__(self) -> Self:
        self._show()
        self._painter.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing.set()
        self._changed.set()
        try:
            self._painter.join()
            self._print_grave()
        finally:
            self._hide()

    def prepare(self, phase: str, done: int = 0, total: int = 0, /) -> None:
        """A `bench.progress.Progress` for what is done before the rig is opened and after it is closed."""
        with self._lock:
            self._scene.prepare(phase, done, total)
        if self._live is None:
            self._show()
        self._changed.set()

    def __call__(self, event: Event) -> None:
        if isinstance(event, Acquired):
            return
        with self._lock:
            notice = self._scene.update(event)
        if notice is not None and notice.grave:
            self._grave.append(notice)
        if self._person_answers and isinstance(event, OperatorAsked):
            self._hide()
            return
        if self._live is None:
            self._show()
        self._changed.set()

    def _paint(self) -> None:
        while self._changed.wait() and not self._closing.is_set():
            self._changed.clear()
            self._draw()
            self._closing.wait(REDRAW_INTERVAL)

    def _draw(self) -> None:
        from bench.cli.rendering import draw

        live = self._live
        if live is None:
            return
        self._print_grave()
        with self._lock:
            picture = draw(self._scene, *self._console.size)
        live.update(picture, refresh=True)

    def _print_grave(self) -> None:
        """Print what the operator should still find on the terminal when the picture has gone."""
        from bench.cli.rendering import log_line

        while self._grave:
            self._console.print(log_line(self._grave.popleft()))

    def _show(self) -> None:
        from rich.live import Live

        # a new one each time: a stopped Live would move the cursor up over what was printed since
        self._live = Live(console=self._console, auto_refresh=False, transient=True, redirect_stdout=False)
        self._live.start()

    def _hide(self) -> None:
        live, self._live = self._live, None
        if live is not None:
            live.stop()


def progress_on(
    stream: TextIO, person_answers: bool, protocol: "Protocol[Any] | None" = None
) -> LiveConsole | PlainLines | LogLines:
    """A log of a `protocol` that has lines for one; else the live picture where `stream` is a terminal that can redraw,
    plain lines elsewhere.
    """
    if protocol is not None and protocol.log_line is not None:
        return LogLines(stream, protocol)
    if stream.isatty():
        from rich.console import Console

        console = Console(file=stream)
        if console.is_terminal and not console.is_dumb_terminal:
            return LiveConsole(console, person_answers)
    return PlainLines(stream)
