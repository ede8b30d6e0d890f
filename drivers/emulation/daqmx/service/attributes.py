"""Attributes of the channels of emulated tasks."""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, TypeVar

from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import (
    ChannelType,
    DataJustification,
    DigitalWidthUnits,
    ResolutionType,
    UsageTypeAI,
)
from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.analog_input import AnalogInput
from drivers.emulation.daqmx.analog_output import TRANSFER_CONDITIONS, AnalogOutput, OutputChannel
from drivers.emulation.daqmx.device import FilterDelay, InputChannel
from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.lines import DigitalInput, DigitalOutput
from drivers.emulation.daqmx.models import unflattened
from drivers.emulation.daqmx.service.base import AboutAttribute, AboutTask, Service, attribute_of, unsupported
from drivers.emulation.daqmx.task import Job

# ruff: noqa: ARG002 - gRPC passes a context to every call


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


class ChannelAttributeService(Service):
    """Handlers of GetChanAttribute... and SetChanAttribute..."""

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
        """Settings of the filter delay. Raises DaqmxFailure for a converter that does not report its delay."""
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
