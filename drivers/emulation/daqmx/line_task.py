"""What digital input and output tasks have in common: channels of lines, and no clock."""

from collections.abc import Sequence
from dataclasses import dataclass

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.lines import Lines


@dataclass(frozen=True)
class Line:
    """One line: the device it belongs to, and its name."""

    device: str
    name: str


@dataclass(frozen=True)
class LineChannel:
    """One channel: a line, or several that are read or written together."""

    name: str
    lines: tuple[Line, ...]


class LineTask:
    """A `Job` without clock."""

    awaited: str | None = None
    start_terminal: str | None = None
    source: str | None = None
    clock_terminal: str | None = None

    def __init__(self, lines: Lines) -> None:
        self._lines = lines
        self._made: list[LineChannel] = []

    @property
    def channels(self) -> tuple[str, ...]:
        return tuple(channel.name for channel in self._made)

    @property
    def all_lines(self) -> tuple[Line, ...]:
        """Its lines, channel after channel."""
        return tuple(line for channel in self._made for line in channel.lines)

    @property
    def lines_per_channel(self) -> int:
        """Lines of the channel that has most of them."""
        return max(len(channel.lines) for channel in self._made)

    @property
    def devices(self) -> frozenset[str]:
        return frozenset(line.device for line in self.all_lines)

    @property
    def resources(self) -> frozenset[str]:
        return frozenset(line.name for line in self.all_lines)

    def check(self) -> None:
        pass

    def begin(self, tick: int) -> None:
        pass

    def end(self) -> None:
        pass

    def verdict(self) -> None:
        pass


class DigitalInput(LineTask):
    """A `Job` without clock."""

    @property
    def inputs(self) -> list[LineChannel]:
        """Its channels."""
        return self._made

    def read(self) -> bytes:
        """One byte per line as it is now, channel after channel; a channel with fewer lines is filled up with 0."""
        width = self.lines_per_channel
        return b"".join(
            bytes(self._lines.shows(line.name) for line in channel.lines).ljust(width, b"\0") for channel in self.inputs
        )


class DigitalOutput(LineTask):
    """A `Job` without clock."""

    @property
    def outputs(self) -> list[LineChannel]:
        """Its channels."""
        return self._made

    def write(self, levels: Sequence[bool]) -> None:
        """Set all lines, in order. Raises DaqmxFailure when there are more or fewer levels, or the watchdog bars it."""
        if len(levels) != len(self.all_lines):
            raise DaqmxFailure(
                DAQmxErrors.NUM_LINES_MISMATCH_IN_READ_OR_WRITE,
                f"Number of levels does not match the lines.\n\nLevels: {len(levels)}\nLines: {len(self.all_lines)}",
            )
        for line, high in zip(self.all_lines, levels, strict=True):
            self._lines.write(line.device, line.name, high)

    @property
    def levels(self) -> tuple[bool, ...]:
        """The lines as they are."""
        return tuple(self._lines.is_high(line.name) for line in self.all_lines)
