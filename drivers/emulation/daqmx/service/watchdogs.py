"""Calls about watchdog tasks."""

# ruff: noqa: ARG002 - gRPC gives every call a context, needed or not

from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import Level, WDTTaskAction
from nidaqmx.error_codes import DAQmxErrors
from session_pb2 import Session

from drivers.emulation.daqmx.catalogue import unflattened
from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated
from drivers.emulation.daqmx.service.base import attribute_of, unsupported
from drivers.emulation.daqmx.service.tasks import TaskService
from drivers.emulation.daqmx.watchdog import Watchdog

_LEVELS = {Level.HIGH.value: True, Level.LOW.value: False}


class WatchdogService(TaskService):
    """CreateWatchdogTimerTaskEx, CfgWatchdog...ExpirStates, ControlWatchdogTask, GetWatchdogAttribute..."""

    def CreateWatchdogTimerTaskEx(
        self, request: pb.CreateWatchdogTimerTaskExRequest, context: object
    ) -> pb.CreateWatchdogTimerTaskExResponse:
        watchdog = Watchdog(self._driver.catalogue.device(request.device_name), self._driver.lines, request.timeout)
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
                raise NotEmulated("a line without any level")
            states[device.line_names[k]] = _LEVELS[level]
        self._task(request).doing(Watchdog).expire_to(states)
        return pb.CfgWatchdogDOExpirStatesResponse()

    def CfgWatchdogAOExpirStates(
        self, request: pb.CfgWatchdogAOExpirStatesRequest, context: object
    ) -> pb.CfgWatchdogAOExpirStatesResponse:
        device = self._task(request).doing(Watchdog).device
        raise DaqmxFailure(
            DAQmxErrors.ATTRIBUTE_NOT_SUPPORTED_IN_TASK_CONTEXT,
            f"The watchdog of {device.product} has no states for analogue outputs.\n\nDevice: {device.name}",
        )

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
        if (attribute := attribute_of(request)) != pb.WATCHDOG_ATTRIBUTE_HAS_EXPIRED:
            raise unsupported(attribute)
        return pb.GetWatchdogAttributeBoolResponse(value=self._task(request).doing(Watchdog).expired)

    def GetWatchdogAttributeDouble(
        self, request: pb.GetWatchdogAttributeDoubleRequest, context: object
    ) -> pb.GetWatchdogAttributeDoubleResponse:
        if (attribute := attribute_of(request)) != pb.WATCHDOG_ATTRIBUTE_TIMEOUT:
            raise unsupported(attribute)
        return pb.GetWatchdogAttributeDoubleResponse(value=self._task(request).doing(Watchdog).timeout)
