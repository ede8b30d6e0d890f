"""Digital lines of a device, and tasks that read or set them."""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.counter import Edges
from drivers.emulation.daqmx.errors import DaqmxFailure


@dataclass(frozen=True)
class Wires:
    """Wiring by name: receivers of an output line's level (`listeners`) and of a counter's edges (`counters`), and
    sources of an input line's level (`shown`).
    """

    listeners: Mapping[str, Callable[[bool], None]] = field(default_factory=dict[str, Callable[[bool], None]])
    shown: Mapping[str, Callable[[], bool]] = field(default_factory=dict[str, Callable[[], bool]])
    counters: Mapping[str, Edges] = field(default_factory=dict[str, Edges])


class Lines:
    """Levels by line name. Outputs are low at power-up, and unwired inputs are pulled down.

    The levels have their own lock, because a watchdog may expire at any time.
    """

    def __init__(self, wires: Wires) -> None:
        self._wires = wires
        self._high: set[str] = set()
        self._expired: dict[str, tuple[dict[str, bool], DAQmxErrors]] = {}
        self._lock = threading.Lock()

    def is_high(self, line: str) -> bool:
        """The level to which a line was set."""
        return line in self._high

    def shows(self, line: str) -> bool:
        """The level of a line: that of its wired source, otherwise the level to which it was set."""
        shown = self._wires.shown.get(line)
        return line in self._high if shown is None else shown()

    def write(self, device: str, line: str, high: bool) -> None:
        """Set a line. Raises DaqmxFailure while the watchdog of its device has expired."""
        with self._lock:
            if device in self._expired:
                raise DaqmxFailure(
                    self._expired[device][1],
                    "Write cannot be performed, because the watchdog timer of the device has expired.\n\n"
                    f"Device: {device}",
                )
            self._set(line, high)

    def expire(self, device: str, states: dict[str, bool], error: DAQmxErrors) -> None:
        """Set the lines of a device whose watchdog has expired to `states`, and reject writes with `error`."""
        with self._lock:
            self._expired[device] = {line: line in self._high for line in states}, error
            for line, high in states.items():
                self._set(line, high)

    def release(self, device: str) -> None:
        """Permit writes again; the lines return to the levels written last, the worst case for a client."""
        with self._lock:
            if device in self._expired:
                for line, high in self._expired.pop(device)[0].items():
                    self._set(line, high)

    def reset(self, device: str, names: tuple[str, ...]) -> None:
        """Set all lines of a device to their power-up state."""
        with self._lock:
            self._expired.pop(device, None)
            for line in names:
                self._set(line, False)

    def _set(self, line: str, high: bool) -> None:
        (self._high.add if high else self._high.discard)(line)
        if (told := self._wires.listeners.get(line)) is not None:
            told(high)


@dataclass(frozen=True)
class Line:
    """One line: its device, its name, and the lines that share its direction."""

    device: str
    name: str
    group: str


@dataclass(frozen=True)
class LineChannel:
    """One channel: a line, or several lines read or written together."""

    name: str
    lines: tuple[Line, ...]


class LineTask:
    """`Job` of a task of digital lines, without a clock."""

    outwards: bool
    """Whether the lines of the task are outputs."""
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
        """The lines of all channels, channel by channel."""
        return tuple(line for channel in self._made for line in channel.lines)

    @property
    def lines_per_channel(self) -> int:
        """Number of lines of the largest channel."""
        return max(len(channel.lines) for channel in self._made)

    @property
    def devices(self) -> frozenset[str]:
        return frozenset(line.device for line in self.all_lines)

    @property
    def resources(self) -> frozenset[str]:
        return frozenset(line.name for line in self.all_lines)

    @property
    def groups(self) -> frozenset[str]:
        """The direction groups of the task's lines."""
        return frozenset(line.group for line in self.all_lines)

    def engage(self, is_free: Callable[[str], bool]) -> None:
        pass

    def check(self) -> None:
        pass

    def begin(self, tick: int) -> None:
        pass

    def end(self) -> None:
        pass

    def verdict(self) -> None:
        pass


class DigitalInput(LineTask):
    """`Job` of a task of digital inputs, without a clock."""

    outwards = False

    @property
    def inputs(self) -> list[LineChannel]:
        """The channels of the task."""
        return self._made

    def read(self) -> bytes:
        """The present levels, one byte per line, channel by channel; shorter channels are padded with 0."""
        width = self.lines_per_channel
        return b"".join(
            bytes(self._lines.shows(line.name) for line in channel.lines).ljust(width, b"\0") for channel in self.inputs
        )


class DigitalOutput(LineTask):
    """`Job` of a task of digital outputs, without a clock."""

    outwards = True

    @property
    def outputs(self) -> list[LineChannel]:
        """The channels of the task."""
        return self._made

    def write(self, levels: Sequence[bool]) -> None:
        """Set all lines, in order. Raises DaqmxFailure for a wrong number of levels or an expired watchdog."""
        if len(levels) != len(self.all_lines):
            raise DaqmxFailure(
                DAQmxErrors.NUM_LINES_MISMATCH_IN_READ_OR_WRITE,
                f"Number of levels does not match the lines.\n\nLevels: {len(levels)}\nLines: {len(self.all_lines)}",
            )
        for line, high in zip(self.all_lines, levels, strict=True):
            self._lines.write(line.device, line.name, high)

    @property
    def levels(self) -> tuple[bool, ...]:
        return tuple(self._lines.is_high(line.name) for line in self.all_lines)
