"""The service that the nidaqmx client calls, put together from its parts."""

from nidaqmx._stubs.nidaqmx_pb2_grpc import NiDAQmxServicer

from drivers.emulation.daqmx.service.channel_attributes import ChannelAttributeService
from drivers.emulation.daqmx.service.channels import ChannelService
from drivers.emulation.daqmx.service.lines import LineService
from drivers.emulation.daqmx.service.reading import ReadingService
from drivers.emulation.daqmx.service.system import SystemService
from drivers.emulation.daqmx.service.timing import TimingService
from drivers.emulation.daqmx.service.watchdogs import WatchdogService
from drivers.emulation.daqmx.service.writing import WritingService


class NiDaqmx(
    SystemService,
    WatchdogService,
    ChannelService,
    ChannelAttributeService,
    TimingService,
    ReadingService,
    WritingService,
    LineService,
    NiDAQmxServicer,
):
    """Whatever is not here is UNIMPLEMENTED, as the base class says."""
