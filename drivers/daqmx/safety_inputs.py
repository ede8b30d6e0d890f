"""The safety inputs: contacts of emergency stop, over-travel switches and amplifier, read together in one call."""

from collections.abc import Mapping

import numpy as np

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import translated
from drivers.daqmx.parameters import SafetyInput

NAME = "rockbench_safety"

_TIME = 0.1
"""Time for reading the lines, which never have to be waited for [s]."""


class SafetyInputs:
    """One task without clock for all lines: a read gives their levels at that moment, so nothing can be stale."""

    def __init__(self, connection: Connection, wired: Mapping[str, SafetyInput]) -> None:
        self._names = tuple(wired)
        self._good = np.array([given.good == "high" for given in wired.values()])
        with translated("making the task of the safety inputs"):
            self._task = library.task(NAME, connection.options(NAME))
        try:
            with translated("making the task of the safety inputs"):
                for given in wired.values():
                    self._task.di_channels.add_di_chan(given.line)
                self._reader = library.lines_reader(self._task)
        except BaseException:
            self.close()
            raise

    def start(self) -> None:
        """Keep the lines, so that a read need not start and stop the task each time."""
        with translated("starting the safety inputs"):
            self._task.start()

    def read(self) -> dict[str, bool]:
        """Whether each is good now. Raises RigError; then nothing is known of any."""
        # what the device does not fill is open
        levels = ~self._good
        with translated("reading the safety inputs"):
            self._reader.read_one_sample_one_line(levels, _TIME)
        return dict(zip(self._names, (levels == self._good).tolist(), strict=True))

    def stop(self) -> None:
        """Let go of the lines; they can still be read."""
        with translated("stopping the safety inputs"):
            self._task.stop()

    def close(self) -> None:
        """Clear the task."""
        with translated("clearing the task of the safety inputs"):
            self._task.close()
