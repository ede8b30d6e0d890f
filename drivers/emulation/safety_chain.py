"""Enable chain of the amplifier and its monitoring contacts.

In series: enable relay, heartbeat relay, emergency stop, over-travel switches, and the amplifier's own trip. Second
contacts of the emergency stop and of the switches, and the amplifier's ready contact, are wired to digital inputs of
the DAQ device.
"""

import time
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from drivers.emulation.bench import EmulatedBench
from drivers.errors import RigError


class PulseRelay:
    """Relay that is closed for `timeout` [s] after each rising edge; a constant level, high or low, opens it."""

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._high = False
        self._until = 0.0

    @property
    def closed(self) -> bool:
        """Whether the last rising edge was less than `timeout` ago."""
        return time.monotonic() < self._until

    def level(self, high: bool) -> None:
        """Set the level of the line."""
        if high and not self._high:
            self._until = time.monotonic() + self._timeout
        self._high = high


INPUTS = ("emergency_stop", "over_travel", "over_travel_2", "amplifier_ready")
"""Names of the contacts wired to inputs."""
_TRIP = 0.95
"""Displacement at which an over-travel switch opens, as a fraction of the half stroke."""
_HOLD = 1.0
"""Time for which the relay of an over-travel switch stays open after the table has returned [s]."""
_SOFT_START = 0.05
"""Time from enabling the amplifier to its ready signal [s]."""
_ENDS: tuple[int, ...] = (1, 2)


class SafetyChain:
    """Controls the enable input of `bench`; the heartbeat relay opens `heartbeat` [s] after the last rising edge of its
    line.

    Contacts and faults may be read and set from any thread.
    """

    def __init__(self, bench: EmulatedBench, heartbeat: float) -> None:
        self._bench = bench
        self._lock = bench.lock
        self._trip = _TRIP * bench.half_stroke
        self._pulses = PulseRelay(heartbeat)
        self._enable_relay = False
        self._emergency_stop = True
        self._jammed: set[int] = set()
        self._open_until = dict.fromkeys(_ENDS, 0.0)
        self._tripped = False
        self._broken: set[str] = set()
        self._closed = False
        self._closed_since = 0.0
        self._settling = False
        bench.watch(self._table_at)

    @property
    def contacts(self) -> dict[str, bool]:
        """Whether each contact is closed, by name."""
        with self._lock:
            return {
                "enable relay": self._enable_relay,
                "heartbeat relay": self._pulses.closed,
                "emergency stop": self._emergency_stop,
                "over-travel": self._within(1),
                "over-travel 2": self._within(2),
                "amplifier ready": self._is_ready(),
            }

    @property
    def inputs(self) -> Mapping[str, Callable[[], bool]]:
        """Function for each contact of `INPUTS` that returns the level of its input: high while the contact is closed
        and the wire intact.
        """
        return {name: lambda name=name: self._level(name) for name in INPUTS}

    def enable_line(self, high: bool) -> None:
        """Set the level of the enable relay's line."""
        with self._lock:
            self._enable_relay = high
            self._settle()

    def heartbeat_line(self, high: bool) -> None:
        """Set the level of the heartbeat line."""
        with self._lock:
            if "heartbeat" not in self._broken:
                self._pulses.level(high)
            self._settle()

    def press_emergency_stop(self) -> None:
        """Press the emergency stop, which latches."""
        self._change(lambda: setattr(self, "_emergency_stop", False))

    def release_emergency_stop(self) -> None:
        """Release the latched emergency stop."""
        self._change(lambda: setattr(self, "_emergency_stop", True))

    def trip_over_travel(self, end: int = 1) -> None:
        """Hold the switch at one end open: end 1, at positive displacements, or end 2."""
        if end not in _ENDS:
            raise RigError(f"over-travel at end {end!r} is refused: the ends are 1 and 2")
        self._change(lambda: self._jammed.add(end))

    def reset_over_travel(self) -> None:
        """Release the switches, so that they follow the table again."""
        self._change(self._jammed.clear)

    def trip_amplifier(self) -> None:
        """Trip the amplifier; its output is off until the amplifier is reset."""
        self._change(lambda: setattr(self, "_tripped", True))

    def reset_amplifier(self) -> None:
        """Clear the amplifier's fault."""
        self._change(lambda: setattr(self, "_tripped", False))

    def break_wire(self, name: str) -> None:
        """Break the wire of an input, which then reads low, or of the "heartbeat", whose relay then times out."""
        if name not in (*INPUTS, "heartbeat"):
            raise RigError(f"wire {name!r} is refused: the wires are {', '.join(INPUTS)} and heartbeat")
        self._change(lambda: self._broken.add(name))

    def mend_wire(self, name: str) -> None:
        self._change(lambda: self._broken.discard(name))

    def _change(self, change: Callable[[], object]) -> None:
        with self._lock:
            change()
            self._settle()

    def _level(self, name: str) -> bool:
        with self._lock:
            contacts = {
                "emergency_stop": self._emergency_stop,
                "over_travel": self._within(1),
                "over_travel_2": self._within(2),
                "amplifier_ready": self._is_ready(),
            }
            return contacts[name] and name not in self._broken

    def _within(self, end: int) -> bool:
        return end not in self._jammed and time.monotonic() >= self._open_until[end]

    def _is_ready(self) -> bool:
        return self._closed and time.monotonic() >= self._closed_since + _SOFT_START

    def _table_at(self, x: NDArray[np.float64]) -> None:
        """Update the switches for the table's displacements `x` [m] since the last call; called with the bench's lock
        held.
        """
        for end, reach in zip(_ENDS, (x.max(), -x.min()), strict=True):
            if reach > self._trip:
                self._open_until[end] = time.monotonic() + _HOLD
        self._settle()

    def _settle(self) -> None:
        """Enable the amplifier if and only if the whole chain is closed."""
        if self._settling:
            # enabling advances the bench, which calls this method again
            return
        self._settling = True
        try:
            while (closed := self._is_closed()) is not self._closed:
                self._closed, self._closed_since = closed, time.monotonic()
                self._bench.enable(closed)
        finally:
            self._settling = False

    def _is_closed(self) -> bool:
        within = all(self._within(end) for end in _ENDS)
        return self._enable_relay and self._pulses.closed and self._emergency_stop and within and not self._tripped
