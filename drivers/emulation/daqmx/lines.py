"""The digital lines of all devices, and what they are wired to."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure


@dataclass(frozen=True)
class Wires:
    """By names of lines: who is `told` of the level of an output line, and what an input line `shows`."""

    told: Mapping[str, Callable[[bool], None]] = field(default_factory=dict[str, Callable[[bool], None]])
    shown: Mapping[str, Callable[[], bool]] = field(default_factory=dict[str, Callable[[], bool]])


class Lines:
    """Levels by line name; outputs are low at power-up, inputs that nothing is wired to are pulled down.

    It has a lock of its own: a watchdog expires whatever else goes on.
    """

    def __init__(self, wires: Wires) -> None:
        self._wires = wires
        self._high: set[str] = set()
        self._expired: dict[str, dict[str, bool]] = {}
        self._lock = threading.Lock()

    def is_high(self, line: str) -> bool:
        """The level that a line was set to."""
        return line in self._high

    def shows(self, line: str) -> bool:
        """The level that is seen at a line: what is wired to it, or what it was set to."""
        shown = self._wires.shown.get(line)
        return line in self._high if shown is None else shown()

    def write(self, device: str, line: str, high: bool) -> None:
        """Set a line. Raises DaqmxFailure while the watchdog of its device has expired."""
        with self._lock:
            if device in self._expired:
                raise DaqmxFailure(
                    DAQmxErrors.WRITE_FAILED_BECAUSE_WATCHDOG_EXPIRED,
                    "Write cannot be performed, because the watchdog timer of the device has expired.\n\n"
                    f"Device: {device}",
                )
            self._set(line, high)

    def expire(self, device: str, states: dict[str, bool]) -> None:
        """The watchdog of a device has expired: its lines go to `states`, and nobody may write."""
        with self._lock:
            self._expired[device] = {line: line in self._high for line in states}
            for line, high in states.items():
                self._set(line, high)

    def release(self, device: str) -> None:
        """Let lines be written again; they go back to what was written last, the worst that a client may meet."""
        with self._lock:
            for line, high in self._expired.pop(device, {}).items():
                self._set(line, high)

    def reset(self, device: str, names: tuple[str, ...]) -> None:
        """All lines of a device as at power-up."""
        with self._lock:
            self._expired.pop(device, None)
            for line in names:
                self._set(line, False)

    def _set(self, line: str, high: bool) -> None:
        (self._high.add if high else self._high.discard)(line)
        if (told := self._wires.told.get(line)) is not None:
            told(high)
