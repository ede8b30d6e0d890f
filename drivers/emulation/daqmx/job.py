"""What tasks do, whatever kind they are."""

from typing import Protocol


class Job(Protocol):
    """The inner side of a task: channels, timing, and what happens from its start to its end."""

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels."""
        ...

    @property
    def devices(self) -> frozenset[str]:
        """Names of the devices that it uses."""
        ...

    @property
    def resources(self) -> frozenset[str]:
        """What nobody else may use while it is reserved."""
        ...

    @property
    def awaited(self) -> str | None:
        """The terminal of the start trigger that it waits for."""
        ...

    @property
    def start_terminal(self) -> str | None:
        """The terminal on which its own start can be seen."""
        ...

    @property
    def source(self) -> str | None:
        """The terminal of the sample clock that it follows; None when it has its own, or none."""
        ...

    @property
    def clock_terminal(self) -> str | None:
        """The terminal on which its own sample clock can be seen."""
        ...

    def check(self) -> None:
        """Raise DaqmxFailure when it could not start as it is."""
        ...

    def begin(self, tick: int) -> None:
        """Start; what is clocked has its first sample at `tick`, the next one."""
        ...

    def end(self) -> None:
        """Stop, from any state."""
        ...

    def verdict(self) -> None:
        """Raise DaqmxFailure when the run that has ended had failed."""
        ...
