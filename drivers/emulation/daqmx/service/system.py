"""Handlers of calls about the driver and its devices."""

# ruff: noqa: ARG002 - gRPC passes a context to every call

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, TypeVar

from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import ProductCategory
from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.device import AnalogInputs, AnalogOutputs, DeviceModel
from drivers.emulation.daqmx.models import flattened
from drivers.emulation.daqmx.service.base import AboutAttribute, Service, attribute_of, unsupported

T = TypeVar("T")


class _AboutDevice(AboutAttribute, Protocol):
    @property
    def device_name(self) -> str: ...


_VERSION: Mapping[int, int] = {
    pb.SYSTEM_ATTRIBUTE_NIDAQ_MAJOR_VERSION: 23,
    pb.SYSTEM_ATTRIBUTE_NIDAQ_MINOR_VERSION: 8,
    pb.SYSTEM_ATTRIBUTE_NIDAQ_UPDATE_VERSION: 0,
}
"""Reported version of the driver: an older one, because clients must not require newer functions."""


def _inputs(device: DeviceModel, attribute: int) -> AnalogInputs:
    if device.inputs is None:
        raise unsupported(attribute)
    return device.inputs


def _outputs(device: DeviceModel, attribute: int) -> AnalogOutputs:
    if device.outputs is None:
        raise unsupported(attribute)
    return device.outputs


def _pairs(ranges: Sequence[float]) -> list[float]:
    return [end for range in ranges for end in (-range, range)]


_TEXTS: Mapping[int, Callable[[DeviceModel], str]] = {
    pb.DEVICE_ATTRIBUTE_PRODUCT_TYPE: lambda device: device.product,
    pb.DEVICE_ATTRIBUTE_AI_PHYSICAL_CHANS: lambda device: flattened(device.input_names),
    pb.DEVICE_ATTRIBUTE_AO_PHYSICAL_CHANS: lambda device: flattened(device.output_names),
    pb.DEVICE_ATTRIBUTE_CO_PHYSICAL_CHANS: lambda device: flattened(device.counter_names),
    pb.DEVICE_ATTRIBUTE_DI_LINES: lambda device: flattened(device.input_line_names),
    pb.DEVICE_ATTRIBUTE_DO_LINES: lambda device: flattened(device.line_names),
    pb.DEVICE_ATTRIBUTE_CHASSIS_MODULE_DEV_NAMES: lambda device: flattened(device.modules),
}
_FLAGS: Mapping[int, Callable[[DeviceModel], bool]] = {
    pb.DEVICE_ATTRIBUTE_IS_SIMULATED: lambda device: device.simulated,
    pb.DEVICE_ATTRIBUTE_AI_SIMULTANEOUS_SAMPLING_SUPPORTED: lambda device: (
        _inputs(device, pb.DEVICE_ATTRIBUTE_AI_SIMULTANEOUS_SAMPLING_SUPPORTED).simultaneous
    ),
}
_NUMBERS: Mapping[int, Callable[[DeviceModel], int]] = {
    pb.DEVICE_ATTRIBUTE_SERIAL_NUM: lambda device: device.serial,
}
_CODES: Mapping[int, Callable[[DeviceModel], int]] = {
    pb.DEVICE_ATTRIBUTE_PRODUCT_CATEGORY: lambda device: device.category.value,
}
_RATES: Mapping[int, Callable[[DeviceModel], float]] = {
    pb.DEVICE_ATTRIBUTE_AI_MAX_SINGLE_CHAN_RATE: lambda device: (
        _inputs(device, pb.DEVICE_ATTRIBUTE_AI_MAX_SINGLE_CHAN_RATE).rate
    ),
    pb.DEVICE_ATTRIBUTE_AI_MAX_MULTI_CHAN_RATE: lambda device: (
        _inputs(device, pb.DEVICE_ATTRIBUTE_AI_MAX_MULTI_CHAN_RATE).total_rate
    ),
    pb.DEVICE_ATTRIBUTE_AO_MAX_RATE: lambda device: _outputs(device, pb.DEVICE_ATTRIBUTE_AO_MAX_RATE).rate,
}
_RANGES: Mapping[int, Callable[[DeviceModel], list[float]]] = {
    pb.DEVICE_ATTRIBUTE_AI_VOLTAGE_RNGS: lambda device: _pairs(device.inputs.ranges if device.inputs else ()),
    pb.DEVICE_ATTRIBUTE_AO_VOLTAGE_RNGS: lambda device: _pairs(device.outputs.ranges if device.outputs else ()),
}


_CHASSIS: Mapping[int, ProductCategory] = {
    pb.DEVICE_ATTRIBUTE_COMPACT_DAQ_CHASSIS_DEV_NAME: ProductCategory.COMPACT_DAQ_CHASSIS,
    pb.DEVICE_ATTRIBUTE_COMPACT_RIO_CHASSIS_DEV_NAME: ProductCategory.COMPACT_RIO_CHASSIS,
}


