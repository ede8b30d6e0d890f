"""The heartbeat line: an external relay in the enable chain stays closed only as long as this line goes up and down.

It needs no watchdog in the device, and stands still whenever the loop does.
"""

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import translated

NAME = "rockbench_heartbeat"

_TIME = 0.1
"""Time for writing a line, which never has to wait [s]."""


class Heartbeat:
    """The line is low after the constructor, and its task at rest."""

    def __init__(self, connection: Connection, line: str) -> None:
        with translated("making the task of the heartbeat line"):
            self._task = library.task(NAME, connection.options(NAME))
        try:
            with translated("making the task of the heartbeat line"):
                self._task.do_channels.add_do_chan(line)
                self._writer = library.line_writer(self._task)
            self.rest()
        except BaseException:
            self.close()
            raise

    def beat(self) -> None:
        """Turn the line over; the first beat after a rest is a rising edge."""
        with translated("turning the heartbeat line over"):
            self._writer.write_one_sample_one_line(not self._high, _TIME)
        self._high = not self._high

    def rest(self) -> None:
        """Low, and let go of the line, which keeps its state."""
        self._high = False
        with translated("putting the heartbeat line to rest"):
            self._writer.write_one_sample_one_line(False, _TIME)
            self._task.stop()

    def close(self) -> None:
        """Clear the task."""
        with translated("clearing the task of the heartbeat line"):
            self._task.close()
