"""What digital input and output tasks have in common: channels of lines, and no clock."""

from dataclasses import dataclass

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
