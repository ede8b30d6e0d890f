"""Handlers of calls that manage tasks, read and write digital lines, and control watchdogs."""

# ruff: noqa: ARG002 - gRPC passes a context to every call

from collections.abc import Mapping

from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import Level, TaskMode, WDTTaskAction
from nidaqmx.error_codes import DAQmxErrors
from session_pb2 import (
    SESSION_INITIALIZATION_BEHAVIOR_ATTACH_TO_EXISTING,
    SESSION_INITIALIZATION_BEHAVIOR_INITIALIZE_NEW,
    Session,
)

from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated
from drivers.emulation.daqmx.lines import DigitalInput, DigitalOutput
from drivers.emulation.daqmx.models import flattened, unflattened
from drivers.emulation.daqmx.service.base import Service, attribute_of, unsupported
from drivers.emulation.daqmx.task import State, Task
from drivers.emulation.daqmx.watchdog import Watchdog


class TaskService(Service):
    """Handlers of CreateTask, ClearTask, StartTask, StopTask, TaskControl, IsTaskDone and GetTaskAttribute..."""

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
        """The requested session, and whether it is new. Raises the errors of `Driver.create`."""
        return self._driver.create(
            name,
            may_attach=behavior != SESSION_INITIALIZATION_BEHAVIOR_INITIALIZE_NEW,
            may_create=behavior != SESSION_INITIALIZATION_BEHAVIOR_ATTACH_TO_EXISTING,
        )


class LineService(Service):
    """Handlers of WriteDigitalLines and ReadDigitalLines, with one byte per line."""

    def WriteDigitalLines(self, request: pb.WriteDigitalLinesRequest, context: object) -> pb.WriteDigitalLinesResponse:
        task = self._task(request)
        job = task.doing(DigitalOutput)
        if request.num_samps_per_chan != 1:
            raise NotEmulated("a digital output with a sample clock")
        with self._driver.changed:
            if not task.state.started:
                if not request.auto_start:
                    raise DaqmxFailure(
                        DAQmxErrors.CANNOT_WRITE_WHEN_AUTO_START_FALSE_AND_TASK_NOT_RUNNING,
                        "Write cannot be performed when the auto start input is false and the task is not running.",
                    )
                self._driver.start(task)
            job.write([bool(level) for level in request.write_array])
        return pb.WriteDigitalLinesResponse(samps_per_chan_written=1)

    def ReadDigitalLines(self, request: pb.ReadDigitalLinesRequest, context: object) -> pb.ReadDigitalLinesResponse:
        if request.num_samps_per_chan != 1:
            raise NotEmulated("a digital input with a sample clock")
        task = self._task(request)
        job = task.required_job
        if isinstance(job, DigitalInput):
            levels, width = self._looked_at(task, job), job.lines_per_channel
        else:
            output = task.doing(DigitalOutput)
            levels, width = bytes(output.levels), output.lines_per_channel
        if len(levels) > request.array_size_in_bytes:
            raise DaqmxFailure(
                DAQmxErrors.READ_BUFFER_TOO_SMALL,
                f"Buffer is too small to fit read data.\n\nRequired: {len(levels)}\n"
                f"Room: {request.array_size_in_bytes}",
            )
        return pb.ReadDigitalLinesResponse(read_array=levels, samps_per_chan_read=1, num_bytes_per_samp=width)

    def _looked_at(self, task: Task, job: DigitalInput) -> bytes:
        """The present levels. A task that is not running is started for the read and stopped again (NI-DAQmx help,
        "Start Task").
        """
        started = task.state.started
        if not started:
            self._driver.start(task)
        try:
            return job.read()
        finally:
            if not started:
                self._driver.stop(task)


_LEVELS = {Level.HIGH.value: True, Level.LOW.value: False}


