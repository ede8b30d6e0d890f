"""Shows on standard error what a command is doing: a bar on a terminal, else one line for each phase."""

import sys
from collections.abc import Callable
from inspect import Parameter as Argument
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Any, Self, TextIO, cast

from cyclopts import Parameter

from bench.cli.words import one_line
from bench.progress import Progress, silent

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

Handed = Annotated[Progress, Parameter(parse=False)]
"""The argument of a command by which `main` hands it what shows its progress."""

HANDED = Argument("progress", Argument.KEYWORD_ONLY, default=silent, annotation=Handed)
"""The same where a signature is put together."""


class PhaseLines:
    """Writes a line when a phase begins: for a log file or a pipe, without control characters."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._phase = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pass

    def __call__(self, phase: str, done: int = 0, total: int = 0, /) -> None:  # noqa: ARG002 - a line for each phase
        if phase != self._phase:
            self._phase = phase
            print(f"rockbench: {one_line(phase)}", file=self._stream, flush=True)


class PhaseBar:
    """Draws phase, bar and expected end on a terminal, where they give way to every other text.

    A context manager: within, standard output and error are what hides the bar before it writes.
    """

    def __init__(self, console: "Console") -> None:
        self._console = console
        self._bar: Bar | None = None
        self._task: TaskID | None = None
        self._phase = ""
        self._streams: tuple[TextIO, TextIO] = sys.stdout, sys.stderr

    def __enter__(self) -> Self:
        self._streams = sys.stdout, sys.stderr
        sys.stdout, sys.stderr = (cast(TextIO, _GivesWay(stream, self.hide)) for stream in self._streams)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.hide()
        sys.stdout, sys.stderr = self._streams

    def __call__(self, phase: str, done: int = 0, total: int = 0, /) -> None:
        if self._bar is None:
            self._bar = self._started()
        if self._task is None or phase != self._phase:
            if self._task is not None:
                self._bar.remove_task(self._task)
            self._phase, self._task = phase, self._bar.add_task(one_line(phase), total=total or None)
        self._bar.update(self._task, completed=done, total=total or None)

    def hide(self) -> None:
        """Leave the terminal as it was; the next phase draws again."""
        bar, self._bar, self._task = self._bar, None, None
        if bar is not None:
            bar.stop()

    def _started(self) -> "Bar":
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

        columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn())
        # its own redirection would wrap long lines
        bar = Progress(
            *columns,
            TimeRemainingColumn(),
            console=self._console,
            transient=True,
            redirect_stdout=False,
            redirect_stderr=False,
        )
        bar.start()
        return bar


class _GivesWay:
    """A stream before whose first text `hide` is called."""

    def __init__(self, stream: TextIO, hide: Callable[[], None]) -> None:
        self._stream, self._hide = stream, hide

    def write(self, text: str) -> int:
        self._hide()
        return self._stream.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def phases_on(stream: TextIO) -> PhaseBar | PhaseLines:
    """A bar where `stream` is a terminal that can redraw, lines elsewhere."""
    if stream.isatty():
        from rich.console import Console

        console = Console(file=stream)
        if console.is_terminal and not console.is_dumb_terminal:
            return PhaseBar(console)
    return PhaseLines(stream)
