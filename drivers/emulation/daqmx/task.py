"""A task as the driver keeps it: a name, a state, and the job it does."""

from enum import Enum
from typing import TypeVar

from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.job import Job

J = TypeVar("J", bound=Job)


class State(Enum):
    """Where a task is in the life that DAQmx gives it."""

    IDLE = "nothing is reserved"
    RESERVED = "resources are reserved, samples may wait"
    ARMED = "started, waits for its start trigger"
    RUNNING = "runs"

    @property
    def started(self) -> bool:
        return self in (State.ARMED, State.RUNNING)


class Task:
    """Empty at first; its first channel decides what kind of job it does."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.state = State.IDLE
        self.job: Job | None = None

    @property
    def required_job(self) -> Job:
        """Its job. Raises DaqmxFailure when it has no channel yet."""
        if self.job is None:
            raise DaqmxFailure(
                DAQmxErrors.CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK,
                f"Operation cannot be performed when there are no channels in the task.\n\nTask Name: {self.name}",
            )
        return self.job

    def doing(self, kind: type[J]) -> J:
        """Its job, which must be of this kind. Raises DaqmxFailure when it is another."""
        job = self.required_job
        if not isinstance(job, kind):
            raise DaqmxFailure(
                DAQmxErrors.NO_CHANS_OF_GIVEN_TYPE_IN_TASK,
                f"Task contains no channels of the type that was asked for.\n\nTask Name: {self.name}",
            )
        return job

    def require_stopped(self) -> None:
        """Raise DaqmxFailure when it runs."""
        if self.state.started:
            raise DaqmxFailure(
                DAQmxErrors.CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING,
                f"Specified operation cannot be performed while the task is running.\n\nTask Name: {self.name}",
            )
