"""Which DAQ devices there are, and what they can do."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from nidaqmx.errors import DaqError

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.errors import is_unsupported, translated

_PATIENCE = 5.0
"""Time for a call to a server [s]: the driver behind it may have to load."""

T = TypeVar("T")


@dataclass(frozen=True)
class FoundDevice:
    """One device or module. Ranges are (lowest, highest) pairs [V]; rates [1/s] are None where there is no such thing.

    `lines` are those that can be digital outputs, `input_lines` those that can be digital inputs.
    `input_rate` is the most for one channel; `total_input_rate` is shared by all channels unless `simultaneous`.
    """

    name: str
    product: str
    serial: str
    simulated: bool
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    lines: tuple[str, ...]
    input_lines: tuple[str, ...]
    input_ranges: tuple[tuple[float, float], ...]
    output_ranges: tuple[tuple[float, float], ...]
    input_rate: float | None
    total_input_rate: float | None
    simultaneous: bool
    output_rate: float | None

    @property
    def identity(self) -> str:
        """Product and serial number in one line."""
        return f"{self.product}, serial number {self.serial}{', simulated' if self.simulated else ''}"

    def highest_input_rate(self, channels: int) -> float | None:
        """Samples per second and channel when `channels` of this device are read."""
        if self.input_rate is None or self.total_input_rate is None or self.simultaneous:
            return self.input_rate
        return min(self.input_rate, self.total_input_rate / channels)


def find_devices(server: str | None) -> list[FoundDevice]:
    """The devices of this PC, or of the gRPC device server at `server` (host:port).

    Raises DeviceNotFound when there is no driver or no server.
    """
    connection = Connection(server, _PATIENCE)
    try:
        with translated("looking for devices"):
            return [described(device) for device in library.system(connection.options()).devices]
    finally:
        connection.close()


def described(device: library.Device) -> FoundDevice:
    """What a device says of itself."""
    inputs = tuple(channel.name for channel in device.ai_physical_chans)
    outputs = tuple(channel.name for channel in device.ao_physical_chans)
    serial = int(device.serial_num)
    return FoundDevice(
        name=device.name,
        product=str(device.product_type),
        serial=f"{serial:08X}" if serial else "none",
        simulated=bool(device.is_simulated),
        inputs=inputs,
        outputs=outputs,
        lines=tuple(line.name for line in device.do_lines),
        input_lines=tuple(line.name for line in device.di_lines),
        input_ranges=_pairs(device.ai_voltage_rngs) if inputs else (),
        output_ranges=_pairs(device.ao_voltage_rngs) if outputs else (),
        input_rate=_where_supported(lambda: float(device.ai_max_single_chan_rate)) if inputs else None,
        total_input_rate=_where_supported(lambda: float(device.ai_max_multi_chan_rate)) if inputs else None,
        simultaneous=bool(inputs) and bool(_where_supported(lambda: device.ai_simultaneous_sampling_supported)),
        output_rate=_where_supported(lambda: float(device.ao_max_rate)) if outputs else None,
    )


def _pairs(flat: Sequence[float]) -> tuple[tuple[float, float], ...]:
    """DAQmx gives low, high, low, high, ..."""
    values = [float(value) for value in flat]
    return tuple(zip(values[::2], values[1::2], strict=True))


def _where_supported(ask: Callable[[], T]) -> T | None:
    try:
        return ask()
    except DaqError as error:
        if is_unsupported(error):
            return None
        raise
