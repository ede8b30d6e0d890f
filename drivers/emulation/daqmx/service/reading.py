"""Calls that read analogue inputs, and ask how far they are."""

# ruff: noqa: ARG002 - gRPC gives every call a context, needed or not

from typing import Protocol

import numpy as np
from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import FillMode
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from drivers.emulation.daqmx.analog_input import AnalogInput
from drivers.emulation.daqmx.catalogue import flattened
from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated
from drivers.emulation.daqmx.line_task import DigitalInput, DigitalOutput
from drivers.emulation.daqmx.service.base import AboutTask, Service, attribute_of, unsupported
from sim.channel import Counts


class _ReadRequest(AboutTask, Protocol):
    @property
    def num_samps_per_chan(self) -> int: ...
    @property
    def timeout(self) -> float: ...
    @property
    def fill_mode(self) -> int: ...
    @property
    def fill_mode_raw(self) -> int: ...
    @property
    def array_size_in_samps(self) -> int: ...


class ReadingService(Service):
    """ReadBinaryI16, ReadBinaryI32, ReadAnalogF64, GetReadAttribute..."""

    def ReadBinaryI16(self, request: pb.ReadBinaryI16Request, context: object) -> pb.ReadBinaryI16Response:
        job, counts, status = self._read(request)
        _require_fit(job, 16)
        array = _packed(job.raw(counts), request)
        return pb.ReadBinaryI16Response(status=status, read_array=array.tolist(), samps_per_chan_read=len(counts))

    def ReadBinaryI32(self, request: pb.ReadBinaryI32Request, context: object) -> pb.ReadBinaryI32Response:
        job, counts, status = self._read(request)
        array = _packed(job.raw(counts), request)
        return pb.ReadBinaryI32Response(status=status, read_array=array.tolist(), samps_per_chan_read=len(counts))

    def ReadAnalogF64(self, request: pb.ReadAnalogF64Request, context: object) -> pb.ReadAnalogF64Response:
        job, counts, status = self._read(request)
        array = _packed(job.volts(counts), request)
        return pb.ReadAnalogF64Response(status=status, read_array=array.tolist(), samps_per_chan_read=len(counts))

    def GetReadAttributeUInt64(
        self, request: pb.GetReadAttributeUInt64Request, context: object
    ) -> pb.GetReadAttributeUInt64Response:
        job = self._task(request).doing(AnalogInput)
        with self._driver.changed:
            match attribute_of(request):
                case pb.READ_ATTRIBUTE_TOTAL_SAMP_PER_CHAN_ACQUIRED:
                    return pb.GetReadAttributeUInt64Response(value=job.acquired)
                case pb.READ_ATTRIBUTE_CURR_READ_POS:
                    return pb.GetReadAttributeUInt64Response(value=job.position)
                case other:
                    raise unsupported(other)

    def GetReadAttributeUInt32(
        self, request: pb.GetReadAttributeUInt32Request, context: object
    ) -> pb.GetReadAttributeUInt32Response:
        job = self._task(request).required_job
        with self._driver.changed:
            match attribute_of(request):
                case pb.READ_ATTRIBUTE_NUM_CHANS:
                    return pb.GetReadAttributeUInt32Response(value=len(job.channels))
                case pb.READ_ATTRIBUTE_AVAIL_SAMP_PER_CHAN if isinstance(job, AnalogInput):
                    return pb.GetReadAttributeUInt32Response(value=job.available)
                case pb.READ_ATTRIBUTE_DIGITAL_LINES_BYTES_PER_CHAN if isinstance(job, DigitalInput | DigitalOutput):
                    return pb.GetReadAttributeUInt32Response(value=job.lines_per_channel)
                case other:
                    raise unsupported(other)

    def GetReadAttributeString(
        self, request: pb.GetReadAttributeStringRequest, context: object
    ) -> pb.GetReadAttributeStringResponse:
        if (attribute := attribute_of(request)) != pb.READ_ATTRIBUTE_CHANNELS_TO_READ:
            raise unsupported(attribute)
        return pb.GetReadAttributeStringResponse(value=flattened(self._task(request).required_job.channels))

    def _read(self, request: _ReadRequest) -> tuple[AnalogInput, Counts, int]:
        """The counts that came, shape (n, channels), and 0 or the code for fewer than were asked for."""
        task = self._task(request)
        job = task.doing(AnalogInput)
        with self._driver.changed:
            if not task.state.started:
                self._driver.start(task)
            run = job.run
        room = request.array_size_in_samps // len(job.inputs)
        n = request.num_samps_per_chan
        if n < 0:
            raise NotEmulated("a read of whatever waits")
        if n > room:
            raise DaqmxFailure(
                DAQmxErrors.READ_BUFFER_TOO_SMALL,
                f"Buffer is too small to fit read data.\n\nRequired: {n}\nRoom: {room}",
            )
        counts = job.read(n, request.timeout, run)
        late = len(counts) < n
        return job, counts, DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE.value if late else 0


def _require_fit(job: AnalogInput, bits: int) -> None:
    widest = max(channel.inputs.raw_bits for channel in job.inputs)
    if widest > bits:
        raise DaqmxFailure(
            DAQmxErrors.READ_DATA_TYPE_TOO_SMALL, f"Read data type is too small: raw samples have {widest} bits."
        )


def _packed(
    values: NDArray[np.int16 | np.int32 | np.float64], request: _ReadRequest
) -> NDArray[np.int16 | np.int32 | np.float64]:
    """Values, shape (n, channels), as the server sends them: as many as the client has room for.

    What came stands first, channel by channel unless interleaved is asked for, without gaps even when it is less
    than was asked for.
    """
    interleaved = (request.fill_mode_raw or request.fill_mode) == FillMode.GROUP_BY_SCAN_NUMBER.value
    flat = (values if interleaved else values.T).ravel()
    if flat.size == request.array_size_in_samps:
        return flat
    array = np.zeros(request.array_size_in_samps, flat.dtype)
    array[: flat.size] = flat
    return array