class WatchdogService(TaskService):
    """Handlers of CreateWatchdogTimerTaskEx, CfgWatchdog...ExpirStates, ControlWatchdogTask, GetWatchdogAttribute...
    and SetWatchdogAttribute...
    """

    def CreateWatchdogTimerTaskEx(
        self, request: pb.CreateWatchdogTimerTaskExRequest, context: object
    ) -> pb.CreateWatchdogTimerTaskExResponse:
        driver = self._driver
        device = driver.catalogue.device(request.device_name)
        parts = (device, *(driver.catalogue.device(name) for name in device.modules))
        watchdog = Watchdog(parts, driver.expire, driver.lines, request.timeout)
        task, new = self.opened(request.session_name, request.initialization_behavior)
        if new:
            task.job = watchdog
        return pb.CreateWatchdogTimerTaskExResponse(task=Session(name=task.name), new_session_initialized=new)

    def CfgWatchdogDOExpirStates(
        self, request: pb.CfgWatchdogDOExpirStatesRequest, context: object
    ) -> pb.CfgWatchdogDOExpirStatesResponse:
        found = [self._driver.catalogue.line(name) for name in unflattened(request.channel_names)]
        states: dict[str, bool] = {}
        for (device, k), level in zip(found, request.expir_state_array, strict=True):
            if level == Level.NO_CHANGE.value:
                continue
            if level not in _LEVELS:
                raise NotEmulated("an expiration state other than high, low or no change")
            states[device.line_names[k]] = _LEVELS[level]
        self._task(request).doing(Watchdog).expire_to(states)
        return pb.CfgWatchdogDOExpirStatesResponse()

    def CfgWatchdogAOExpirStates(
        self, request: pb.CfgWatchdogAOExpirStatesRequest, context: object
    ) -> pb.CfgWatchdogAOExpirStatesResponse:
        found = [self._driver.catalogue.output(name) for name in unflattened(request.channel_names)]
        volts = {device.output_names[k]: v for (device, k), v in zip(found, request.expir_state_array, strict=True)}
        self._task(request).doing(Watchdog).hold_at(volts)
        return pb.CfgWatchdogAOExpirStatesResponse()

    def ControlWatchdogTask(
        self, request: pb.ControlWatchdogTaskRequest, context: object
    ) -> pb.ControlWatchdogTaskResponse:
        watchdog = self._task(request).doing(Watchdog)
        if (request.action_raw or request.action) == WDTTaskAction.CLEAR_EXPIRATION.value:
            watchdog.clear_expiration()
        else:
            watchdog.reset()
        return pb.ControlWatchdogTaskResponse()

    def GetWatchdogAttributeBool(
        self, request: pb.GetWatchdogAttributeBoolRequest, context: object
    ) -> pb.GetWatchdogAttributeBoolResponse:
        watchdog = self._task(request).doing(Watchdog)
        match attribute_of(request):
            case pb.WATCHDOG_ATTRIBUTE_HAS_EXPIRED:
                return pb.GetWatchdogAttributeBoolResponse(value=watchdog.expired)
            case pb.WATCHDOG_ATTRIBUTE_EXPIR_TRIG_TRIG_ON_NETWORK_CONN_LOSS:
                return pb.GetWatchdogAttributeBoolResponse(value=watchdog.trips_on_loss)
            case other:
                raise unsupported(other)

    def SetWatchdogAttributeBool(
        self, request: pb.SetWatchdogAttributeBoolRequest, context: object
    ) -> pb.SetWatchdogAttributeBoolResponse:
        watchdog = self._task(request).doing(Watchdog)
        if (attribute := attribute_of(request)) != pb.WATCHDOG_ATTRIBUTE_EXPIR_TRIG_TRIG_ON_NETWORK_CONN_LOSS:
            raise unsupported(attribute)
        watchdog.trips_on_loss = request.value
        return pb.SetWatchdogAttributeBoolResponse()

    def GetWatchdogAttributeDouble(
        self, request: pb.GetWatchdogAttributeDoubleRequest, context: object
    ) -> pb.GetWatchdogAttributeDoubleResponse:
        if (attribute := attribute_of(request)) != pb.WATCHDOG_ATTRIBUTE_TIMEOUT:
            raise unsupported(attribute)
        return pb.GetWatchdogAttributeDoubleResponse(value=self._task(request).doing(Watchdog).timeout)
