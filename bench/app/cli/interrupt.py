"""Handling of Ctrl-C, SIGTERM and a closed terminal in every phase of a command.

While a rig is open, the first signal ramps the output to zero and ends the run, and the second cuts the output. Without
an open rig nothing moves, and the first signal raises KeyboardInterrupt. If the main thread then cannot handle the
signal, because it executes native code or waits, another thread ends the process.
"""

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, NoReturn

from bench.app.cli.closing import watch_console
from bench.app.cli.output import print_error, report_error
from bench.unfinished import break_off, completed, remove_unfinished

if TYPE_CHECKING:
    from bench.engine.interface import Requests

ANSWER = 0.1
"""Time allowed for the response of the main thread before another thread responds [s]."""
ORDERLY = 0.4
"""Time allowed for an orderly end before the process is terminated [s]."""

# a closed terminal ends a run like Ctrl-C; which of these signals exist depends on the system
SIGNALS = tuple(
    signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if name in signal.Signals.__members__
)


def _handled() -> Iterator[signal.Signals]:
    """The signals to handle: all, except a SIGHUP that is ignored, because a program started with nohup must outlast
    its terminal.
    """
    for number in SIGNALS:
        if number.name != "SIGHUP" or signal.getsignal(number) is not signal.SIG_IGN:
            yield number


class Interrupts:
    """The signal handler while no rig is open; stores the first signal."""

    leavable = True
    """Whether the process may be ended at once."""

    def __init__(self) -> None:
        self.first: int | None = None

    @property
    def exit_code(self) -> int | None:
        """128 + the number of the signal, the shells' convention (Ctrl-C: 130); None without a signal."""
        return None if self.first is None else 128 + self.first

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt at the first signal, where an exception is safe; further ones must not interrupt the
        clean-up.
        """
        if self.first is None:
            self.first = number
            break_off(frame, KeyboardInterrupt)


class Leaving(Interrupts):
    """Signal handler for code in which an exception would be harmful: Qt only prints an exception raised in a callback,
    and aborts the process on one raised during start-up.
    """

    def __call__(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 - the signature is Python's
        """End the process at once."""
        report_interrupt()
        leave(128 + number)


class RunInterrupts(Interrupts):
    """The signal handler during a run: the first signal requests an abort, the next a halt (`requests`)."""

    def __init__(self, requests: "Requests", asking: Callable[[], bool]) -> None:
        super().__init__()
        self._requests, self._asking = requests, asking

    @property
    def leavable(self) -> bool:
        """Whether no rig is open: the run is still being planned, or has ended."""
        return self._requests.rig_closed

    def __call__(self, number: int, frame: FrameType | None) -> None:
        requests, first = self._requests, self.first is None
        if first:
            self.first = number
            requests.interrupted = True
            requests.abort()
        else:
            requests.halt()
        if self._asking():
            raise KeyboardInterrupt
        if first:
            requests.break_off(frame)


@contextmanager
def interruptible(requests: "Requests", asking: Callable[[], bool]) -> Generator[Interrupts, None, None]:
    """Context manager that turns SIGINT, SIGTERM and a closed terminal into `requests`: the first one requests an
    abort, the next a halt.

    The handler also raises the exception of `requests.breaking`, which ends the planning of a run. While a question to
    the operator is open (`asking`), it raises KeyboardInterrupt, because Python would otherwise resume the wait for the
    answer. Has no effect outside the main thread, where Python does not allow signal handlers.
    """
    interrupts = RunInterrupts(requests, asking)
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return
    before = {number: signal.signal(number, interrupts) for number in _handled()}
    try:
        yield interrupts
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def leaving() -> Generator[None, None, None]:
    """Context manager in which SIGINT ends the process at once, provided that `handle_signals` was called."""
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
    """A thread that handles a signal when the main thread does not.

    Python calls a signal handler in the main thread, between two bytecode instructions: not while native code runs or
    waits, nor, on Windows before Python 3.14, during a wait for a lock. The number of the signal, however, is written
    at once to a socket on which this thread waits. This thread ends the process only while the installed handler allows
    it (`leavable`): never while a rig is open, and never under a handler that other code has installed.
    """

    def __init__(self) -> None:
        self._numbers, self._written = socket.socketpair()
        self._written.setblocking(False)
        self._unanswered = threading.Lock()
        self._printed: list[str] = []

    def start(self) -> None:
        """Watch for signals until the process ends. Call in the main thread."""
        signal.set_wakeup_fd(self._written.fileno(), warn_on_full_buffer=False)
        threading.Thread(target=self._watch, name="interrupts", daemon=True).start()

    def claim(self) -> bool:
        """Claim the report of the interrupt. Returns True to the first caller, which must report it, and False to later
        ones.
        """
        return self._unanswered.acquire(blocking=False)

    def _watch(self) -> None:
        while True:
            for number in self._numbers.recv(16):
                handler = signal.getsignal(number)
                if isinstance(handler, RunInterrupts) and not handler.leavable:
                    self._report_run()
                elif isinstance(handler, Interrupts):
                    threading.Thread(target=self._end, args=(number,), name="interrupted", daemon=True).start()

    def _report_run(self) -> None:
        texts = ("ending the run: ramping the output to zero; press Ctrl-C again to cut it", "cutting the output")
        if len(self._printed) < len(texts):
            self._printed.append(texts[len(self._printed)])
            self._say(f"rockbench: interrupted: {self._printed[-1]}")

    @staticmethod
    def _say(text: str) -> None:
        """Write directly to the terminal: the blocked thread may hold the locks of the display."""
        with suppress(OSError, ValueError):
            if sys.__stderr__ is not None:
                print(f"\r\x1b[2K{text}" if sys.__stderr__.isatty() else text, file=sys.__stderr__, flush=True)

    def _end(self, number: int) -> None:
        threading.Event().wait(ANSWER)
        if self.claim():
            # the blocked thread may hold the lock of the terminal's output
            saying = threading.Thread(target=report_error, args=(interrupted_text(), "interrupted"), daemon=True)
            saying.start()
            saying.join(ANSWER)
        threading.Event().wait(ORDERLY - ANSWER)
        handler = signal.getsignal(number)
        if isinstance(handler, Interrupts) and handler.leavable:
            leave(128 + number)


_watch: Watch | None = None
"""The watch thread of this process; None when another program calls `main`."""


def handle_signals(interrupts: Interrupts) -> None:
    """Install `interrupts` as the handler of this process's signals. Call in the main thread."""
    global _watch

    def unraisable(error: "sys.UnraisableHookArgs") -> None:
        # errors in destructors and callbacks after an interrupt are irrelevant, since the process ends
        if interrupts.first is None and not isinstance(error.exc_value, KeyboardInterrupt):
            sys.__unraisablehook__(error)

    sys.unraisablehook = unraisable
    _watch = Watch()
    _watch.start()
    watch_console()
    for number in _handled():
        signal.signal(number, interrupts)


