"""Ctrl-C, SIGTERM and a closed terminal: what each means in every phase of a command, and that each is answered.

While a rig is open, the first ends the run in order and the second cuts the output. Everywhere else there is nothing
to bring to rest: the first raises KeyboardInterrupt, and where the main thread does not come to it, because it is in
native code or waits, the process is ended from another thread.
"""

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, NoReturn

from bench.cli.refusal import fail, tell
from bench.unfinished import remove_unfinished

if TYPE_CHECKING:
    from bench.engine.requests import Requests

ANSWER = 0.1
"""How long the command itself may take to answer, in words that fit what it did, before another thread does [s]."""
ORDERLY = 0.4
"""How long an orderly end may take before the process is ended at once [s]."""

# a closed terminal ends a run as Ctrl-C does; which of these exist depends on the system
SIGNALS = tuple(
    signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if name in signal.Signals.__members__
)


class Interrupts:
    """The handler of the signals where nothing is open, and which of them came first."""

    leavable = True
    """Whether the process may be ended at once."""

    def __init__(self) -> None:
        self.first: int | None = None

    @property
    def exit_code(self) -> int | None:
        """128 + the number of the signal, as shells count (Ctrl-C: 130); None when no signal came."""
        return None if self.first is None else 128 + self.first

    def __call__(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 - the signature is Python's
        """Raise KeyboardInterrupt at the first signal; further ones must not break the cleaning up after it."""
        if self.first is None:
            self.first = number
            raise KeyboardInterrupt


class Leaving(Interrupts):
    """The handler where an exception would do harm: Qt prints it in a callback, and aborts what is half built."""

    def __call__(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 - the signature is Python's
        """End the process at once."""
        answer("interrupted")
        leave(128 + number)


class RunInterrupts(Interrupts):
    """The handler during a run: the signals become `requests`, abort at the first and halt at the next."""

    def __init__(self, requests: "Requests", asking: Callable[[], bool]) -> None:
        super().__init__()
        self._requests, self._asking = requests, asking

    @property
    def leavable(self) -> bool:
        """Whether no rig is open: the run is still being planned, or has ended."""
        return self._requests.rig_closed

    def __call__(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 - the signature is Python's
        requests, first = self._requests, self.first is None
        if first:
            self.first = number
            requests.interrupted = True
            requests.abort()
        else:
            requests.halt()
        if self._asking():
            raise KeyboardInterrupt
        if first and requests.breaking is not None:
            raise requests.breaking()


@contextmanager
def interruptible(requests: "Requests", asking: Callable[[], bool]) -> Generator[Interrupts, None, None]:
    """Turn SIGINT, SIGTERM and a closed terminal into `requests`: abort at the first, halt at the next.

    The handler also raises what `requests.breaking` says, which ends the planning of a run; and KeyboardInterrupt when
    `asking` says that the operator is being asked, because Python would resume the wait for the answer. Outside the
    main thread, where Python allows no handlers, nothing is changed.
    """
    interrupts = RunInterrupts(requests, asking)
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return
    before = {number: signal.signal(number, interrupts) for number in SIGNALS}
    try:
        yield interrupts
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def leaving() -> Generator[None, None, None]:
    """Within, SIGINT ends the process at once where `heed_signals` heeds it, and somewhere else nothing is changed."""
    before = signal.getsignal(signal.SIGINT)
    if not isinstance(before, Interrupts):
        yield
        return
    signal.signal(signal.SIGINT, Leaving())
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


class Watch:
    """A thread that answers for a main thread that does not.

    Python runs a signal's handler in the main thread, between two of its instructions: not while native code works or
    waits, and on Windows, before Python 3.14, not during a wait for a lock either. The number of the signal, however,
    is written to a socket at once, on which this thread waits. The process is ended here only while the installed
    handler says that it may be left: never while a rig is open, and never under a handler of somebody else.
    """

    def __init__(self) -> None:
        self._numbers, self._written = socket.socketpair()
        self._written.setblocking(False)
        self._unanswered = threading.Lock()
        self._told: list[str] = []

    def start(self) -> None:
        """Watch from now on, to the end of the process. In the main thread."""
        signal.set_wakeup_fd(self._written.fileno(), warn_on_full_buffer=False)
        threading.Thread(target=self._watch, name="interrupts", daemon=True).start()

    def claim(self) -> bool:
        """Whether the answer is still to be given; then the caller gives it."""
        return self._unanswered.acquire(blocking=False)

    def _watch(self) -> None:
        while True:
            for number in self._numbers.recv(16):
                handler = signal.getsignal(number)
                if isinstance(handler, RunInterrupts) and not handler.leavable:
                    self._tell_of_the_run()
                elif isinstance(handler, Interrupts):
                    threading.Thread(target=self._end, args=(number,), name="interrupted", daemon=True).start()

    def _tell_of_the_run(self) -> None:
        texts = ("the run is ended: the output is ramped to zero; Ctrl-C again cuts it", "the output is cut at once")
        if len(self._told) < len(texts):
            self._told.append(texts[len(self._told)])
            self._say(f"rockbench: interrupted: {self._told[-1]}")

    @staticmethod
    def _say(text: str) -> None:
        """Past whatever draws on the terminal: its locks may be held by the thread that does not answer."""
        with suppress(OSError, ValueError):
            if sys.__stderr__ is not None:
                print(f"\r\x1b[2K{text}" if sys.__stderr__.isatty() else text, file=sys.__stderr__, flush=True)

    def _end(self, number: int) -> None:
        threading.Event().wait(ANSWER)
        if self.claim():
            # whatever draws on the terminal may be held by the thread that does not answer
            saying = threading.Thread(target=fail, args=("interrupted", "interrupted"), daemon=True)
            saying.start()
            saying.join(ANSWER)
        threading.Event().wait(ORDERLY - ANSWER)
        handler = signal.getsignal(number)
        if isinstance(handler, Interrupts) and handler.leavable:
            leave(128 + number)


_watch: Watch | None = None
"""That of this process, whose signals are one thing for all of it; none where `main` is called by another program."""


def heed_signals(interrupts: Interrupts) -> None:
    """Make this process answer its signals from now on, with `interrupts` as their handler. In the main thread."""
    global _watch

    def unraisable(error: "sys.UnraisableHookArgs") -> None:
        # what an interrupt breaks in destructors and callbacks is no news: the process ends all the same
        if interrupts.first is None and not isinstance(error.exc_value, KeyboardInterrupt):
            sys.__unraisablehook__(error)

    sys.unraisablehook = unraisable
    _watch = Watch()
    _watch.start()
    for number in SIGNALS:
        # who starts a program with nohup wants it to go on
        if number.name != "SIGHUP" or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, interrupts)


def answer(text: str, *, in_result: bool = False) -> None:
    """Say, in one line on standard error, that the command was interrupted, unless that has been said; with --json in
    an object too, but for what is `in_result` of the command itself.
    """
    if _watch is None or _watch.claim():
        if in_result:
            tell(text)
        else:
            fail(text, "interrupted")


def leave(code: int) -> NoReturn:
    """End the process now, without running anything that still waits in it; what was in the making is removed."""
    remove_unfinished()
    with suppress(OSError, ValueError):
        if sys.__stderr__ is not None and sys.__stderr__.isatty():
            # a progress bar hides the cursor
            sys.__stderr__.write("\x1b[?25h")
            sys.__stderr__.flush()
    os._exit(code)
