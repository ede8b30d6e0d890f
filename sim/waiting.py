"""Waits of the main thread, in short steps, because on Windows before Python 3.14 Ctrl-C does not interrupt the wait
for a lock.
"""

import time
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotYet
from contextlib import suppress
from queue import Full, Queue
from subprocess import Popen, TimeoutExpired
from threading import Condition, Event, Thread
from typing import TypeVar

STEP = 0.2
"""Longest time for which a signal may remain unhandled [s]."""

KILLED = 2.0
"""Longest wait for a killed process to end [s]."""

Result = TypeVar("Result")
Item = TypeVar("Item")


def join(thread: Thread, timeout: float = float("inf")) -> bool:
    """Wait until a thread has ended. Returns False after `timeout` [s]."""
    return _repeat(lambda step: thread.join(step) or not thread.is_alive(), timeout)


def wait(event: Event, timeout: float = float("inf")) -> bool:
    """Wait until an event is set. Returns False after `timeout` [s]."""
    return _repeat(event.wait, timeout)


def wait_for(changed: Condition, predicate: Callable[[], bool], timeout: float) -> bool:
    """Wait until `predicate` is true; the caller holds the lock of the condition. Returns False after `timeout` [s]."""
    return _repeat(lambda step: changed.wait_for(predicate, step), timeout)


def result(future: Future[Result]) -> Result:
    """Wait for the result of a future. Raises the exception of the future, if any."""
    while True:
        try:
            return future.result(STEP)
        except NotYet:
            if future.done():
                # the future has ended, and the exception may be its own: return its result, or raise that exception
                return future.result(0.0)


def put(queue: Queue[Item], item: Item, timeout: float) -> bool:
    """Put `item` into a queue as soon as there is room. Returns False after `timeout` [s]."""
    # usually there is room
    with suppress(Full):
        queue.put_nowait(item)
        return True

    def within(step: float) -> bool:
        try:
            queue.put(item, block=step > 0.0, timeout=step)
        except Full:
            return False
        return True

    return _repeat(within, timeout)


def end(process: "Popen[bytes]", timeout: float) -> None:
    """Wait until a process has ended. After `timeout` [s] the process is killed; if the operating system cannot end it
    within `KILLED`, because it hangs in a driver, it is left behind.
    """

    def ended(step: float) -> bool:
        try:
            process.wait(step)
        except TimeoutExpired:
            return False
        return True

    if not _repeat(ended, timeout):
        process.kill()
        _repeat(ended, KILLED)


def sleep(seconds: float) -> None:
    """Suspend the thread for `seconds`."""
    _repeat(lambda step: time.sleep(step), seconds)


def _repeat(wait_once: Callable[[float], object], timeout: float) -> bool:
    """Call `wait_once(step)`, at least once, until it returns a true value. Returns False after `timeout` [s]."""
    end = time.monotonic() + timeout
    remaining = timeout
    while True:
        if wait_once(max(0.0, min(remaining, STEP))):
            return True
        if (remaining := end - time.monotonic()) <= 0.0:
            return False
