"""Ctrl-C ends a run in order: once aborts it, a second time cuts the output."""

import signal
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType

from bench.engine.requests import Requests


class Interrupts:
    """Which signal asked for the end of a run, if one did."""

    def __init__(self) -> None:
        self.first: int | None = None

    @property
    def exit_code(self) -> int | None:
        """128 + the number of the signal, as shells count (Ctrl-C: 130); None when no signal came."""
        return None if self.first is None else 128 + self.first


@contextmanager
def interruptible(requests: Requests, asking: Callable[[], bool]) -> Generator[Interrupts, None, None]:
    """Turn SIGINT, SIGTERM and a closed terminal into `requests`: abort at the first, halt at the next.

    When `asking` says that the operator is being asked, the handler also raises KeyboardInterrupt, because
    Python would resume the wait for the answer. Outside the main thread, where Python allows no handlers, nothing
    is changed.
    """
    interrupts = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return

    def handle(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        if interrupts.first is None:
            interrupts.first = number
            requests.abort()
        else:
            requests.halt()
        if asking():
            raise KeyboardInterrupt

    # a closed terminal ends a run as Ctrl-C does; which of these exist depends on the system
    names = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    numbers = [signal.Signals[name] for name in names if name in signal.Signals.__members__]
    before = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield interrupts
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
