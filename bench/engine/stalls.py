"""Detection of stalls: periods in which the operating system did not run the program."""

import threading
from collections import deque
from typing import Self

from drivers.clock import now
from sim import waiting

LONGEST = 0.1
"""Maximum delay of the thread [s] that is not recorded as a stall; equal to the default lead of the drive."""
_PERIOD = 0.02
_KEPT = 16


class Stalls:
    """Context manager that runs a thread which repeatedly sleeps for a short time. A sleep that ends much too late
    reveals a stall.

    A slow call, a slow disk or a long computation in another thread does not normally delay this thread; a stopped or
    suspended process, a computer without free processors, or exhausted memory does.
    """

    def __init__(self) -> None:
        self._found: deque[tuple[float, float]] = deque(maxlen=_KEPT)
        self._woken = now()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="stalls", daemon=True)

    def __enter__(self) -> Self:
        self._woken = now()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        waiting.join(self._thread)

    def since(self, instant: float) -> float:
        """Longest stall [s] that ended after `instant` of the machine's clock [s]; 0 if there was none."""
        # after a stall, the thread itself may not have woken yet
        running = now() - self._woken - _PERIOD
        found = [length for end, length in tuple(self._found) if end > instant]
        return max([*found, running if running > LONGEST else 0.0])

    def _watch(self) -> None:
        while not self._over.wait(_PERIOD):
            late = (woken := now()) - self._woken - _PERIOD
            if late > LONGEST:
                self._found.append((woken, late))
            self._woken = woken


def in_words(seconds: float) -> str:
    """Message about a stall of this duration, with its possible causes and the remedy."""
    return (
        f"the operating system did not run this program for {seconds:.2f} s (process stopped, computer suspended or"
        " overloaded): close other programs, and disable power saving"
    )
