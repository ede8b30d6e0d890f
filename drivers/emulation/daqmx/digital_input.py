"""Digital input tasks: lines that are looked at when they are read."""

from drivers.emulation.daqmx.digital_output import LineChannel
from drivers.emulation.daqmx.lines import Lines


class DigitalInput:
    """A `Job` without clock."""

    awaited: str | None = None
    start_terminal: str | None = None
    source: str | None = None
    clock_terminal: str | None = None

    def __init__(self, lines: Lines) -> None:
        self._lines = lines
        self.inputs: list[LineChannel] = []

    @property
    def channels(self) -> tuple[str, ...]:
        return tuple(channel.name for channel in self.inputs)

    @property
    def lines_per_channel(self) -> int:
        """Lines of the channel that has most of them."""
        return max(len(channel.lines) for channel in self.inputs)

    @property
    def devices(self) -> frozenset[str]:
        return frozenset(line.device for channel in self.inputs for line in channel.lines)

    @property
    def resources(self) -> frozenset[str]:
        return frozenset(line.name for channel in self.inputs for line in channel.lines)

    def check(self) -> None:
        pass

    def begin(self, tick: int) -> None:
        pass

    def end(self) -> None:
        pass

    def verdict(self) -> None:
        pass

    def read(self) -> bytes:
        """One byte per line as it is now, channel after channel; a channel with fewer lines is filled up with 0."""
        width = self.lines_per_channel
        return b"".join(
            bytes(self._lines.shows(line.name) for line in channel.lines).ljust(width, b"\0") for channel in self.inputs
        )
