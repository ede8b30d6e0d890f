"""A bench whose inputs are wired to its own output: the smallest plant that a DAQ device can be tested on."""

import threading
import time
from math import floor

import numpy as np
from numpy.typing import NDArray

from drivers.emulation.plant import Output
from sim.channel import Counts

BITS = 16
RANGE = 10.0
COUNTS_PER_VOLT = 2**BITS / (2.0 * RANGE)


class Loopback:
    """Terminal k shows the output as counts of a 16-bit converter, plus 10 k.

    Implements `drivers.emulation.plant.Plant`.
    """

    def __init__(self, tick_rate: float, terminals: int = 4) -> None:
        self._rate = tick_rate
        self._terminals = terminals
        self._output: Output | None = None
        self._played = np.zeros(round(60.0 * tick_rate))
        self._next = 0
        self._lock = threading.RLock()
        self._began = time.monotonic()
        self.enabled = False
        self.ever_enabled = False

    @property
    def tick_rate(self) -> float:
        return self._rate

    @property
    def terminals(self) -> int:
        return self._terminals

    def tick(self) -> int:
        return floor((time.monotonic() - self._began) * self._rate)

    def time_of(self, tick: int) -> float:
        return self._began + tick / self._rate

    def inputs(self, first: int, n: int) -> Counts:
        volts = self._volts(first + n)[first : first + n]
        offsets = 10 * np.arange(self._terminals)
        return (np.round(COUNTS_PER_VOLT * volts)[:, np.newaxis] + offsets).astype(np.int16)

    def wire(self, output: Output) -> None:
        self._output = output

    def enable(self, closed: bool) -> None:
        self.enabled = closed
        self.ever_enabled = self.ever_enabled or closed

    def present_output(self) -> float:
        """Volts at the output now."""
        now = self.tick() + 1
        return float(self._volts(now)[now - 1])

    def next_output(self) -> float:
        """Volts at the output at the next tick: what is set now takes effect there."""
        time.sleep(max(self.time_of(self.tick() + 1) - time.monotonic(), 0.0))
        return self.present_output()

    def played(self) -> NDArray[np.float64]:
        """Volts at the output at every tick until now."""
        now = self.tick() + 1
        return self._volts(now)[:now].copy()

    def _volts(self, until: int) -> NDArray[np.float64]:
        with self._lock:
            if until > self._next and self._output is not None:
                self._played[self._next : until] = self._output(self._next, until - self._next)
            self._next = max(self._next, until)
            return self._played
