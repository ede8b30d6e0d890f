"""The progress of a run as plain lines, for a log file or a pipe: no control characters, nothing redrawn."""

from types import TracebackType
from typing import Self, TextIO

from bench.cli.scene import Scene
from bench.cli.words import clock
from bench.events import Acquired, Event


class PlainLines:
    """Writes one line for each step, point, warning and question."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._scene = Scene()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.flush()

    def __call__(self, event: Event) -> None:
        if isinstance(event, Acquired):
            return
        notice = self._scene.update(event)
        if notice is not None:
            done = f"{100.0 * self._scene.fraction:3.0f} %"
            print(f"{clock(notice.time):>8}  {done}  {notice.kind:<8} {notice.text}", file=self._stream, flush=True)
