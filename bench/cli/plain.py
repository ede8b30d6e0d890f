"""The progress of a run as plain lines, for a log file or a pipe: no control characters, nothing redrawn."""

from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TextIO

from bench.cli.scene import Scene, notice_of
from bench.cli.words import clock, one_line
from bench.events import Acquired, Event, PointFinished

if TYPE_CHECKING:
    from bench.protocol import Protocol


class PlainLines:
    """Writes one line for each step, point, warning and question."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._scene = Scene()
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
            print(
                f"{clock(self._scene.time):>8}  {'':5}  {'prepare':<8} {one_line(phase)}", file=self._stream, flush=True
            )

    def __call__(self, event: Event) -> None:
        if isinstance(event, Acquired):
            return
        notice = self._scene.update(event)
        if notice is not None:
            done = f"{100.0 * self._scene.fraction:3.0f} %"
            print(f"{clock(notice.time):>8}  {done}  {notice.kind:<8} {notice.text}", file=self._stream, flush=True)


class LogLines(PlainLines):
    """Writes what happens, and each point of `protocol` in its own words as soon as it is known."""

    def __init__(self, stream: TextIO, protocol: "Protocol[Any]") -> None:
        super().__init__(stream)
        self._protocol = protocol

    def prepare(self, phase: str, done: int = 0, total: int = 0, /) -> None:  # noqa: ARG002 - a line for each phase
        """A `bench.progress.Progress` for what is done before the rig is opened and after it is closed."""
        if phase != self._phase:
            self._phase = phase
            print(f"{clock(0.0):>8}  plan: {one_line(phase)}", file=self._stream, flush=True)

    def __call__(self, event: Event) -> None:
        if isinstance(event, Acquired):
            return
        line = self._protocol.log_line
        if isinstance(event, PointFinished) and line is not None and isinstance(event.point, self._protocol.point):
            text = one_line(line(event.point))
        elif (notice := notice_of(event)) is not None:
            text = f"{notice.kind}: {notice.text}"
        else:
            return
        print(f"{clock(event.time):>8}  {text}", file=self._stream, flush=True)
