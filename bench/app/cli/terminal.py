"""A run on the terminal: its log as plain lines, without control characters, and the operator at the keyboard."""

import sys
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TextIO

from bench.app.formatting import clock, one_line
from bench.app.run_display import RunDisplay, notice_of
from bench.engine.interface import Operator, Unattended
from bench.events import Acquired, Event, PointFinished
from bench.plugins import plugin_code
from sim.errors import RockbenchError

if TYPE_CHECKING:
    from bench.app.cli.console import LiveConsole
    from bench.protocol import Protocol

_YES = frozenset({"", "y", "yes", "done", "ok"})
_NO = frozenset({"n", "no"})
_HOW = "Press Enter when the task is done, or n and Enter to end the run: "


class PlainLines:
    """Writes one line for each step, point, warning and question."""

    _stage = "       prepare  "

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._scene = RunDisplay()
        self._phase = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.flush()

    def prepare(self, phase: str, done: int = 0, total: int = 0, /) -> None:  # noqa: ARG002 - a line for each phase
        """Callback (`bench.progress.Progress`) for the stages before the rig is opened and after it is closed."""
        if phase != self._phase:
            self._phase = phase
            self._write(self._scene.time, f"{self._stage}{one_line(phase)}")

    def __call__(self, event: Event) -> None:
        if isinstance(event, Acquired):
            return
        notice = self._scene.update(event)
        if notice is not None:
            self._write(notice.time, f"{100.0 * self._scene.fraction:3.0f} %  {notice.kind:<8} {notice.text}")

    def _write(self, time: float, text: str) -> None:
        print(f"{clock(time):>8}  {text}", file=self._stream, flush=True)


class LogLines(PlainLines):
    """Writes one line for each event of the log, and each completed point in the log format of `protocol`."""

    _stage = "plan: "

    def __init__(self, stream: TextIO, protocol: "Protocol[Any]") -> None:
        super().__init__(stream)
        self._protocol = protocol

    def __call__(self, event: Event) -> None:
        if isinstance(event, Acquired):
            return
        line = self._protocol.log_line
        if isinstance(event, PointFinished) and line is not None and isinstance(event.point, self._protocol.point):
            with plugin_code(f"the protocol {self._protocol.name}"):
                text = one_line(line(event.point))
        elif (notice := notice_of(event)) is not None:
            text = f"{notice.kind}: {notice.text}"
        else:
            return
        self._write(event.time, text)


def progress_on(
    stream: TextIO, person_answers: bool, protocol: "Protocol[Any] | None" = None
) -> "LiveConsole | PlainLines":
    """Display of the progress: the log of a `protocol` that has a log format, else the live display on a terminal that
    can redraw, else plain lines.
    """
    if protocol is not None and protocol.log_line is not None:
        return LogLines(stream, protocol)
    if stream.isatty():
        from rich.console import Console

        console = Console(file=stream)
        if console.is_terminal and not console.is_dumb_terminal:
            from bench.app.cli.console import LiveConsole

            return LiveConsole(console, person_answers)
    return PlainLines(stream)


class AtTheConsole:
    """The operator at the keyboard. Questions are written to standard error, because standard output is reserved for
    the result.
    """

    name = "operator at the console"

    def __init__(self, answers: TextIO | None = None, questions: TextIO | None = None) -> None:
        self._answers, self._questions = answers or sys.stdin, questions or sys.stderr
        self._asking = False

    @property
    def asking(self) -> bool:
        """Whether a question is open: a signal handler must then raise to interrupt the wait."""
        return self._asking

    def confirm(self, request: str) -> bool:
        """Ask until the answer is yes or no; end of input and Ctrl-C count as no."""
        self._asking = True
        try:
            return self._answer(request)
        except KeyboardInterrupt:
            print(file=self._questions)
            return False
        finally:
            self._asking = False

    def _answer(self, request: str) -> bool:
        while True:
            print(f"{request}\n{_HOW}", end="", file=self._questions, flush=True)
            line = self._answers.readline()
            if line == "" or line.strip().lower() in _NO:
                return False
            if line.strip().lower() in _YES:
                return True


def choose(*, serves_itself: bool, yes: bool, ask: bool, terminal: bool) -> Operator:
    """The operator of a run.

    A bench that `serves_itself` performs the operator's actions, unless `ask` is set. On a real bench, the person at
    the `terminal` is asked, unless `yes` is set. Raises RockbenchError if nobody could answer, or for `yes` with `ask`.
    """
    if yes and ask:
        raise RockbenchError("--yes and --ask contradict each other: use only one of them")
    if yes:
        return Unattended("unattended run, --yes")
    if ask:
        return AtTheConsole()
    if serves_itself:
        return Unattended("the bench itself")
    if terminal:
        return AtTheConsole()
    raise RockbenchError("nobody can answer the operator's questions: run in a terminal, or use --yes")
