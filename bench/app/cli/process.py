"""The process of the command `rockbench`: its signals, its streams, its progress display and its exit code."""

import gc
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any, Self, TextIO, cast

from bench.app.formatting import one_line

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

YOUNG = 50_000
"""Number of new objects after which Python searches for unreachable ones; a search takes a few milliseconds."""


def run() -> None:
    """Entry point of the console script."""
    # everything else is imported after the signal handlers are installed, because the imports take a third of a second
    signal.signal(signal.SIGINT, _at_once)
    # read when numpy is imported: BLAS threads busy-wait for longer than these small matrices take, and the last digits
    # of a product would depend on the number of threads
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # the imports create some 250 000 lasting objects, through which the collector would search hundreds of times
    gc.set_threshold(YOUNG, *gc.get_threshold()[1:])
    from bench.app.cli.interrupt import Interrupts, handle_signals, leave, report_interrupt

    interrupts = Interrupts()
    try:
        handle_signals(interrupts)
        code = _carry_out()
    except KeyboardInterrupt:
        report_interrupt()
        code = 130
    except BaseException:
        if interrupts.first is None:
            raise
        # a library has converted the interrupt into an error of its own
        report_interrupt()
        code = 130
    if interrupts.exit_code is not None or code == 130:
        # a normal exit would wait for threads that are still computing
        leave(interrupts.exit_code or code if code == 130 else code)
    # otherwise Python searches all objects for unreachable ones at its end, which takes up to a third of a second
    gc.freeze()
    sys.exit(code)


def _at_once(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
    os.write(2, b"rockbench: error: interrupted\n")
    os._exit(130)


def _carry_out() -> int:
    from io import TextIOWrapper

    from bench.app.cli.main import main
    from bench.app.cli.output import report_error
    from bench.app.cli.streams import lasting

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            # the console shows a substitute for a character that it lacks, and the run continues
            stream.reconfigure(errors="replace")
    sys.stderr = lasting(sys.stderr)
    try:
        with phases_on(sys.stderr) as progress:
            code = main(progress=progress)
        sys.stdout.flush()
    except BrokenPipeError:
        # the reader, such as `head`, has closed the pipe; buffered output is discarded at exit too
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 1
    except OSError as error:
        # for example, standard output is a file on a full disk
        with suppress(OSError):
            report_error(error, "system")
        code = 1
    return code


class PhaseLines:
    """Writes one line per phase, without control characters, for log files and pipes."""

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
    """Draws phase, bar and remaining time on a terminal; the bar is hidden while other text is written.

    A context manager, which replaces standard output and error by streams that hide the bar before they write.
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
        """Erase the bar until the next phase."""
        bar, self._bar, self._task = self._bar, None, None
        if bar is not None:
            bar.stop()

    def _started(self) -> "Bar":
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

        columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn())
        # the redirection by rich would wrap long lines
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
    """A stream that calls `hide` before each text."""

    def __init__(self, stream: TextIO, hide: Callable[[], None]) -> None:
        self._stream, self._hide = stream, hide

    def write(self, text: str) -> int:
        self._hide()
        return self._stream.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def phases_on(stream: TextIO) -> PhaseBar | PhaseLines:
    """A `PhaseBar` if `stream` is a terminal that can redraw, else `PhaseLines`."""
    if stream.isatty():
        from rich.console import Console

        console = Console(file=stream)
        if console.is_terminal and not console.is_dumb_terminal:
            return PhaseBar(console)
    return PhaseLines(stream)
