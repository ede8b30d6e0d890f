"""Enable chain: amplifier relay, watchdog of the device, heartbeat of an external relay, and safety inputs.

The relay is open at low level, and open is safe. X Series devices have a watchdog for their digital lines, cDAQ-9185
and 9189 have one for all outputs of their modules, and a CompactRIO has none (manuals, "Watchdog Timer"). The heartbeat
works without a watchdog: an external relay stays closed only while the control loop toggles the line.
"""

import time
from collections.abc import Mapping

import numpy as np
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError, Error

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import code_of, translated
from drivers.daqmx.parameters import SafetyInput, device_name
from drivers.errors import RigError
from sim import waiting
from sim.errors import InvalidInput

ENABLE_TASK = "rockbench_enable"

_TIME = 0.1
"""Time-out passed to the driver for writing or reading a line [s]; a line without a sample clock requires no wait."""
_CHASSIS_EXPIRED = int(DAQmxErrors.CHASSIS_WATCHDOG_TIMER_EXPIRED)
_EXPIRED = {int(DAQmxErrors.WRITE_FAILED_BECAUSE_WATCHDOG_EXPIRED), _CHASSIS_EXPIRED}
"""Error codes of a device that rejects a write because its watchdog has expired and opened the relay."""


class EnableLine:
    """The digital line of the relay. After construction the relay is open and the task stopped.

    `chassis_expired`: the watchdog of the chassis has expired and opened the relay, and the chassis is blocked until it
    is reset.
    """

    def __init__(self, connection: Connection, line: str) -> None:
        self.chassis_expired = False
        with translated("creating the task of the enable line"):
            self._task = library.task(ENABLE_TASK, connection.options(ENABLE_TASK))
        try:
            with translated("creating the task of the enable line"):
                self._task.do_channels.add_do_chan(line)
                self._writer = library.line_writer(self._task)
            self.open()
        except BaseException:
            self.close()
            raise

    def energise(self) -> None:
        """Close the relay."""
        with translated("closing the enable relay"):
            self._writer.write_one_sample_one_line(True, _TIME)

    def cut(self) -> bool:
        """Open the relay in one call, from any thread; returns whether the device confirmed it, or its expired watchdog
        has already opened the relay.
        """
        try:
            self._writer.write_one_sample_one_line(False, _TIME)
        except DaqError as error:
            return code_of(error) in _EXPIRED
        except (Error, ValueError):
            # gRPC raises ValueError for a closed channel
            return False
        return True

    def open(self) -> None:
        """Open the relay and release the line, which keeps its state."""
        try:
            with translated("opening the enable relay"):
                self._write_open()
        except RigError as error:
            error.args = (f"{error}; the relay may be closed: press the emergency stop",)
            raise
        with translated("releasing the enable relay, which is open,"):
            self._task.stop()

    def close(self) -> None:
        """Clear the task."""
        with translated("clearing the task of the enable line"):
            self._task.close()

    def _write_open(self) -> None:
        try:
            self._writer.write_one_sample_one_line(False, _TIME)
        except DaqError as error:
            # an expired watchdog has opened the relay, and the device rejects writes
            if code_of(error) not in _EXPIRED:
                raise
            self.chassis_expired = code_of(error) == _CHASSIS_EXPIRED


WATCHDOG_TASK = "rockbench_watchdog"

_PER_TIMEOUT = 4
"""Maximum number of resets within one time-out."""
_EXPIRY = 0.05
"""Additional time [s] for a watchdog to expire and open the relay."""
_REFUSED = {
    int(DAQmxErrors.WATCHDOG_TIMER_NOT_SUPPORTED): "{device} has no watchdog: remove hardware.daq.watchdog",
    int(
        DAQmxErrors.WATCHDOG_TIMEOUT_OUT_OF_RANGE_AND_NOT_SPECIAL_VAL
    ): "the watchdog of {device} does not support this time-out",
}


