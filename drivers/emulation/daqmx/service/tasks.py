"""Calls about the life of tasks."""

# ruff: noqa: ARG002 - gRPC gives every call a context, needed or not

from collections.abc import Mapping

from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import TaskMode
from session_pb2 import (
    SESSION_INITIALIZATION_BEHAVIOR_ATTACH_TO_EXISTING,
    SESSION_INITIALIZATION_BEHAVIOR_INITIALIZE_NEW,
    Session,
)

from drivers.emulation.daqmx.catalogue import flattened
from drivers.emulation.daqmx.service.base import Service, attribute_of, unsupported
from drivers.emulation.daqmx.task import State, Task


class TaskService(Service):
    """CreateTask, ClearTask, StartTask, StopTask, TaskControl, IsTaskDone, GetTaskAttribute..."""

    def CreateTask(self, request: pb.CreateTaskRequest, context: object) -> pb.CreateTaskResponse:
        task, new = self.opened(request.session_name, request.initialization_behavior)
        return pb.CreateTaskResponse(task=Session(name=task.name), new_session_initialized=new)

    def ClearTask(self, request: pb.ClearTaskRequest, context: object) -> pb.ClearTaskResponse:
        self._driver.clear(self._task(request))
        return pb.ClearTaskResponse()

    def StartTask(self, request: pb.StartTaskRequest, context: object) -> pb.StartTaskResponse:
        self._driver.start(self._task(request))
        return pb.StartTaskResponse()

    def StopTask(self, request: pb.StopTaskRequest, context: object) -> pb.StopTaskResponse:
        self._driver.stop(self._task(request))
        return pb.StopTaskResponse()

    def TaskControl(self, request: pb.TaskControlRequest, context: object) -> pb.TaskControlResponse:
        task = self._task(request)
        match TaskMode(request.action_raw or request.action):
            case TaskMode.TASK_START:
                self._driver.start(task)
            case TaskMode.TASK_STOP | TaskMode.TASK_ABORT | TaskMode.TASK_UNRESERVE:
                self._driver.stop(task)
            case TaskMode.TASK_RESERVE | TaskMode.TASK_COMMIT:
                self._driver.reserve(task)
            case TaskMode.TASK_VERIFY:
                task.required_job.check()
        return pb.TaskControlResponse()

    def IsTaskDone(self, request: pb.IsTaskDoneRequest, context: object) -> pb.IsTaskDoneResponse:
        return pb.IsTaskDoneResponse(is_task_done=not self._task(request).state.started)

    def GetTaskAttributeString(
        self, request: pb.GetTaskAttributeStringRequest, context: object
    ) -> pb.GetTaskAttributeStringResponse:
        task = self._task(request)
        job = task.job
        values: Mapping[int, str] = {
            pb.TASK_ATTRIBUTE_NAME: task.name,
            pb.TASK_ATTRIBUTE_CHANNELS: flattened(job.channels) if job else "",
            pb.TASK_ATTRIBUTE_DEVICES: flattened(sorted(job.devices)) if job else "",
        }
        if (attribute := attribute_of(request)) not in values:
            raise unsupported(attribute)
        return pb.GetTaskAttributeStringResponse(value=values[attribute])

    def GetTaskAttributeUInt32(
        self, request: pb.GetTaskAttributeUInt32Request, context: object
    ) -> pb.GetTaskAttributeUInt32Response:
        job = self._task(request).job
        values: Mapping[int, int] = {
            pb.TASK_ATTRIBUTE_NUM_CHANS: len(job.channels) if job else 0,
            pb.TASK_ATTRIBUTE_NUM_DEVICES: len(job.devices) if job else 0,
        }
        if (attribute := attribute_of(request)) not in values:
            raise unsupported(attribute)
        return pb.GetTaskAttributeUInt32Response(value=values[attribute])

    def GetTaskAttributeBool(
        self, request: pb.GetTaskAttributeBoolRequest, context: object
    ) -> pb.GetTaskAttributeBoolResponse:
        if (attribute := attribute_of(request)) != pb.TASK_ATTRIBUTE_COMPLETE:
            raise unsupported(attribute)
        return pb.GetTaskAttributeBoolResponse(value=self._task(request).state in (State.IDLE, State.RESERVED))

    def opened(self, name: str, behavior: int) -> tuple[Task, bool]:
        """The session that a client wants, and whether it is new."""
        return self._driver.create(
            name,
            may_attach=behavior != SESSION_INITIALIZATION_BEHAVIOR_INITIALIZE_NEW,
            may_create=behavior != SESSION_INITIALIZATION_BEHAVIOR_ATTACH_TO_EXISTING,
        )
