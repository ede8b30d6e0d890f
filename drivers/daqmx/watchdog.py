"""The device's own watchdog: it opens the enable line when this program no longer says that all is well.

X Series devices have one for their digital lines, some network chassis too; a CompactRIO has none (the manuals of the
devices, "Watchdog Timer").
"""

import time

from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import code_of, translated
from drivers.daqmx.parameters import device_name
from drivers.errors import RigError
from sim.errors import InvalidInput

NAME = "rockbench_watchdog"

_PER_TIMEOUT = 4
"""How often it is told at most, per time-out: once a block would be a call too many."""
_REFUSED = {
    int(DAQmxErrors.WATCHDOG_TIMER_NOT_SUPPORTED): "{device} has no watchdog: remove hardware.daq.watchdog",
    int(DAQmxErrors.WATCHDOG_TIMEOUT_OUT_OF_RANGE_AND_NOT_SPECIAL_VAL): "{device} cannot wait so long",
}


class Watchdog:
    """Opens `line` when it was not told for `timeout` seconds. Raises InvalidInput when the device cannot do that."""

    def __init__(self, connection: Connection, line: str, timeout: float) -> None:
        device = device_name(line)
        self._interval = timeout / _PER_TIMEOUT
        self._told = 0.0
        with translated("making the watchdog task"):
            try:
                self._task: library.WatchdogTask | None = library.watchdog_task(
                    device, NAME, timeout, connection.options(NAME)
                )
            except DaqError as error:
                if (why := _REFUSED.get(code_of(error))) is None:
                    raise
                raise InvalidInput("hardware.daq.watchdog", timeout, why.format(device=device)) from error
        try:
            with translated("setting the watchdog's state of the enable line"):
                self._task.cfg_watchdog_do_expir_states([library.goes_low(line)])
        except BaseException:
            self.close()
            raise

    def start(self) -> None:
        """Start to watch. No other task of the device may run or be reserved."""
        with translated("starting the watchdog"):
            self._alive().start()
        self._told = time.monotonic()

    def tell(self) -> None:
        """All is well. Raises RigError when the watchdog has barked already."""
        if time.monotonic() - self._told >= self._interval:
            with translated("resetting the watchdog, which opens the enable line when it is not,"):
                self._alive().reset_timer()
            self._told = time.monotonic()

    def stop(self) -> None:
        """End the watch, and unlock the lines when it has barked."""
        with translated("stopping the watchdog"):
            task = self._alive()
            if task.expired:
                task.clear_expiration()
            task.stop()

    def close(self) -> None:
        """Clear the task. Allowed any number of times."""
        if self._task is not None:
            try:
                with translated("clearing the watchdog task"):
                    self._task.close()
            finally:
                self.let_go()

    def let_go(self) -> None:
        """Forget the task without clearing it."""
        if self._task is not None:
            library.let_go(self._task)
            self._task = None

    def _alive(self) -> library.WatchdogTask:
        if self._task is None:
            raise RigError("the watchdog is refused: its task is closed; open a new session")
        return self._task