class SystemService(Service):
    """Handlers of GetSystemInfoAttribute..., GetDeviceAttribute..., GetPhysicalChanAttribute..., ResetDevice and
    GetErrorString.
    """

    def GetSystemInfoAttributeUInt32(
        self, request: pb.GetSystemInfoAttributeUInt32Request, context: object
    ) -> pb.GetSystemInfoAttributeUInt32Response:
        if (attribute := attribute_of(request)) not in _VERSION:
            raise unsupported(attribute)
        return pb.GetSystemInfoAttributeUInt32Response(value=_VERSION[attribute])

    def GetSystemInfoAttributeString(
        self, request: pb.GetSystemInfoAttributeStringRequest, context: object
    ) -> pb.GetSystemInfoAttributeStringResponse:
        values: Mapping[int, str] = {
            pb.SYSTEM_ATTRIBUTE_DEV_NAMES: flattened([device.name for device in self._driver.catalogue.devices]),
            pb.SYSTEM_ATTRIBUTE_TASKS: "",
        }
        if (attribute := attribute_of(request)) not in values:
            raise unsupported(attribute)
        return pb.GetSystemInfoAttributeStringResponse(value=values[attribute])

    def GetDeviceAttributeString(
        self, request: pb.GetDeviceAttributeStringRequest, context: object
    ) -> pb.GetDeviceAttributeStringResponse:
        if (attribute := attribute_of(request)) in _CHASSIS:
            return pb.GetDeviceAttributeStringResponse(value=self._chassis(request, attribute))
        return pb.GetDeviceAttributeStringResponse(value=self._device_attribute(_TEXTS, request))

    def GetDeviceAttributeBool(
        self, request: pb.GetDeviceAttributeBoolRequest, context: object
    ) -> pb.GetDeviceAttributeBoolResponse:
        return pb.GetDeviceAttributeBoolResponse(value=self._device_attribute(_FLAGS, request))

    def GetDeviceAttributeUInt32(
        self, request: pb.GetDeviceAttributeUInt32Request, context: object
    ) -> pb.GetDeviceAttributeUInt32Response:
        return pb.GetDeviceAttributeUInt32Response(value=self._device_attribute(_NUMBERS, request))

    def GetDeviceAttributeInt32(
        self, request: pb.GetDeviceAttributeInt32Request, context: object
    ) -> pb.GetDeviceAttributeInt32Response:
        return pb.GetDeviceAttributeInt32Response(value_raw=self._device_attribute(_CODES, request))

    def GetDeviceAttributeDouble(
        self, request: pb.GetDeviceAttributeDoubleRequest, context: object
    ) -> pb.GetDeviceAttributeDoubleResponse:
        return pb.GetDeviceAttributeDoubleResponse(value=self._device_attribute(_RATES, request))

    def GetDeviceAttributeDoubleArray(
        self, request: pb.GetDeviceAttributeDoubleArrayRequest, context: object
    ) -> pb.GetDeviceAttributeDoubleArrayResponse:
        return pb.GetDeviceAttributeDoubleArrayResponse(value=self._device_attribute(_RANGES, request))

    def GetPhysicalChanAttributeInt32(
        self, request: pb.GetPhysicalChanAttributeInt32Request, context: object
    ) -> pb.GetPhysicalChanAttributeInt32Response:
        if (attribute := attribute_of(request)) != pb.PHYSICALCHANNEL_ATTRIBUTE_PHYSICAL_CHAN_AI_TERM_CFGS:
            raise unsupported(attribute)
        device, _ = self._driver.catalogue.input(request.physical_channel)
        return pb.GetPhysicalChanAttributeInt32Response(value_raw=_inputs(device, attribute).wirings)

    def ResetDevice(self, request: pb.ResetDeviceRequest, context: object) -> pb.ResetDeviceResponse:
        self._driver.reset_device(self._driver.catalogue.device(request.device_name))
        return pb.ResetDeviceResponse()

    def GetErrorString(self, request: pb.GetErrorStringRequest, context: object) -> pb.GetErrorStringResponse:
        try:
            return pb.GetErrorStringResponse(error_string=DAQmxErrors(request.error_code).name)
        except ValueError:
            return pb.GetErrorStringResponse(error_string="")

    def _chassis(self, request: _AboutDevice, attribute: int) -> str:
        """The chassis of a module. Raises DaqmxFailure if `attribute` requests another kind of chassis."""
        device = self._driver.catalogue.device(request.device_name)
        if device.chassis is None or self._driver.catalogue.device(device.chassis).category != _CHASSIS[attribute]:
            raise unsupported(attribute)
        return device.chassis

    def _device_attribute(self, table: Mapping[int, Callable[[DeviceModel], T]], request: _AboutDevice) -> T:
        device = self._driver.catalogue.device(request.device_name)
        if (attribute := attribute_of(request)) not in table:
            raise unsupported(attribute)
        return table[attribute](device)
