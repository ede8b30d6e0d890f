"""Calls that write and read digital lines."""

# ruff: noqa: ARG002 - gRPC gives every call a context, needed or not

from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.error_codes import DAQmxErrors

from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated
from drivers.emulation.daqmx.line_task import DigitalInput, DigitalOutput
from drivers.emulation.daqmx.service.base import Service
from drivers.emulation.daqmx.task import Task


class LineService(Service):
    """WriteDigitalLines, ReadDigitalLines: one byte per line."""

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
        """The levels now. A task that was not started goes back to what it was (NI-DAQmx help, "Start Task")."""
        started = task.state.started
        if not started:
            self._driver.start(task)
        try:
            return job.read()
        finally:
            if not started:
                self._driver.stop(task)
