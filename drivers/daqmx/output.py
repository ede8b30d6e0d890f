"""Drive output: a continuous task that plays each sample once."""

import time
from math import ceil
from typing import Any, cast

import numpy as np
from nidaqmx.constants import AcquisitionType, OutputDataTransferCondition, RegenerationMode
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError, DaqWriteError
from numpy.typing import NDArray

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import code_of, is_unsupported, translated
from drivers.daqmx.parameters import Daq, device_name
from drivers.errors import RigError

NAME = "rockbench_out"

_AHEAD = 2.0
"""Length of the buffer beyond the lead [s]."""
_ZERO_TIME = 0.1
"""Time-out passed to the driver for writing a single value [s]; a value without a sample clock requires no wait."""
_FULL = int(DAQmxErrors.SAMPLES_CAN_NOT_YET_BE_WRITTEN)


class Output:
    """Analogue output of the drive, clocked from the terminal `clock`.

    A new task is created for each run; samples left over from the previous run are discarded.
    """

    def __init__(self, connection: Connection, daq: Daq, clock: str, rate: float, lead: int) -> None:
        self._connection = connection
        self._daq = daq
        self._clock = clock
        self._asked = rate
        self._buffer = lead + ceil(_AHEAD * rate)
        self._task: library.Task | None = None
        self._started = False
        self._prefilled = 0
        self.zero()
        try:
            self._make()
        except BaseException:
            self.clear()
            raise

    def prepare(self, trigger: str) -> None:
        """Set the output to zero and create a new task, which starts on `trigger`."""
        self.clear()
        self.zero()
        task = self._make()
        with translated(f"arming the output on {trigger}"):
            task.triggers.start_trigger.cfg_dig_edge_start_trig(trigger)

    def write(self, volts: NDArray[np.float64]) -> None:
        """Append samples, shape (n,) [V]; waits for free space while playing.

        Raises DriveUnderflow if the output has run out of samples, DeviceTimeout if no space becomes free in time, and
        RigError if samples written before the start exceed the buffer.
        """
        if not self._started and self._prefilled + volts.size > self._buffer:
            raise RigError(
                f"writing {self._prefilled + volts.size} drive samples before the start is refused: the buffer holds "
                f"{self._buffer}; start the output first"
            )
        rest = np.ascontiguousarray(volts, np.float64)
        deadline = time.monotonic() + volts.size / self.rate + self._daq.timeout_margin
        while rest.size:
            rest = rest[self._append(rest, deadline - time.monotonic()) :]
        self._prefilled += volts.size

    def arm(self) -> None:
        """Arm the task on its trigger; samples must have been written."""
        with translated("arming the output"):
            if self._task is not None:
                self._task.start()
        self._started = True

    def zero(self) -> None:
        """Set the output to 0 V now. Raises RigError if another task has reserved it."""
        put_to_zero(self._connection, self._daq)

    def reset_device(self) -> None:
        """Reset the device, which returns outputs and lines to their default states and deletes the device's tasks."""
        with translated("resetting the device of the output"):
            devices = library.system(self._connection.options()).devices
            name = device_name(self._daq.output).lower()
            next(device for device in devices if device.name.lower() == name).reset_device()

    def clear(self) -> None:
        """Stop playing and discard queued samples; the output holds its last value."""
        # a task can be closed only once: nidaqmx releases it even when the driver did not answer
        task, self._task = self._task, None
        self._started, self._prefilled = False, 0
        if task is not None:
            with translated("clearing the output task"):
                task.close()

    def _make(self) -> library.Task:
        """Create the output task and read back its rate."""
        with translated("creating the output task"):
            self._task = task = library.task(NAME, self._connection.options(NAME))
            channel = _add_channel(task, self._daq)
            task.timing.cfg_samp_clk_timing(
                self._asked, self._clock, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=self._buffer
            )
            task.out_stream.regen_mode = RegenerationMode.DONT_ALLOW_REGENERATION
            task.out_stream.output_buf_size = self._buffer
            self.transfer = _transfer_early(channel)
            self.rate = float(task.timing.samp_clk_rate)
            self._writer = library.analog_writer(task, auto_start=False)
        return task

    def _append(self, volts: NDArray[np.float64], remaining: float) -> int:
        """Write samples; returns the number written before the buffer was full or the time-out passed."""
        with translated("writing the drive"):
            try:
                return self._writer.write_many_sample(volts, max(remaining, 0.0))
            except DaqWriteError as error:
                if code_of(error) != _FULL or remaining <= 0.0:
                    raise
                return int(cast(Any, error).samps_per_chan_written)


def put_to_zero(connection: Connection, daq: Daq) -> None:
    """Set the output to 0 V now. Raises RigError if a task has reserved it."""
    with translated("setting the output to 0 V"):
        # the task has no name: a task that a slow server creates after the time-out must not block the next one
        task = library.task("", connection.options())
        try:
            _add_channel(task, daq)
            library.analog_writer(task, auto_start=True).write_many_sample(np.zeros(1), _ZERO_TIME)
        finally:
            task.close()


def _add_channel(task: library.Task, daq: Daq) -> library.OutputChannel:
    limit = daq.output_range
    return task.ao_channels.add_ao_voltage_chan(daq.output, min_val=-limit, max_val=limit)


def _transfer_early(channel: library.OutputChannel) -> str:
    """Make the driver refill the onboard memory as soon as it is half empty; returns a description of the setting.

    Even a deep onboard memory then adds no latency beyond the caller's lead.
    """
    try:
        channel.ao_data_xfer_req_cond = OutputDataTransferCondition.ON_BOARD_MEMORY_HALF_FULL_OR_LESS
    except DaqError as error:
        if not is_unsupported(error):
            raise
        return "device default"
    return "when half empty"
