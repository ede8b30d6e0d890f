"""The run display on a terminal. No state is shown by colour alone: a word also names it."""

import threading
from collections import deque
from types import TracebackType
from typing import Self

from rich import box
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from bench.app.formatting import ABSENT, clock
from bench.app.run_display import NOTICES, Notice, RunDisplay
from bench.events import Acquired, Event, OperatorAsked, State
from sim import waiting

REDRAW_INTERVAL = 0.125
"""Minimum interval between redraws [s]."""


class LiveConsole:
    """A subscriber that displays the run on a terminal, and a context manager that removes the display on exit.

    Events only update the display in memory. A separate thread redraws it after a change, so that the engine never
    waits for a terminal. With `person_answers`, the display is hidden while a question to the operator is open.
    """

    def __init__(self, console: Console, person_answers: bool = False) -> None:
        self._console = console
        self._person_answers = person_answers
        self._scene = RunDisplay()
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
            waiting.join(self._painter)
            self._print_grave()
        finally:
            self._hide()

    def prepare(self, phase: str, done: int = 0, total: int = 0, /) -> None:
        """Callback (`bench.progress.Progress`) for the stages before the rig is opened and after it is closed."""
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
        live = self._live
        if live is None:
            return
        self._print_grave()
        with self._lock:
            picture = draw(self._scene, *self._console.size)
        live.update(picture, refresh=True)

    def _print_grave(self) -> None:
        """Print the notices that need the operator's attention; they remain on the terminal after the display has
        closed.
        """
        while self._grave:
            self._console.print(log_line(self._grave.popleft()))

    def _show(self) -> None:
        # a new Live each time: a restarted one would move the cursor over later output
        self._live = Live(console=self._console, auto_refresh=False, transient=True, redirect_stdout=False)
        self._live.start()

    def _hide(self) -> None:
        live, self._live = self._live, None
        if live is not None:
            live.stop()


_STATE_STYLES = {
    State.IDLE: "reverse",
    State.ARMED: "bold black on yellow",
    State.RUNNING: "bold white on green4",
    State.WAITING: "bold black on yellow",
    State.STOPPING: "bold white on blue",
    State.ABORTING: "bold white on red3",
    State.HALTED: "bold white on red3",
    State.CLOSED: "reverse",
}
_WORD_STYLES = {
    "steady": "green",
    "held": "green",
    "yes": "green",
    "NO": "bold red",
    "overturned": "bold red",
    "modulated": "yellow",
    "resting": "cyan",
    "measuring": "bold",
}
_WIDE = 100
_NUMBERS = ("omega\n[rad/s]", "beta", "alpha_2\n(k = 2)", "predicted", "off by")
_WORDS = ("agrees", "status", "measured over")
_AROUND_TABLE = 11 + NOTICES
"""Number of lines of the display other than the rows of the table and the live values."""


def draw(scene: RunDisplay, width: int, height: int) -> RenderableType:
    """Render the display for a terminal of `width` columns and `height` lines; the oldest points are omitted first."""
    hint = Text(
        "Ctrl-C ramps the output to zero and ends the run; a second Ctrl-C cuts the output at once.", style="dim"
    )
    hint.no_wrap, hint.overflow = True, "ellipsis"
    wide = width >= _WIDE
    texts = [*scene.live.values(), *([f"twin  {scene.twin}"] if scene.twin else [])]
    lines = [Text(text, no_wrap=True, overflow="ellipsis") for text in texts]
    room = height - _AROUND_TABLE - len(lines)
    return Group(_banner(scene), _points(scene, room, wide), _progress(scene, wide), *lines, _log(scene), hint)


def log_line(notice: Notice) -> Text:
    """One line of the log: time, kind and text."""
    return Text.assemble(
        (f"{clock(notice.time):>8}  ", "dim"),
        (f"{notice.kind:<8} ", "bold red" if notice.grave else "bold"),
        notice.text,
    )


def _banner(scene: RunDisplay) -> Text:
    banner = Text(no_wrap=True, overflow="ellipsis")
    banner.append(f" {scene.state.upper()} ", style=_STATE_STYLES[scene.state])
    at_work = scene.state in (State.ARMED, State.RUNNING) and scene.step
    banner.append(f"  {scene.step if at_work else scene.reason}", style="bold")
    return banner


def _points(scene: RunDisplay, room: int, wide: bool) -> Table:
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
    for heading in _NUMBERS:
        table.add_column(Text(heading), justify="right", no_wrap=True)
    for heading in _WORDS if wide else _WORDS[:-1]:
        table.add_column(Text(heading), no_wrap=True)
    rows = [*scene.rows, *([scene.running] if scene.running is not None else [])]
    shown = rows[-max(room, 3) :]
    for row in shown:
        words = [Text(word, style=_WORD_STYLES.get(word, "")) for word in (row.agrees, row.status)]
        effort = [row.effort] if wide else []
        table.add_row(row.omega, row.beta, row.alpha_2, row.predicted, row.difference, *words, *effort)
    if len(shown) < len(rows):
        table.title = f"earlier points not shown: {len(rows) - len(shown)}"
        table.title_justify = "left"
    return table


def _progress(scene: RunDisplay, wide: bool) -> Table:
    line = Table.grid(padding=(0, 2))
    left = "" if clock(scene.time_left) == ABSENT else f", about {clock(scene.time_left)} left"
    line.add_row(
        ProgressBar(total=1.0, completed=scene.fraction, width=30 if wide else 20),
        f"{100.0 * scene.fraction:3.0f} %",
        f"bench time {clock(scene.time)}{left}",
        *([Text(scene.activity, no_wrap=True, overflow="ellipsis")] if wide else []),
    )
    return line


def _log(scene: RunDisplay) -> Group:
    lines = [log_line(notice) for notice in scene.notices]
    for line in lines:
        line.no_wrap, line.overflow = True, "ellipsis"
    return Group(Text(""), *lines, Text(""))
