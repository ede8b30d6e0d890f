"""Calls that add channels to tasks."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Protocol, TypeVar

from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import (
    ChannelType,
    DataJustification,
    DigitalWidthUnits,
    LineGrouping,
    ResolutionType,
    UsageTypeAI,
)
from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.analog_input import AnalogInput, FilterDelay, InputChannel, require_wiring
from drivers.emulation.daqmx.analog_output import TRANSFER_CONDITIONS, AnalogOutput, OutputChannel
from drivers.emulation.daqmx.device import InputConverter
from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.lines import DigitalInput, DigitalOutput, Line, LineChannel
from drivers.emulation.daqmx.models import unflattened
from drivers.emulation.daqmx.service.base import AboutAttribute, AboutTask, Service, attribute_of, unsupported
from drivers.emulation.daqmx.task import Job, Task

# ruff: noqa: ARG002 - gRPC gives every call a context, needed or not


def covering_range(ranges: Sequence[float], minimum: float, maximum: float, what: str) -> float:
    """The narrowest of the device's ranges [V] that covers the limits. Raises DaqmxFailure if none does."""
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
    """CreateAIVoltageChan, CreateAOVoltageChan, CreateDIChan, CreateDOChan."""

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


# ruff: noqa: ARG002 - gRPC gives every call a context, needed or not


class _AboutChannel(AboutTask, AboutAttribute, Protocol):
    @property
    def channel(self) -> str: ...


class _Named(Protocol):
    @property
    def name(self) -> str: ...


N = TypeVar("N", bound=_Named)

_CHANNEL_TYPES: Mapping[type[Job], ChannelType] = {
    AnalogInput: ChannelType.ANALOG_INPUT,
    AnalogOutput: ChannelType.ANALOG_OUTPUT,
    DigitalInput: ChannelType.DIGITAL_INPUT,
    DigitalOutput: ChannelType.DIGITAL_OUTPUT,
}
_INPUT_NUMBERS: Mapping[int, Callable[[InputChannel], float]] = {
    pb.CHANNEL_ATTRIBUTE_AI_MAX: lambda channel: channel.maximum,
    pb.CHANNEL_ATTRIBUTE_AI_MIN: lambda channel: channel.minimum,
    pb.CHANNEL_ATTRIBUTE_AI_RNG_HIGH: lambda channel: channel.converter.range,
    pb.CHANNEL_ATTRIBUTE_AI_RNG_LOW: lambda channel: -channel.converter.range,
    pb.CHANNEL_ATTRIBUTE_AI_RESOLUTION: lambda channel: float(channel.inputs.resolution),
}
_OUTPUT_NUMBERS: Mapping[int, Callable[[OutputChannel], float]] = {
    pb.CHANNEL_ATTRIBUTE_AO_MAX: lambda channel: channel.maximum,
    pb.CHANNEL_ATTRIBUTE_AO_MIN: lambda channel: channel.minimum,
    pb.CHANNEL_ATTRIBUTE_AO_DAC_RNG_HIGH: lambda channel: channel.range,
    pb.CHANNEL_ATTRIBUTE_AO_DAC_RNG_LOW: lambda channel: -channel.range,
}


