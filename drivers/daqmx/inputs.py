"""Analogue inputs of a DAQ device: the task, and the scaling from raw counts to volts."""

from collections.abc import Sequence
from dataclasses import dataclass
from uuid import uuid4

import numpy as np
from nidaqmx.constants import AcquisitionType, DataJustification, TaskMode, TerminalConfiguration
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError
from numpy.typing import NDArray

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.delays import Connected, input_delays
from drivers.daqmx.errors import code_of, is_unsupported, translated
from drivers.daqmx.library import InputChannel
from drivers.daqmx.parameters import AnalogInput, Daq, Wiring
from drivers.errors import DeviceTimeout, RigError


@dataclass(frozen=True)
class InputScaling:
    """Scaling of one input: volts = coefficients[0] + coefficients[1] * counts + coefficients[2] * counts**2 + ...

    The coefficients are those of the device's calibration. Counts from `lowest` to `highest` are valid; outside this
    range, the converter is saturated. `bits` is the size of a raw sample.
    """

    coefficients: tuple[float, ...]
    lowest: int
    highest: int
    bits: int


def scaling_of(channel: InputChannel, terminal: str) -> InputScaling:
    """Scaling of a task's input, as reported by the device. Raises RigError if the device reports no slope."""
    coefficients = tuple(float(c) for c in channel.ai_dev_scaling_coeff)
    if len(coefficients) < 2 or coefficients[1] == 0.0:
        raise RigError(f"{terminal} cannot be scaled: its coefficients are {coefficients}; recalibrate it")
    size = int(channel.ai_raw_samp_size)
    left = channel.ai_raw_samp_justification is DataJustification.LEFT
    return InputScaling(coefficients, *valid_counts(size, round(channel.ai_resolution), left=left), size)


def valid_counts(size: int, resolution: int, *, left: bool) -> tuple[int, int]:
    """Lowest and highest valid count of a signed converter of `resolution` bits whose raw samples have `size` bits.

    The extreme counts are excluded, because the converter is saturated there. `left`: samples are left-justified, so
    that the converter's bits are the upper ones.
    """
    step = 2 ** (size - resolution) if left else 1
    rail = 2 ** (resolution - 1)
    return (1 - rail) * step, (rail - 2) * step


NAME = "rockbench_in"

TERMINAL_CONFIGURATIONS: dict[Wiring, TerminalConfiguration] = {
    "default": TerminalConfiguration.DEFAULT,
    "differential": TerminalConfiguration.DIFF,
    "pseudodifferential": TerminalConfiguration.PSEUDO_DIFF,
    "RSE": TerminalConfiguration.RSE,
    "NRSE": TerminalConfiguration.NRSE,
}


class Inputs:
    """Task of all `inputs`, in the given order; `devices` are the devices of the inputs, in the same order.

    `trigger` and `clock` are the terminals from which the output is started and clocked, by default those of the
    inputs' device; `delays` are the inputs' delays.
    """

    def __init__(
        self,
        connection: Connection,
        daq: Daq,
        inputs: Sequence[AnalogInput],
        rate: float,
        devices: Sequence[Connected],
    ) -> None:
        # shorter than the call's own deadline, so that the device's error, which is more specific than a time-out, is
        # raised
        self._allowance = daq.timeout_margin / 4.0
        mark = uuid4().hex
        self._names = [f"rockbench_{mark}_{k}" for k in range(len(inputs))]
        with translated("creating the input task"):
            self._task = library.task(NAME, connection.options(NAME))
        try:
            with translated("creating the input task"):
                channels = self._add(inputs)
                self.scalings = tuple(
                    scaling_of(channel, given.terminal) for channel, given in zip(channels, inputs, strict=True)
                )
                buffer = round(daq.buffer * rate)
                self._task.timing.cfg_samp_clk_timing(
                    rate, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=buffer
                )
                self._task.in_stream.input_buf_size = buffer
                self.rate = float(self._task.timing.samp_clk_rate)
                self.delays = input_delays(self._task, channels, devices, self.rate)
                trigger, clock = self._terminals()
                self.trigger, self.clock = daq.start_trigger or trigger, daq.clock or clock
                self._reader = library.unscaled_reader(self._task)
            self.dtype = _dtype(self.scalings)
        except BaseException:
            self.close()
            raise
        self._read = self._reader.read_int16 if self.dtype is np.int16 else self._reader.read_int32
        self._raw: NDArray[np.int16 | np.int32] = np.empty((len(inputs), 0), self.dtype)

    def is_owner(self) -> bool:
        """Whether this client still owns the task. A server identifies tasks by name, and the tasks of all clients have
        the same name.
        """
        with translated("checking the owner of the input task"):
            try:
                return list(self._task.channel_names) == self._names
            except DaqError as error:
                if code_of(error) != int(DAQmxErrors.INVALID_TASK):
                    raise
                return False

    def start(self) -> None:
        """Start the sample clock, which also clocks the output."""
        with translated("starting the inputs"):
            self._task.start()

    def read(self, n: int) -> NDArray[np.int16 | np.int32]:
        """The next `n` counts of each input, shape (n, channels); waits for them."""
        if self._raw.shape[1] != n:
            self._raw = np.empty((self._raw.shape[0], n), self.dtype)
        with translated("reading the inputs"):
            got = self._read(self._raw, n, n / self.rate + self._allowance)
        if got != n:
            raise DeviceTimeout(f"reading the inputs failed: {got} of {n} samples received; the run has ended")
        return self._raw.T.copy(order="C")

    def acquired(self) -> int:
        """Samples per input acquired since the start."""
        with translated("reading the number of acquired samples"):
            return int(self._task.in_stream.total_samp_per_chan_acquired)

    def stop(self) -> None:
        """Stop the sample clock."""
        with translated("stopping the inputs"):
            self._task.stop()

    def close(self) -> None:
        """Clear the task."""
        with translated("clearing the input task"):
            self._task.close()

    def _terminals(self) -> tuple[str, str]:
        """Terminals of start trigger and sample clock; the task keeps the timing engine that generates them.

        On a chassis with several engines they are undefined until the task is reserved, unless the engine is set
        (NI-DAQmx help, "cDAQ-91xx and TestScale Chassis Timing Engines").
        """
        task = self._task
        task.control(TaskMode.TASK_RESERVE)
        try:
            terminals = str(task.triggers.start_trigger.term), str(task.timing.samp_clk_term)
            engine = self._engine()
        finally:
            # a watchdog can be started only while no task is reserved
            task.control(TaskMode.TASK_UNRESERVE)
        if engine is not None:
            task.timing.samp_timing_engine = engine
        return terminals

    def _engine(self) -> int | None:
        """The number of the timing engine; None on a device with only one."""
        try:
            return int(self._task.timing.samp_timing_engine)
        except DaqError as error:
            if is_unsupported(error):
                return None
            raise

    def _add(self, inputs: Sequence[AnalogInput]) -> list[InputChannel]:
        return [
            self._task.ai_channels.add_ai_voltage_chan(
                given.terminal, name, TERMINAL_CONFIGURATIONS[given.wiring], -given.range, given.range
            )
            for name, given in zip(self._names, inputs, strict=True)
        ]


def _dtype(scalings: Sequence[InputScaling]) -> type[np.int16] | type[np.int32]:
    widest = max(scaling.bits for scaling in scalings)
    if widest > 32:
        raise RigError(f"the inputs have raw samples of {widest} bits; choose devices with at most 32")
    return np.int16 if widest <= 16 else np.int32
