"""Handlers of calls that read and write samples."""

from typing import Protocol

import numpy as np
from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import FillMode
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from drivers.emulation.daqmx.analog_input import AnalogInput
from drivers.emulation.daqmx.analog_output import AnalogOutput
from drivers.emulation.daqmx.device import Seen
from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated
from drivers.emulation.daqmx.lines import DigitalInput, DigitalOutput
from drivers.emulation.daqmx.models import flattened
from drivers.emulation.daqmx.service.base import AboutTask, Service, attribute_of, unsupported
from drivers.emulation.daqmx.task import Task

# ruff: noqa: ARG002 - gRPC passes a context to every call


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
    """Handlers of ReadBinaryI16, ReadBinaryI32, ReadAnalogF64 and GetReadAttribute..."""

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

    def _read(self, request: _ReadRequest) -> tuple[AnalogInput, Seen, int]:
        """The acquired counts, shape (n, channels), and 0, or the error code if fewer than requested were acquired."""
        task = self._task(request)
        job = task.doing(AnalogInput)
        self._driver.require_alive(job)
        with self._driver.changed:
            if not task.state.started:
                self._driver.start(task)
            run = job.run
        room = request.array_size_in_samps // len(job.inputs)
        n = request.num_samps_per_chan
        if n < 0:
            raise NotEmulated("a read of all available samples")
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
    """Values, shape (n, channels), in the server's transmission order, padded to the client's buffer size.

    The samples are contiguous, channel by channel unless interleaved, even when fewer than requested.
    """
    interleaved = (request.fill_mode_raw or request.fill_mode) == FillMode.GROUP_BY_SCAN_NUMBER.value
    flat = (values if interleaved else values.T).ravel()
    if flat.size == request.array_size_in_samps:
        return flat
    array = np.zeros(request.array_size_in_samps, flat.dtype)
    array[: flat.size] = flat
    return array


# ruff: noqa: ARG002 - gRPC passes a context to every call


class WritingService(Service):
    """Handlers of WriteAnalogF64, WriteAnalogScalarF64, GetWriteAttribute... and SetWriteAttribute..."""

    def WriteAnalogF64(self, request: pb.WriteAnalogF64Request, context: object) -> pb.WriteAnalogF64Response:
        task = self._task(request)
        channels = len(task.doing(AnalogOutput).outputs)
        interleaved = (request.data_layout_raw or request.data_layout) == FillMode.GROUP_BY_SCAN_NUMBER.value
        given = np.array(request.write_array, dtype=np.float64)
        if given.size != channels * request.num_samps_per_chan:
            raise DaqmxFailure(
                DAQmxErrors.WRITE_NUM_CHANS_MISMATCH,
                f"Number of values does not match the channels.\n\nValues: {given.size}\nChannels: {channels}",
            )
        shape = (request.num_samps_per_chan, channels) if interleaved else (channels, request.num_samps_per_chan)
        volts = given.reshape(shape) if interleaved else given.reshape(shape).T
        written = self._write(task, volts, request.timeout, auto_start=request.auto_start)
        return pb.WriteAnalogF64Response(samps_per_chan_written=written)

    def WriteAnalogScalarF64(
        self, request: pb.WriteAnalogScalarF64Request, context: object
    ) -> pb.WriteAnalogScalarF64Response:
        self._write(self._task(request), np.array([[request.value]]), request.timeout, auto_start=request.auto_start)
        return pb.WriteAnalogScalarF64Response()

    def SetWriteAttributeInt32(
        self, request: pb.SetWriteAttributeInt32Request, context: object
    ) -> pb.SetWriteAttributeInt32Response:
        if (attribute := attribute_of(request)) != pb.WRITE_ATTRIBUTE_REGEN_MODE:
            raise unsupported(attribute)
        task = self._task(request)
        task.require_stopped()
        task.doing(AnalogOutput).regeneration = request.value_raw or request.value
        return pb.SetWriteAttributeInt32Response()

    def GetWriteAttributeInt32(
        self, request: pb.GetWriteAttributeInt32Request, context: object
    ) -> pb.GetWriteAttributeInt32Response:
        if (attribute := attribute_of(request)) != pb.WRITE_ATTRIBUTE_REGEN_MODE:
            raise unsupported(attribute)
        return pb.GetWriteAttributeInt32Response(value_raw=self._task(request).doing(AnalogOutput).regeneration)

    def GetWriteAttributeUInt64(
        self, request: pb.GetWriteAttributeUInt64Request, context: object
    ) -> pb.GetWriteAttributeUInt64Response:
        job = self._task(request).doing(AnalogOutput)
        with self._driver.changed:
            match attribute_of(request):
                case pb.WRITE_ATTRIBUTE_TOTAL_SAMP_PER_CHAN_GENERATED:
                    return pb.GetWriteAttributeUInt64Response(value=job.generated)
                case pb.WRITE_ATTRIBUTE_CURR_WRITE_POS:
                    return pb.GetWriteAttributeUInt64Response(value=job.written)
                case other:
                    raise unsupported(other)

    def GetWriteAttributeUInt32(
        self, request: pb.GetWriteAttributeUInt32Request, context: object
    ) -> pb.GetWriteAttributeUInt32Response:
        job = self._task(request).required_job
        with self._driver.changed:
            match attribute_of(request):
                case pb.WRITE_ATTRIBUTE_NUM_CHANS:
                    return pb.GetWriteAttributeUInt32Response(value=len(job.channels))
                case pb.WRITE_ATTRIBUTE_SPACE_AVAIL if isinstance(job, AnalogOutput):
                    return pb.GetWriteAttributeUInt32Response(value=job.space)
                case pb.WRITE_ATTRIBUTE_DIGITAL_LINES_BYTES_PER_CHAN if isinstance(job, DigitalOutput):
                    return pb.GetWriteAttributeUInt32Response(value=job.lines_per_channel)
                case other:
                    raise unsupported(other)

    def _write(self, task: Task, volts: NDArray[np.float64], timeout: float, *, auto_start: bool) -> int:
        """Write `volts`, shape (n, channels), to the buffer; without a clock, directly to the terminals."""
        job = task.doing(AnalogOutput)
        with self._driver.changed:
            if job.clock is None:
                self._require_started(task, auto_start=auto_start)
                if volts.shape[0] != 1:
                    raise NotEmulated("a write of several values without a sample clock")
                job.put(volts[0])
                return 1
            self._driver.reserve(task)
            written = job.write(volts, timeout)
            if auto_start and not task.state.started:
                self._driver.start(task)
            return written

    def _require_started(self, task: Task, *, auto_start: bool) -> None:
        if task.state.started:
            return
        if not auto_start:
            raise DaqmxFailure(
                DAQmxErrors.CANNOT_WRITE_WHEN_AUTO_START_FALSE_AND_TASK_NOT_RUNNING,
                "Write cannot be performed when the auto start input is false and the task is not running.",
            )
        self._driver.start(task)