class ChannelAttributeService(Service):
    """GetChanAttribute..., SetChanAttribute..."""

    def GetChanAttributeDoubleArray(
        self, request: pb.GetChanAttributeDoubleArrayRequest, context: object
    ) -> pb.GetChanAttributeDoubleArrayResponse:
        if (attribute := attribute_of(request)) != pb.CHANNEL_ATTRIBUTE_AI_DEV_SCALING_COEFF:
            raise unsupported(attribute)
        return pb.GetChanAttributeDoubleArrayResponse(value=self._input(request).converter.coefficients)

    def GetChanAttributeDouble(
        self, request: pb.GetChanAttributeDoubleRequest, context: object
    ) -> pb.GetChanAttributeDoubleResponse:
        attribute = attribute_of(request)
        if attribute == pb.CHANNEL_ATTRIBUTE_AI_FILTER_DELAY:
            return pb.GetChanAttributeDoubleResponse(value=self._filter_delay(request))
        if attribute in _INPUT_NUMBERS:
            return pb.GetChanAttributeDoubleResponse(value=_INPUT_NUMBERS[attribute](self._input(request)))
        if attribute in _OUTPUT_NUMBERS:
            return pb.GetChanAttributeDoubleResponse(value=_OUTPUT_NUMBERS[attribute](self._output(request)))
        raise unsupported(attribute)

    def GetChanAttributeBool(
        self, request: pb.GetChanAttributeBoolRequest, context: object
    ) -> pb.GetChanAttributeBoolResponse:
        if (attribute := attribute_of(request)) != pb.CHANNEL_ATTRIBUTE_AI_REMOVE_FILTER_DELAY:
            raise unsupported(attribute)
        return pb.GetChanAttributeBoolResponse(value=self._filter(request).removed)

    def SetChanAttributeBool(
        self, request: pb.SetChanAttributeBoolRequest, context: object
    ) -> pb.SetChanAttributeBoolResponse:
        if (attribute := attribute_of(request)) != pb.CHANNEL_ATTRIBUTE_AI_REMOVE_FILTER_DELAY:
            raise unsupported(attribute)
        self._task(request).require_stopped()
        self._filter(request).removed = request.value
        return pb.SetChanAttributeBoolResponse()

    def _filter_delay(self, request: _AboutChannel) -> float:
        """The filter delay in the requested unit."""
        units, clock = self._filter(request).units, self._task(request).doing(AnalogInput).clock
        converter = self._input(request).inputs.delta_sigma
        if converter is None or clock is None:
            raise unsupported(attribute_of(request))
        delay = converter.delay(clock.rate)
        return delay if units == DigitalWidthUnits.SECONDS.value else delay * clock.rate

    def _filter(self, request: _AboutChannel) -> FilterDelay:
        """Settings of the filter delay. Raises DaqmxFailure for a converter without properties for it."""
        channel = self._input(request)
        if channel.inputs.delta_sigma is None or not channel.inputs.delta_sigma.readable:
            raise unsupported(attribute_of(request))
        return channel.filter

    def GetChanAttributeUInt32(
        self, request: pb.GetChanAttributeUInt32Request, context: object
    ) -> pb.GetChanAttributeUInt32Response:
        if (attribute := attribute_of(request)) != pb.CHANNEL_ATTRIBUTE_AI_RAW_SAMP_SIZE:
            raise unsupported(attribute)
        return pb.GetChanAttributeUInt32Response(value=self._input(request).inputs.raw_bits)

    def GetChanAttributeInt32(
        self, request: pb.GetChanAttributeInt32Request, context: object
    ) -> pb.GetChanAttributeInt32Response:
        match attribute_of(request):
            case pb.CHANNEL_ATTRIBUTE_CHAN_TYPE:
                value = _CHANNEL_TYPES[type(self._task(request).required_job)].value
            case pb.CHANNEL_ATTRIBUTE_AI_MEAS_TYPE:
                value = UsageTypeAI.VOLTAGE.value
            case pb.CHANNEL_ATTRIBUTE_AI_RAW_SAMP_JUSTIFICATION:
                value = DataJustification.RIGHT.value
            case pb.CHANNEL_ATTRIBUTE_AI_RESOLUTION_UNITS:
                value = ResolutionType.BITS.value
            case pb.CHANNEL_ATTRIBUTE_AI_FILTER_DELAY_UNITS:
                value = self._filter(request).units
            case pb.CHANNEL_ATTRIBUTE_AO_DATA_XFER_REQ_COND if self._has_condition(request):
                value = self._task(request).doing(AnalogOutput).transfer
            case other:
                raise unsupported(other)
        return pb.GetChanAttributeInt32Response(value_raw=value)

    def SetChanAttributeInt32(
        self, request: pb.SetChanAttributeInt32Request, context: object
    ) -> pb.SetChanAttributeInt32Response:
        attribute = attribute_of(request)
        if attribute == pb.CHANNEL_ATTRIBUTE_AI_FILTER_DELAY_UNITS:
            self._filter(request).units = request.value_raw or request.value
            return pb.SetChanAttributeInt32Response()
        if attribute != pb.CHANNEL_ATTRIBUTE_AO_DATA_XFER_REQ_COND or not self._has_condition(request):
            raise unsupported(attribute)
        value = request.value_raw or request.value
        if value not in TRANSFER_CONDITIONS:
            raise DaqmxFailure(
                DAQmxErrors.INVALID_ATTRIBUTE_VALUE,
                "Requested value is not a supported value for this property.\n\nProperty: AO.DataXferReqCond\n"
                f"Requested Value: {value}",
            )
        task = self._task(request)
        task.require_stopped()
        task.doing(AnalogOutput).transfer = value
        return pb.SetChanAttributeInt32Response()

    def _has_condition(self, request: _AboutChannel) -> bool:
        outputs = self._output(request).device.outputs
        return outputs is not None and outputs.transfer_condition

    def _input(self, request: _AboutChannel) -> InputChannel:
        return _named(self._task(request).doing(AnalogInput).inputs, request)

    def _output(self, request: _AboutChannel) -> OutputChannel:
        return _named(self._task(request).doing(AnalogOutput).outputs, request)


def _named(channels: Sequence[N], request: _AboutChannel) -> N:
    """The first channel that the request names; the first of the task if it names none."""
    asked = unflattened(request.channel)
    if not asked:
        return channels[0]
    for channel in channels:
        if channel.name.lower() == asked[0].lower():
            return channel
    raise DaqmxFailure(
        DAQmxErrors.CHAN_NOT_IN_TASK, f"Specified channel is not in the task.\n\nChannel Name: {asked[0]}"
    )
