"""The analogue inputs: one continuous task, read as raw counts."""

from collections.abc import Sequence
from uuid import uuid4

import numpy as np
from nidaqmx.constants import AcquisitionType, TerminalConfiguration
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError
from numpy.typing import NDArray

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import code_of, translated
from drivers.daqmx.parameters import AnalogInput, Daq, Wiring
from drivers.daqmx.scaling import InputScaling, scaling_of
from drivers.errors import DeviceTimeout, RigError

NAME = "rockbench_in"

TERMINAL_CONFIGURATIONS: dict[Wiring, TerminalConfiguration] = {
    "default": TerminalConfiguration.DEFAULT,
    "differential": TerminalConfiguration.DIFF,
    "pseudodifferential": TerminalConfiguration.PSEUDO_DIFF,
    "RSE": TerminalConfiguration.RSE,
    "NRSE": TerminalConfiguration.NRSE,
}


class Inputs:
    """All inputs in one task, in the order given. The output starts on `trigger` and is clocked from `clock`.

    Both are the terminals that the device gives for its inputs, unless the configuration names others.
    """

    def __init__(self, connection: Connection, daq: Daq, inputs: Sequence[AnalogInput], rate: float) -> None:
        # the device says more of what is wrong than a deadline does, so it comes first
        self._allowance = daq.patience / 4.0
        mark = uuid4().hex
        self._names = [f"rockbench_{mark}_{k}" for k in range(len(inputs))]
        with translated("making the input task"):
            self._task = library.task(NAME, connection.options(NAME))
        try:
            with translated("making the input task"):
                self.scalings = self._add(inputs)
                buffer = round(daq.buffer * rate)
                self._task.timing.cfg_samp_clk_timing(
                    rate, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=buffer
                )
                self._task.in_stream.input_buf_size = buffer
                self.rate = float(self._task.timing.samp_clk_rate)
                self.trigger = daq.start_trigger or str(self._task.triggers.start_trigger.term)
                self.clock = daq.clock or str(self._task.timing.samp_clk_term)
                self._reader = library.unscaled_reader(self._task)
            self.dtype = _dtype(self.scalings)
        except BaseException:
            self.close()
            raise
        self._read = self._reader.read_int16 if self.dtype is np.int16 else self._reader.read_int32
        self._raw: NDArray[np.int16 | np.int32] = np.empty((len(inputs), 0), self.dtype)

    def are_ours(self) -> bool:
        """Whether no other client has taken the device. A server knows tasks by name, and the other's has ours."""
        with translated("asking whose the input task is"):
            try:
                return list(self._task.channel_names) == self._names
            except DaqError as error:
                if code_of(error) != int(DAQmxErrors.INVALID_TASK):
                    raise
                return False

    def start(self) -> None:
        """Start the sample clock, of the output as well."""
        with translated("starting the inputs"):
            self._task.start()

    def read(self, n: int) -> NDArray[np.int16 | np.int32]:
        """The next `n` counts of each input, shape (n, channels); waits for them."""
        if self._raw.shape[1] != n:
            self._raw = np.empty((self._raw.shape[0], n), self.dtype)
        with translated("reading the inputs"):
            got = self._read(self._raw, n, n / self.rate + self._allowance)
        if got != n:
            raise DeviceTimeout(f"reading the inputs failed: {got} of {n} samples came; the run is over")
        return self._raw.T.copy(order="C")

    def acquired(self) -> int:
        """How many samples per input the device has taken since the start."""
        with translated("asking how far the inputs are"):
            return int(self._task.in_stream.total_samp_per_chan_acquired)

    def stop(self) -> None:
        """Stop the sample clock."""
        with translated("stopping the inputs"):
            self._task.stop()

    def close(self) -> None:
        """Clear the task."""
        with translated("clearing the input task"):
            self._task.close()

    def _add(self, inputs: Sequence[AnalogInput]) -> tuple[InputScaling, ...]:
        channels = [
            self._task.ai_channels.add_ai_voltage_chan(
                given.terminal, name, TERMINAL_CONFIGURATIONS[given.wiring], -given.range, given.range
            )
            for name, given in zip(self._names, inputs, strict=True)
        ]
        return tuple(scaling_of(channel, given.terminal) for channel, given in zip(channels, inputs, strict=True))


def _dtype(scalings: Sequence[InputScaling]) -> type[np.int16] | type[np.int32]:
    widest = max(scaling.bits for scaling in scalings)
    if widest > 32:
        raise RigError(f"the inputs have raw samples of {widest} bits and 32 is the most that can be read")
    return np.int16 if widest <= 16 else np.int32