def converted(error: BaseException) -> KeyboardInterrupt | None:
    """The interrupt that native code has turned into this `error`, as h5py's locks (SystemError, with its cause) and
    numba's imports (ImportError, without) do; None if there was none.
    """
    if isinstance(error.__cause__, KeyboardInterrupt):
        return error.__cause__
    handler = signal.getsignal(signal.SIGINT)
    return KeyboardInterrupt() if isinstance(handler, Interrupts) and handler.first is not None else None


def interrupted_text(text: str = "interrupted", otherwise: str = "") -> str:
    """Message for an interrupt: `text` and the complete result files or, if there are none, `otherwise`."""
    kept = ", ".join(map(str, completed()))
    if not kept:
        return f"{text}; {otherwise}" if otherwise else text
    return f"{text} after its result was written: {kept} is complete"


def report_interrupt(text: str | None = None, *, in_result: bool = False) -> None:
    """Report the interrupt once, as one line on standard error: `text` if given, else `interrupted_text`. With --json
    it is also reported as an object, unless the command's result states it (`in_result`).
    """
    text = text or interrupted_text()
    if _watch is None or _watch.claim():
        if in_result:
            print_error(text)
        else:
            report_error(text, "interrupted")


def leave(code: int) -> NoReturn:
    """Remove partial files and end the process at once."""
    remove_unfinished()
    with suppress(OSError, ValueError):
        if sys.__stderr__ is not None and sys.__stderr__.isatty():
            # show the cursor, which a progress bar may have hidden
            sys.__stderr__.write("\x1b[?25h")
            sys.__stderr__.flush()
    os._exit(code)


@contextmanager
def until_interrupted() -> Generator[threading.Event]:
    """Context manager that yields an event. Ctrl-C, SIGTERM and the closing of the terminal set it instead of ending
    the process.
    """
    over = threading.Event()

    def handle(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        over.set()

    before = {number: signal.signal(number, handle) for number in _handled()}
    try:
        yield over
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
