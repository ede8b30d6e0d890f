"""The watchdog of a device: unless it is reset in time, the outputs are set to their expiration states."""

import threading
import time
from collections.abc import Callable, Sequence

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.lines import Lines
from sim import waiting

Expire = Callable[[Sequence[DeviceModel], dict[str, bool], dict[str, float]], None]
"""Function that sets the outputs of devices: levels by line, volts by analogue output."""


class Watchdog:
    """The `Job` of a watchdog. The watchdog of a simulated device, or one with a time-out of -1, never expires.

    `parts` are the device and its modules; `expire` sets their outputs to the given levels and volts. Clearing the
    expiry permits writes to `lines` again.
    """

    awaited: str | None = None
    start_terminal: str | None = None
    source: str | None = None
    clock_terminal: str | None = None

    def __init__(self, parts: Sequence[DeviceModel], expire: Expire, lines: Lines, timeout: float) -> None:
        device = parts[0]
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
        self.guarded = frozenset(part.name for part in parts)
        """The devices of the watchdog; when it starts, none of their tasks may be reserved."""
        self._parts = tuple(parts)
        self._expire = expire
        self._lines = lines
        self._states: dict[str, bool] = {}
        self._volts: dict[str, float] = {}
        self._trips = False
        self._changed = threading.Condition()
        self._deadline: float | None = None
        self._expired = False
        self._thread: threading.Thread | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        return (*self._states, *self._volts)

    @property
    def devices(self) -> frozenset[str]:
        return frozenset((self.device.name,))

    @property
    def resources(self) -> frozenset[str]:
        return frozenset((f"{self.device.name} watchdog",))

    @property
    def expired(self) -> bool:
        """Whether the watchdog has expired."""
        return self._expired

    def expire_to(self, states: dict[str, bool]) -> None:
        """Set the levels that lines take on expiry."""
        self._states.update(states)

    def engage(self, is_free: Callable[[str], bool]) -> None:
        pass

    def hold_at(self, volts: dict[str, float]) -> None:
        """Set the voltages that analogue outputs take on expiry.

        Raises DaqmxFailure for a device whose watchdog sets only digital lines.
        """
        if len(self._parts) == 1:
            raise DaqmxFailure(
                DAQmxErrors.ATTRIBUTE_NOT_SUPPORTED_IN_TASK_CONTEXT,
                f"The watchdog of {self.device.product} has no states for analogue outputs.\n\nDevice:"
                f" {self.device.name}",
            )
        self._volts.update(volts)

    @property
    def trips_on_loss(self) -> bool:
        """Whether the watchdog expires when its chassis loses the network connection. Raises DaqmxFailure for a device
        that is not a chassis.
        """
        self._require_network()
        return self._trips

    @trips_on_loss.setter
    def trips_on_loss(self, trips: bool) -> None:
        self._require_network()
        self._trips = trips

    def disarm(self) -> None:
        """Clear the expiry, as a reset of the device does."""
        self._expired = False

    def lose_network(self) -> None:
        """Simulate a lost network connection: the watchdog expires at once if it is configured to do so."""
        with self._changed:
            if self._trips and self._deadline is not None:
                self._deadline = time.monotonic()
                self._changed.notify()

    def _require_network(self) -> None:
        if len(self._parts) == 1:
            raise DaqmxFailure(
                DAQmxErrors.ATTRIBUTE_NOT_SUPPORTED_IN_TASK_CONTEXT,
                "Specified property is not supported by the device or is not applicable to the task.\n\n"
                f"Property: ExpirTrig.OnNetworkConnLoss\nDevice: {self.device.name}",
            )

    def check(self) -> None:
        pass

    def begin(self, tick: int) -> None:  # noqa: ARG002 - the watchdog uses the wall clock
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
            waiting.join(self._thread)
            self._thread = None

    def verdict(self) -> None:
        pass

    def reset(self) -> None:
        """Restart the timer. Raises DaqmxFailure if the watchdog has expired."""
        with self._changed:
            if self._expired:
                raise DaqmxFailure(
                    DAQmxErrors.CANT_RESET_EXPIRED_WATCHDOG,
                    "Watchdog timer cannot be reset, because it has expired. Clear the expiration first.",
                )
            if self._deadline is not None:
                self._deadline = time.monotonic() + self.timeout

    def clear_expiration(self) -> None:
        """Permit writes to the lines again, and restart the timer if it had expired.

        Raises DaqmxFailure for a chassis, which must be reset instead.
        """
        with self._changed:
            if self._expired and len(self._parts) > 1:
                raise DaqmxFailure(
                    DAQmxErrors.CHASSIS_WATCHDOG_TIMER_EXPIRED,
                    "Watchdog timer has expired on the chassis. Reset the chassis to continue operation.",
                )
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
                    self._expire(self._parts, self._states, self._volts)
