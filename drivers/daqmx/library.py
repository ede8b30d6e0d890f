# pyright: reportUnknownMemberType=false
"""Typed interface to the part of nidaqmx used here; nidaqmx has no type annotations.

`options` selects the driver: None for the driver of this PC, otherwise a session of a gRPC device server.
"""

from collections.abc import Sequence
from typing import Any, Protocol, cast

import nidaqmx
import nidaqmx.system
import numpy as np
from nidaqmx.constants import (
    AcquisitionType,
    DataJustification,
    DigitalWidthUnits,
    Level,
    OutputDataTransferCondition,
    ProductCategory,
    RegenerationMode,
    TaskMode,
    TerminalConfiguration,
    WatchdogAOExpirState,
)
from nidaqmx.grpc_session_options import GrpcSessionOptions
from nidaqmx.stream_readers import AnalogUnscaledReader, DigitalMultiChannelReader
from nidaqmx.stream_writers import AnalogSingleChannelWriter, DigitalSingleChannelWriter
from nidaqmx.system.watchdog import WatchdogTask as NiWatchdogTask
from nidaqmx.types import AOExpirationState, DOExpirationState
from numpy.typing import NDArray

Options = GrpcSessionOptions | None


class Named(Protocol):
    """A device or a channel."""

    @property
    def name(self) -> str: ...


class PhysicalInput(Named, Protocol):
    """An analogue input of a device."""

    @property
    def ai_term_cfgs(self) -> Sequence[TerminalConfiguration]: ...


class Device(Named, Protocol):
    """A DAQ device; reading a property that it lacks raises DaqError."""

    @property
    def product_type(self) -> str: ...
    @property
    def serial_num(self) -> int: ...
    @property
    def is_simulated(self) -> bool: ...
    @property
    def product_category(self) -> ProductCategory: ...
    @property
    def compact_daq_chassis_device(self) -> Named: ...
    @property
    def compact_rio_chassis_device(self) -> Named: ...
    @property
    def ai_physical_chans(self) -> Sequence[PhysicalInput]: ...
    @property
    def ao_physical_chans(self) -> Sequence[Named]: ...
    @property
    def co_physical_chans(self) -> Sequence[Named]: ...
    @property
    def di_lines(self) -> Sequence[Named]: ...
    @property
    def do_lines(self) -> Sequence[Named]: ...
    @property
    def ai_voltage_rngs(self) -> Sequence[float]: ...
    @property
    def ao_voltage_rngs(self) -> Sequence[float]: ...
    @property
    def ai_max_single_chan_rate(self) -> float: ...
    @property
    def ai_max_multi_chan_rate(self) -> float: ...
    @property
    def ai_simultaneous_sampling_supported(self) -> bool: ...
    @property
    def ao_max_rate(self) -> float: ...
    def reset_device(self) -> None: ...


class Version(Protocol):
    @property
    def major_version(self) -> int: ...
    @property
    def minor_version(self) -> int: ...
    @property
    def update_version(self) -> int: ...


class System(Protocol):
    """All devices of a driver."""

    @property
    def devices(self) -> Sequence[Device]: ...
    @property
    def driver_version(self) -> Version: ...


class InputChannel(Protocol):
    """An analogue input of a task."""

    @property
    def ai_dev_scaling_coeff(self) -> Sequence[float]: ...
    @property
    def ai_raw_samp_size(self) -> int: ...
    @property
    def ai_raw_samp_justification(self) -> DataJustification: ...
    @property
    def ai_resolution(self) -> float: ...
    @property
    def ai_filter_delay(self) -> float: ...

    ai_filter_delay_units: DigitalWidthUnits
    ai_remove_filter_delay: bool


class InputChannels(Protocol):
    """The analogue inputs of a task."""

    def add_ai_voltage_chan(
        self,
        physical_channel: str,
        name_to_assign_to_channel: str,
        terminal_config: TerminalConfiguration,
        min_val: float,
        max_val: float,
    ) -> InputChannel: ...


class OutputChannel(Protocol):
    """An analogue output of a task."""

    ao_data_xfer_req_cond: OutputDataTransferCondition


class OutputChannels(Protocol):
    """The analogue outputs of a task."""

    def add_ao_voltage_chan(self, physical_channel: str, *, min_val: float, max_val: float) -> OutputChannel: ...


class LineChannels(Protocol):
    """The digital outputs of a task."""

    def add_do_chan(self, lines: str) -> object: ...


class InputLineChannels(Protocol):
    """The digital inputs of a task."""

    def add_di_chan(self, lines: str) -> object: ...


class CounterChannels(Protocol):
    """The counter outputs of a task, low at rest; a pulse is high for `high_time`, then low for `low_time` [s]."""

    def add_co_pulse_chan_time(
        self, counter: str, *, initial_delay: float, low_time: float, high_time: float
    ) -> object: ...


class Timing(Protocol):
    """The sample clock of a task; `samp_timing_engine` is the number of the engine that generates it."""

    samp_timing_engine: int

    @property
    def samp_clk_rate(self) -> float: ...
    @property
    def samp_clk_term(self) -> str: ...
    @property
    def ai_conv_rate(self) -> float: ...
    def __getitem__(self, device: str) -> "Timing": ...
    def cfg_samp_clk_timing(
        self, rate: float, source: str = "", *, sample_mode: AcquisitionType, samps_per_chan: int
    ) -> None: ...
    def cfg_implicit_timing(self, *, sample_mode: AcquisitionType, samps_per_chan: int) -> None: ...


