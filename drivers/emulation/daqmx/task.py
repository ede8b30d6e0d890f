"""Tasks of the driver: states, and the interface of the job of each kind of task."""

from collections.abc import Callable
from enum import Enum
from typing import Protocol, TypeVar

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure


class Job(Protocol):
    """Work of a task: its channels, its timing, and its start, stop and state."""

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels."""
        ...

    @property
    def devices(self) -> frozenset[str]:
        """Names of the devices in use."""
        ...

    @property
    def resources(self) -> frozenset[str]:
        """Resources reserved exclusively."""
        ...

    @property
    def awaited(self) -> str | None:
        """The terminal of the awaited start trigger; None if there is no trigger."""
        ...

    @property
    def start_terminal(self) -> str | None:
        """The terminal of the job's own start signal."""
        ...

    @property
    def source(self) -> str | None:
        """The terminal of the external sample clock; None for a job with its own clock or without a clock."""
        ...

    @property
    def clock_terminal(self) -> str | None:
        """The terminal of the job's own sample clock."""
        ...

    def engage(self, is_free: Callable[[str], bool]) -> None:
        """Choose resources as the driver does when it reserves the task; `is_free` returns whether one is available."""
        ...

    def check(self) -> None:
        """Raise DaqmxFailure if the job cannot start."""
        ...

    def begin(self, tick: int) -> None:
        """Start; the first sample of clocked channels is at `tick`, the next tick."""
        ...

    def end(self) -> None:
        """Stop, from any state."""
        ...

    def verdict(self) -> None:
        """Raise DaqmxFailure if the run that ended has failed."""
        ...


J = TypeVar("J", bound=Job)


class State(Enum):
    """State of a task in the DAQmx task state model."""

    IDLE = "nothing is reserved"
    RESERVED = "resources are reserved, samples may be buffered"
    ARMED = "started, waiting for its start trigger"
    RUNNING = "runs"

    @property
    def started(self) -> bool:
        return self in (State.ARMED, State.RUNNING)


class Task:
    """A task, empty at first; its first channel determines the kind of job."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.state = State.IDLE
        self.job: Job | None = None

    @property
    def required_job(self) -> Job:
        """The task's job. Raises DaqmxFailure for a task without channels."""
        if self.job is None:
            raise DaqmxFailure(
                DAQmxErrors.CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK,
                f"Operation cannot be performed when there are no channels in the task.\n\nTask Name: {self.name}",
            )
        return self.job

    def doing(self, kind: type[J]) -> J:
        """The task's job. Raises DaqmxFailure if it is not of this kind."""
        job = self.required_job
        if not isinstance(job, kind):
            raise DaqmxFailure(
                DAQmxErrors.NO_CHANS_OF_GIVEN_TYPE_IN_TASK,
                f"Task contains no channels of the requested type.\n\nTask Name: {self.name}",
            )
        return job

    def require_stopped(self) -> None:
        """Raise DaqmxFailure while the task runs."""
        if self.state.started:
            raise DaqmxFailure(
                DAQmxErrors.CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING,
                f"Specified operation cannot be performed while the task is running.\n\nTask Name: {self.name}",
            )
