"""The watchdog of a device: without a reset in time its lines go to their safe states."""

import threading
import time

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.lines import Lines


class Watchdog:
    """A `Job`. A simulated device's watchdog never expires; a time-out of -1 means the same."""

    awaited: str | None = None
    start_terminal: str | None = None
    source: str | None = None
    clock_terminal: str | None = None

    def __init__(self, device: DeviceModel, lines: Lines, timeout: float) -> None:
        if device.watchdog is None:
            raise DaqmxFailure(
                DAQmxErrors.WATCHDOG_TIMER_NOT_SUPPORTED,
                f"Watchdog timer is not supported on this device.\n\nDevice: {device.name}",
            )
        if timeout != -1.0 and not 0.0 < timeout <= device.watchdog:
            raise DaqmxFailure(
                DAQmxErrors.WATCHDOG_TIMEOUT_OUT_OF_RANGE_AND_NOT_SPECIAL_VAL,
                f"Watchdog timer timeout is out of range.\n\nRequested: {timeout}\nMaximum: {device.watchdog}",
            )
        self.timeout = timeout
        self.device = device
        self._lines = lines
        self._states: dict[str, bool] = {}
        self._changed = threading.Condition()
        self._deadline: float | None = None
        self._expired = False
        self._thread: threading.Thread | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        return tuple(self._states)

    @property
    def devices(self) -> frozenset[str]:
        return frozenset((self.device.name,))

    @property
    def resources(self) -> frozenset[str]:
        return frozenset((f"{self.device.name} watchdog",))

    @property
    def expired(self) -> bool:
        """Whether it was not reset in time."""
        return self._expired

    def expire_to(self, states: dict[str, bool]) -> None:
        """The levels that lines go to on expiry."""
        self._states.update(states)

    def check(self) -> None:
        pass

    def begin(self, tick: int) -> None:  # noqa: ARG002 - it has a clock of its own
        self._expired = False
        if self.device.simulated or self.timeout == -1.0:
            return
        self._deadline = time.monotonic() + self.timeout
        self._thread = threading.Thread(target=self._watch, name="emulated-watchdog", daemon=True)
        self._thread.start()

    def end(self) -> None:
        with self._changed:
            self._deadline = None
            self._changed.notify()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def verdict(self) -> None:
        pass

    def reset(self) -> None:
        """All is well: count from now on."""
        with self._changed:
            if self._expired:
                raise DaqmxFailure(
                    DAQmxErrors.CANT_RESET_EXPIRED_WATCHDOG,
                    "Watchdog timer cannot be reset, because it has expired. Clear the expiration first.",
                )
            if self._deadline is not None:
                self._deadline = time.monotonic() + self.timeout

    def clear_expiration(self) -> None:
        """Let the lines be written again, and count from now on when it had expired."""
        with self._changed:
            self._lines.release(self.device.name)
            if self._expired and self._deadline is not None:
                self._deadline = time.monotonic() + self.timeout
            self._expired = False
            self._changed.notify()

    def _watch(self) -> None:
        with self._changed:
            while self._deadline is not None:
                remaining = self._deadline - time.monotonic()
                if self._expired:
                    self._changed.wait()
                elif remaining > 0.0:
                    self._changed.wait(remaining)
                else:
                    self._expired = True
                    self._lines.expire(self.device.name, self._states)
