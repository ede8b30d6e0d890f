"""Shows a loop check while it goes on: plain lines, on a terminal and in a log alike."""

from types import TracebackType
from typing import Self, TextIO

from bench.cli.scene import notice_of
from bench.cli.words import clock, one_line
from bench.events import Acquired, Event, PointFinished
from protocols.check.line import CheckLine
from protocols.check.table import sentence


class CheckLines:
    """Writes what happens and each line of the check as soon as it is known."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._phase = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.flush()

    def prepare(self, phase: str, done: int = 0, total: int = 0, /) -> None:  # noqa: ARG002 - a line for each phase
        """A `bench.progress.Progress` for what is done before the rig is opened and after it is closed."""
        if phase != self._phase:
            self._phase = phase
            print(f"{clock(0.0):>8}  plan: {one_line(phase)}", file=self._stream, flush=True)

    def __call__(self, event: Event) -> None:
        if isinstance(event, Acquired):
            return
        if isinstance(event, PointFinished) and isinstance(event.point, CheckLine):
            text = one_line(sentence(event.point))
        elif (notice := notice_of(event)) is not None:
            text = f"{notice.kind}: {notice.text}"
        else:
            return
        print(f"{clock(event.time):>8}  {text}", file=self._stream, flush=True)
