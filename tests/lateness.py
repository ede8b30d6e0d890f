"""Lateness of the machine while a test runs in real time: the excess of short sleeps over what was asked for.

A test with the mark `milliseconds` compares arrivals of emulated instruments, and cannot pass on a machine that lets a
thread wait for longer. Its failure there says nothing of the bench, so it is reported as skipped, with the lateness
measured beside it; on a machine that keeps time it stays a failure.
"""

import threading
import time
from typing import Self

_NAP = 0.005
TYPICAL, WORST = 0.005, 0.1
"""Lateness that a real-time test must bear [s]: of 99 naps in 100, and of any nap. The emulated lasers are placed to
1 ms from arrivals over seconds; the lead of the command, the shortest buffer of all, is 0.1 s or longer."""


class Lateness:
    """Measures in a thread while it is entered."""

    def __init__(self) -> None:
        self._late: list[float] = []
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._measure, name="lateness", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped.set()
        self._thread.join()

    @property
    def worst(self) -> float:
        """Greatest lateness of a nap [s]; 0 before the first has ended."""
        return max(self._late, default=0.0)

    @property
    def typical(self) -> float:
        """Lateness that 99 naps in 100 do not exceed [s]; 0 before the first has ended."""
        # here, because conftest.py sets the threads of numpy's library before numpy is imported
        import numpy as np

        return float(np.quantile(self._late, 0.99)) if self._late else 0.0

    @property
    def excuse(self) -> str | None:
        """Reason to disregard a failure, with the figures; None where the machine kept time."""
        if not self._late:
            return None
        typical, worst = self.typical, self.worst
        if typical <= TYPICAL and worst <= WORST:
            return None
        late = f"one sleep in 100 ended {1e3 * typical:.0f} ms late, the worst {1e3 * worst:.0f} ms"
        return f"this machine does not keep real time: {late} (allowed {1e3 * TYPICAL:.0f} and {1e3 * WORST:.0f} ms)"

    def _measure(self) -> None:
        while not self._stopped.is_set():
            begun = time.perf_counter()
            time.sleep(_NAP)
            self._late.append(time.perf_counter() - begun - _NAP)
