"""The enable line: a relay that lets the amplifier drive the shaker. Low is open, and open is safe."""

from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError, Error

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import code_of, translated
from drivers.errors import RigError

NAME = "rockbench_enable"

_TIME = 0.1
"""Time for writing a line, which never has to wait [s]."""
_BARKED = int(DAQmxErrors.WRITE_FAILED_BECAUSE_WATCHDOG_EXPIRED)


class EnableLine:
    """The digital line of the relay. It is open after the constructor, and its task at rest."""

    def __init__(self, connection: Connection, line: str) -> None:
        with translated("making the task of the enable line"):
            self._task = library.task(NAME, connection.options(NAME))
        try:
            with translated("making the task of the enable line"):
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
        """Open the relay in one call; from any thread. Whether the device confirmed it."""
        try:
            self._writer.write_one_sample_one_line(False, _TIME)
        except DaqError as error:
            return code_of(error) == _BARKED
        except (Error, ValueError):
            # gRPC raises ValueError when the channel was closed meanwhile
            return False
        return True

    def open(self) -> None:
        """Open the relay, and let go of the line, which keeps its state."""
        try:
            with translated("opening the enable relay"):
                self._write_open()
        except RigError as error:
            error.args = (f"{error}; the relay may be closed: press the emergency stop",)
            raise
        with translated("letting go of the enable relay, which is open,"):
            self._task.stop()

    def close(self) -> None:
        """Clear the task."""
        with translated("clearing the task of the enable line"):
            self._task.close()

    def _write_open(self) -> None:
        try:
            self._writer.write_one_sample_one_line(False, _TIME)
        except DaqError as error:
            # the watchdog has opened it already and lets nobody write
            if code_of(error) != _BARKED:
                raise
