"""The digital output lines of all devices; one of them is the enable relay of the amplifier."""

import threading
from collections.abc import Callable

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure


class Lines:
    """Levels by line name; low at power-up. `relay` is told of every change of the line `relay_line`.

    It has a lock of its own: a watchdog expires whatever else goes on.
    """

    def __init__(self, relay_line: str | None, relay: Callable[[bool], None]) -> None:
        self._relay_line = relay_line
        self._relay = relay
        self._high: set[str] = set()
        self._expired: dict[str, dict[str, bool]] = {}
        self._lock = threading.Lock()

    def is_high(self, line: str) -> bool:
        """The level of a line."""
        return line in self._high

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
        if line == self._relay_line:
            self._relay(high)