class Watchdog:
    """Watchdog that sets `line` low, which opens the relay, unless it is reset within `timeout` [s]. Raises
    InvalidInput if the device has no watchdog or does not support the time-out.

    The watchdog is that of the line's device, or that of `chassis` if the device is a module. The watchdog of a chassis
    also sets `output` to 0 V, and expires at once when the chassis loses its network connection; after an expiry the
    chassis rejects every operation until it is reset (cDAQ-9185 User Manual, "Watchdog Timer").
    """

    def __init__(self, connection: Connection, line: str, timeout: float, chassis: str | None, output: str) -> None:
        device = chassis or device_name(line)
        self._connection = connection
        self._chassis = chassis
        self._timeout, self._interval = timeout, timeout / _PER_TIMEOUT
        self._last_reset = 0.0
        with translated("creating the watchdog task"):
            try:
                self._task: library.WatchdogTask | None = library.watchdog_task(
                    device, WATCHDOG_TASK, timeout, connection.options(WATCHDOG_TASK)
                )
            except DaqError as error:
                if (why := _REFUSED.get(code_of(error))) is None:
                    raise
                raise InvalidInput("hardware.daq.watchdog", timeout, why.format(device=device)) from error
        try:
            with translated("setting the watchdog's expiration states"):
                self._task.cfg_watchdog_do_expir_states([library.goes_low(line)])
                if chassis is not None:
                    self._task.cfg_watchdog_ao_expir_states([library.goes_to_zero(output)])
                    self._task.expir_trig_trig_on_network_conn_loss = True
        except BaseException:
            self.close()
            raise

    @property
    def has_barred_chassis(self) -> bool:
        """Whether the watchdog is that of a chassis and has expired; the chassis must then be reset."""
        with translated("reading the watchdog"):
            return self._chassis is not None and self._alive().expired

    def reset_chassis(self) -> None:
        """Reset the chassis: its tasks are aborted, and its outputs return to their power-up states."""
        if self._chassis is not None:
            reset_chassis(self._connection, self._chassis)

    def start(self) -> None:
        """Start the watchdog. No other task of the device may be running or reserved."""
        with translated("starting the watchdog"):
            self._alive().start()
        self._last_reset = time.monotonic()

    def reset(self) -> None:
        """Reset the watchdog if at least a quarter of the time-out has passed since the last reset. Raises RigError if
        the watchdog has expired.
        """
        if time.monotonic() - self._last_reset >= self._interval:
            with translated("resetting the watchdog, which otherwise opens the enable line,"):
                self._alive().reset_timer()
            self._last_reset = time.monotonic()

    def stop(self) -> None:
        """Stop the watchdog, and unlock the lines if it has expired."""
        with translated("stopping the watchdog"):
            task = self._alive()
            if task.expired:
                task.clear_expiration()
            task.stop()

    def await_expiry(self) -> None:
        """Wait until a watchdog that is no longer reset must have expired and opened the relay."""
        waiting.sleep(max(0.0, self._last_reset + self._timeout + _EXPIRY - time.monotonic()))

    def close(self) -> None:
        """Clear the task, which stops the watchdog; may be called repeatedly."""
        if self._task is not None:
            try:
                with translated("clearing the watchdog task"):
                    self._task.close()
            finally:
                self.let_go()

    def let_go(self) -> None:
        """Drop the task without clearing it."""
        if self._task is not None:
            library.let_go(self._task)
            self._task = None

    def _alive(self) -> library.WatchdogTask:
        if self._task is None:
            raise RigError("the watchdog cannot be used: its task is closed; open a new session")
        return self._task


def reset_chassis(connection: Connection, chassis: str) -> None:
    """Reset a chassis whose watchdog has expired; only a reset clears the expiry."""
    with translated("resetting the chassis, whose watchdog has expired,"):
        for device in library.system(connection.options()).devices:
            if device.name.lower() == chassis.lower():
                device.reset_device()


HEARTBEAT_TASK = "rockbench_heartbeat"


class Heartbeat:
    """Heartbeat output of a relay that opens `timeout` [s] after the last rising edge. After construction the line is
    low and its task stopped.
    """

    def __init__(self, connection: Connection, line: str, timeout: float) -> None:
        self._timeout = timeout
        self._opens: float | None = None
        with translated("creating the task of the heartbeat line"):
            self._task = library.task(HEARTBEAT_TASK, connection.options(HEARTBEAT_TASK))
        try:
            with translated("creating the task of the heartbeat line"):
                self._task.do_channels.add_do_chan(line)
                self._writer = library.line_writer(self._task)
            self.rest()
        except BaseException:
            self.close()
            raise

    def beat(self, *, driving: bool = False) -> None:
        """Toggle the line; the first edge after `rest()` is a rising one.

        With `driving`, raises RigError instead of a rising edge if the relay has opened since the last one, because
        the edge would close it again in the middle of the motion.
        """
        begun = time.monotonic()
        if driving and not self._high and self._opens is not None and begun > self._opens:
            late = begun - self._opens + self._timeout
            raise RigError(
                f"the heartbeat relay has opened: its line had no rising edge for {late:.2g} s, its time-out is "
                f"{self._timeout:g} s; increase hardware.daq.heartbeat.timeout and the time-out of the relay, or find "
                "what delays the program"
            )
        with translated("toggling the heartbeat line"):
            self._writer.write_one_sample_one_line(not self._high, _TIME)
        self._high = not self._high
        if not driving:
            # the relay may open until the first sample, because the drive is zero
            self._opens = None
        elif self._high:
            self._opens = begun + self._timeout

    def rest(self) -> None:
        """Set the line low and release it; the line keeps its state."""
        self._high = False
        with translated("setting the heartbeat line low"):
            self._writer.write_one_sample_one_line(False, _TIME)
            self._task.stop()

    def close(self) -> None:
        """Clear the task."""
        with translated("clearing the task of the heartbeat line"):
            self._task.close()


SAFETY_TASK = "rockbench_safety"


class SafetyInputs:
    """Safety inputs: one unclocked task for all lines, so that a read returns their present levels."""

    def __init__(self, connection: Connection, wired: Mapping[str, SafetyInput]) -> None:
        self._names = tuple(wired)
        self._good = np.array([given.good == "high" for given in wired.values()])
        with translated("creating the task of the safety inputs"):
            self._task = library.task(SAFETY_TASK, connection.options(SAFETY_TASK))
        try:
            with translated("creating the task of the safety inputs"):
                for given in wired.values():
                    self._task.di_channels.add_di_chan(given.line)
                self._reader = library.lines_reader(self._task)
        except BaseException:
            self.close()
            raise

    def start(self) -> None:
        """Reserve the lines, so that a read need not start and stop the task."""
        with translated("starting the safety inputs"):
            self._task.start()

    def read(self) -> dict[str, bool]:
        """Whether each input is good now. Raises RigError if the states cannot be read."""
        # a level missing from the device's reply counts as open
        levels = ~self._good
        with translated("reading the safety inputs"):
            self._reader.read_one_sample_one_line(levels, _TIME)
        return dict(zip(self._names, (levels == self._good).tolist(), strict=True))

    def stop(self) -> None:
        """Release the lines; they can still be read."""
        with translated("stopping the safety inputs"):
            self._task.stop()

    def close(self) -> None:
        """Clear the task."""
        with translated("clearing the task of the safety inputs"):
            self._task.close()
