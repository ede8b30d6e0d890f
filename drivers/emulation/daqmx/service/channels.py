"""Handlers of calls that add channels to tasks."""

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import Level, LineGrouping
from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.analog_input import AnalogInput
from drivers.emulation.daqmx.analog_output import AnalogOutput, OutputChannel
from drivers.emulation.daqmx.counter import CounterOutput, PulseChannel
from drivers.emulation.daqmx.device import InputChannel, InputConverter, require_wiring
from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated
from drivers.emulation.daqmx.lines import DigitalInput, DigitalOutput, Line, LineChannel
from drivers.emulation.daqmx.models import unflattened
from drivers.emulation.daqmx.service.base import Service
from drivers.emulation.daqmx.task import Job, Task

# ruff: noqa: ARG002 - gRPC passes a context to every call


def covering_range(ranges: Sequence[float], minimum: float, maximum: float, what: str) -> float:
    """The narrowest of the device's `ranges` [V] that covers the limits. Raises DaqmxFailure if none does; `what` names
    the property in the error.
    """
    wanted = max(abs(minimum), abs(maximum))
    if minimum >= maximum or wanted > max(ranges):
        raise DaqmxFailure(
            DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
            "Requested value is not a supported value for this property.\n\n"
            f"Property: {what}\nRequested Limits: {minimum} to {maximum}",
        )
    return min(range for range in ranges if range >= wanted)


J = TypeVar("J", bound=Job)


class ChannelService(Service):
    """Handlers of CreateAIVoltageChan, CreateAOVoltageChan, CreateDIChan, CreateDOChan and CreateCOPulseChanTime."""

    def CreateAIVoltageChan(
        self, request: pb.CreateAIVoltageChanRequest, context: object
    ) -> pb.CreateAIVoltageChanResponse:
        task = self._task(request)
        added = self._new_inputs(request)
        with self._driver.changed:
            driver = self._driver
            job = self._job(task, AnalogInput, lambda: AnalogInput(driver.plant, driver.changed, driver.packet))
            job.inputs.extend(added)
        return pb.CreateAIVoltageChanResponse()

    def CreateAOVoltageChan(
        self, request: pb.CreateAOVoltageChanRequest, context: object
    ) -> pb.CreateAOVoltageChanResponse:
        task = self._task(request)
        added = self._new_outputs(request)
        driver = self._driver
        with driver.changed:
            job = self._job(task, AnalogOutput, lambda: AnalogOutput(driver.plant, driver.instant, driver.changed))
            job.outputs.extend(added)
        return pb.CreateAOVoltageChanResponse()

    def CreateDIChan(self, request: pb.CreateDIChanRequest, context: object) -> pb.CreateDIChanResponse:
        task = self._task(request)
        found = [self._driver.catalogue.input_line(name) for name in unflattened(request.lines)]
        added = _line_channels(
            [Line(device.name, device.input_line_names[k], device.direction_of(k)) for device, k in found], request
        )
        with self._driver.changed:
            self._job(task, DigitalInput, lambda: DigitalInput(self._driver.lines)).inputs.extend(added)
        return pb.CreateDIChanResponse()

    def CreateDOChan(self, request: pb.CreateDOChanRequest, context: object) -> pb.CreateDOChanResponse:
        task = self._task(request)
        found = [self._driver.catalogue.line(name) for name in unflattened(request.lines)]
        added = _line_channels(
            [Line(device.name, device.line_names[k], device.direction_of(k)) for device, k in found], request
        )
        with self._driver.changed:
            self._job(task, DigitalOutput, lambda: DigitalOutput(self._driver.lines)).outputs.extend(added)
        return pb.CreateDOChanResponse()

    def CreateCOPulseChanTime(
        self, request: pb.CreateCOPulseChanTimeRequest, context: object
    ) -> pb.CreateCOPulseChanTimeResponse:
        task, driver = self._task(request), self._driver
        task.require_stopped()
        if task.job is not None or (request.idle_state_raw or request.idle_state) != Level.LOW.value:
            raise NotEmulated("a task with several counter outputs, or with one that is high at rest,")
        device, k = driver.catalogue.counter(request.counter)
        name = device.counter_names[k]
        wired = driver.wires.counters.get(name)
        channel = PulseChannel(name, device.name, request.initial_delay, request.low_time, request.high_time, wired)
        task.job = CounterOutput(driver.plant, channel)
        return pb.CreateCOPulseChanTimeResponse()

    def _new_inputs(self, request: pb.CreateAIVoltageChanRequest) -> list[InputChannel]:
        added: list[InputChannel] = []
        physical = unflattened(request.physical_channel)
        names = unflattened(request.name_to_assign_to_channel) or physical
        wiring = request.terminal_config_raw or request.terminal_config
        for name, channel in zip(names, physical, strict=False):
            device, k = self._driver.catalogue.input(channel)
            assert device.inputs is not None
            require_wiring(device.inputs, wiring)
            span = covering_range(device.inputs.ranges, request.min_val, request.max_val, "AI.Min, AI.Max")
            converter = InputConverter(device.inputs, k, span, self._driver.converter)
            terminal = device.inputs.first_terminal + k
            added.append(
                InputChannel(name, device, device.inputs, terminal, request.min_val, request.max_val, converter)
            )
        return added

    def _new_outputs(self, request: pb.CreateAOVoltageChanRequest) -> list[OutputChannel]:
        added: list[OutputChannel] = []
        physical = unflattened(request.physical_channel)
        names = unflattened(request.name_to_assign_to_channel) or physical
        for name, channel in zip(names, physical, strict=False):
            device, k = self._driver.catalogue.output(channel)
            assert device.outputs is not None
            span = covering_range(device.outputs.ranges, request.min_val, request.max_val, "AO.Min, AO.Max")
            terminal = self._driver.terminals[device.output_names[k]]
            added.append(
                OutputChannel(
                    name,
                    device,
                    span,
                    request.min_val,
                    request.max_val,
                    device.outputs.memory,
                    device.outputs.rate,
                    terminal,
                )
            )
        return added

    def _job(self, task: Task, kind: type[J], make: Callable[[], J]) -> J:
        """The task's job of this kind, created if the task is still empty."""
        task.require_stopped()
        if task.job is None:
            task.job = make()
        if not isinstance(task.job, kind):
            raise DaqmxFailure(
                DAQmxErrors.MULTI_CHAN_TYPES_IN_TASK,
                "Specified channel cannot be added to the task, because a channel with a different I/O type is"
                f" already in the task.\n\nTask Name: {task.name}",
            )
        return task.job


def _line_channels(
    lines: Sequence[Line], request: pb.CreateDIChanRequest | pb.CreateDOChanRequest
) -> Iterator[LineChannel]:
    """Channels of the requested lines, grouped and named as requested."""
    separate = (request.line_grouping_raw or request.line_grouping) == LineGrouping.CHAN_PER_LINE.value
    groups = [(line,) for line in lines] if separate else [tuple(lines)]
    names = unflattened(request.name_to_assign_to_lines) or tuple(
        group[0].name if len(group) == 1 else request.lines for group in groups
    )
    return (LineChannel(name, group) for name, group in zip(names, groups, strict=False))