class StartTrigger(Protocol):
    @property
    def term(self) -> str: ...
    def cfg_dig_edge_start_trig(self, trigger_source: str) -> None: ...


class Triggers(Protocol):
    @property
    def start_trigger(self) -> StartTrigger: ...


class InStream(Protocol):
    """The buffer of an input task, and the number of samples acquired."""

    input_buf_size: int

    @property
    def total_samp_per_chan_acquired(self) -> int: ...


class OutStream(Protocol):
    """The buffer of an output task."""

    output_buf_size: int
    regen_mode: RegenerationMode

    @property
    def curr_write_pos(self) -> int: ...


class Task(Named, Protocol):
    @property
    def channel_names(self) -> Sequence[str]: ...
    @property
    def ai_channels(self) -> InputChannels: ...
    @property
    def ao_channels(self) -> OutputChannels: ...
    @property
    def co_channels(self) -> CounterChannels: ...
    @property
    def di_channels(self) -> InputLineChannels: ...
    @property
    def do_channels(self) -> LineChannels: ...
    @property
    def timing(self) -> Timing: ...
    @property
    def triggers(self) -> Triggers: ...
    @property
    def in_stream(self) -> InStream: ...
    @property
    def out_stream(self) -> OutStream: ...
    def control(self, action: TaskMode) -> None: ...
    def start(self) -> None: ...
    def stop(self) -> None: ...
    def close(self) -> None: ...


class WatchdogTask(Protocol):
    expir_trig_trig_on_network_conn_loss: bool

    @property
    def expired(self) -> bool: ...
    def cfg_watchdog_do_expir_states(self, expiration_states: Sequence[DOExpirationState]) -> object: ...
    def cfg_watchdog_ao_expir_states(self, expiration_states: Sequence[AOExpirationState]) -> object: ...
    def clear_expiration(self) -> None: ...
    def reset_timer(self) -> None: ...
    def start(self) -> None: ...
    def stop(self) -> None: ...
    def close(self) -> None: ...


class UnscaledReader(Protocol):
    """Reads counts into an array of shape (channels, n); returns the number of samples per channel."""

    def read_int16(self, data: NDArray[Any], number_of_samples_per_channel: int, timeout: float) -> int: ...
    def read_int32(self, data: NDArray[Any], number_of_samples_per_channel: int, timeout: float) -> int: ...


class AnalogWriter(Protocol):
    """Writes volts, shape (n,); returns the number of samples written."""

    def write_many_sample(self, data: NDArray[np.float64], timeout: float) -> int: ...


class LinesReader(Protocol):
    """Reads the present levels of digital lines, one per channel, into an array of bool, shape (channels,)."""

    def read_one_sample_one_line(self, data: NDArray[np.bool_], timeout: float) -> object: ...


class LineWriter(Protocol):
    """Writes the state of one digital line."""

    def write_one_sample_one_line(self, data: bool, timeout: float) -> object: ...


def system(options: Options) -> System:
    """Properties of the driver and its devices."""
    return cast(System, nidaqmx.system.System(options))


def task(name: str, options: Options) -> Task:
    """A new task, or the existing task of this name if `options` requests attaching to it."""
    return cast(Task, nidaqmx.Task(name, grpc_options=options))


def watchdog_task(device: str, name: str, timeout: float, options: Options) -> WatchdogTask:
    """The watchdog of a device; it expires `timeout` seconds after its last reset."""
    return cast(WatchdogTask, cast(Any, NiWatchdogTask)(device, name, timeout, options))


def let_go(task: WatchdogTask) -> None:
    """Drop the object of a watchdog that must not be closed because another client owns it or its device is lost."""
    # nidaqmx has no public method for this and warns about every watchdog not closed
    cast(Any, task)._handle = None


def goes_low(line: str) -> DOExpirationState:
    """Expiration state that sets a line low."""
    return DOExpirationState(physical_channel=line, expiration_state=Level.LOW)


def goes_to_zero(output: str) -> AOExpirationState:
    """Expiration state that sets an analogue output to 0 V."""
    return AOExpirationState(physical_channel=output, expiration_state=0.0, output_type=WatchdogAOExpirState.VOLTAGE)


def unscaled_reader(task: Task) -> UnscaledReader:
    """Reader of a task's inputs. The caller ensures the array's shape, since checking it would cost an extra call."""
    reader = AnalogUnscaledReader(task.in_stream)
    reader.verify_array_shape = False
    return cast(UnscaledReader, reader)


def analog_writer(task: Task, *, auto_start: bool) -> AnalogWriter:
    writer = cast(Any, AnalogSingleChannelWriter)(task.out_stream, auto_start)
    writer.verify_array_shape = False
    return cast(AnalogWriter, writer)


def lines_reader(task: Task) -> LinesReader:
    """Reader of a task's lines; a read starts a task that is not running, and stops it again."""
    reader = DigitalMultiChannelReader(task.in_stream)
    reader.verify_array_shape = False
    return cast(LinesReader, reader)


def line_writer(task: Task) -> LineWriter:
    """Writer of a task's line; a write starts a task that is not running."""
    return cast(LineWriter, cast(Any, DigitalSingleChannelWriter)(task.out_stream, True))
