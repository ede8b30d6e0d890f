"""Calls that write analogue outputs, and ask how far they are."""

# ruff: noqa: ARG002 - gRPC gives every call a context, needed or not

import numpy as np
from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import FillMode
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from drivers.emulation.daqmx.analog_output import AnalogOutput
from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated
from drivers.emulation.daqmx.line_task import DigitalOutput
from drivers.emulation.daqmx.service.base import Service, attribute_of, unsupported
from drivers.emulation.daqmx.task import Task


class WritingService(Service):
    """WriteAnalogF64, WriteAnalogScalarF64, Get/SetWriteAttribute..."""

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
        """Write `volts`, shape (n, channels): into the buffer, or straight to the terminals without a clock."""
        job = task.doing(AnalogOutput)
        with self._driver.changed:
            if job.clock is None:
                self._require_started(task, auto_start=auto_start)
                if volts.shape[0] != 1:
                    raise NotEmulated("several values one after the other without a sample clock")
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
