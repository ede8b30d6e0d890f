"""Handlers of calls about sample clocks, start triggers and buffers."""

# ruff: noqa: ARG002 - gRPC passes a context to every call

from nidaqmx._stubs import nidaqmx_pb2 as pb
from nidaqmx.constants import AcquisitionType, Edge

from drivers.emulation.daqmx.analog_input import AnalogInput
from drivers.emulation.daqmx.analog_output import AnalogOutput
from drivers.emulation.daqmx.conversion import delta_sigma_rate
from drivers.emulation.daqmx.counter import CounterOutput
from drivers.emulation.daqmx.engines import undefined
from drivers.emulation.daqmx.errors import NotEmulated
from drivers.emulation.daqmx.service.base import AboutTask, Service, attribute_of, unsupported
from drivers.emulation.daqmx.task import Task
from drivers.emulation.daqmx.timing import SampleClock, sample_clock

Sampled = AnalogInput | AnalogOutput


def _sampled(task: Task) -> Sampled:
    """The job of a task that can have a sample clock. Raises DaqmxFailure for other kinds of task."""
    job = task.required_job
    return job if isinstance(job, AnalogOutput) else task.doing(AnalogInput)


def _conversion_rate(job: Sampled, device: str) -> float:
    """Conversion rate of a multiplexed device [1/s]. Raises DaqmxFailure for devices without a multiplexer."""
    period = job.conversion(device) if isinstance(job, AnalogInput) else None
    if period is None:
        raise unsupported(pb.TIMING_ATTRIBUTE_AI_CONV_RATE)
    return 1.0 / period


class TimingService(Service):
    """Handlers of CfgSampClkTiming, CfgImplicitTiming, CfgDigEdgeStartTrig and DisableStartTrig, and of calls about
    buffers and about attributes of timing and triggers.
    """

    def CfgSampClkTiming(self, request: pb.CfgSampClkTimingRequest, context: object) -> pb.CfgSampClkTimingResponse:
        job = self._changeable(request)
        if (request.sample_mode_raw or request.sample_mode) != AcquisitionType.CONTINUOUS.value:
            raise NotEmulated("a sample clock with finite acquisition")
        own = request.source in ("", "OnboardClock")
        if not own and isinstance(job, AnalogInput):
            raise NotEmulated("an input task on an external sample clock")
        error = self._driver.output_clock_error if own and isinstance(job, AnalogOutput) else 0.0
        tick_rate = self._driver.plant.tick_rate
        job.source = None if own else request.source
        if isinstance(job, AnalogInput) and job.converters:
            rate = delta_sigma_rate(request.rate, job.converters)
            job.clock = SampleClock(max(round(tick_rate / rate), 1), rate, request.samps_per_chan)
        else:
            job.clock = sample_clock(request.rate, job.highest_rate, tick_rate, request.samps_per_chan, error)
        return pb.CfgSampClkTimingResponse()

    def CfgImplicitTiming(self, request: pb.CfgImplicitTimingRequest, context: object) -> pb.CfgImplicitTimingResponse:
        if (request.sample_mode_raw or request.sample_mode) != AcquisitionType.FINITE.value:
            raise NotEmulated("a counter output with continuous timing")
        self._task(request).doing(CounterOutput).pulses = request.samps_per_chan
        return pb.CfgImplicitTimingResponse()

    def GetTimingAttributeDouble(
        self, request: pb.GetTimingAttributeDoubleRequest, context: object
    ) -> pb.GetTimingAttributeDoubleResponse:
        job = _sampled(self._task(request))
        match attribute_of(request):
            case pb.TIMING_ATTRIBUTE_SAMP_CLK_RATE if job.clock is not None:
                return pb.GetTimingAttributeDoubleResponse(value=job.clock.rate)
            case pb.TIMING_ATTRIBUTE_SAMP_CLK_MAX_RATE:
                return pb.GetTimingAttributeDoubleResponse(value=job.highest_rate)
            case pb.TIMING_ATTRIBUTE_AI_CONV_RATE if len(job.devices) == 1:
                return pb.GetTimingAttributeDoubleResponse(value=_conversion_rate(job, *job.devices))
            case other:
                raise unsupported(other)

    def GetTimingAttributeExDouble(
        self, request: pb.GetTimingAttributeExDoubleRequest, context: object
    ) -> pb.GetTimingAttributeExDoubleResponse:
        if (attribute := attribute_of(request)) != pb.TIMING_ATTRIBUTE_AI_CONV_RATE:
            raise unsupported(attribute)
        device = self._driver.catalogue.device(request.device_names)
        return pb.GetTimingAttributeExDoubleResponse(value=_conversion_rate(_sampled(self._task(request)), device.name))

    def GetTimingAttributeString(
        self, request: pb.GetTimingAttributeStringRequest, context: object
    ) -> pb.GetTimingAttributeStringResponse:
        job = _sampled(self._task(request))
        match attribute_of(request):
            case pb.TIMING_ATTRIBUTE_SAMP_CLK_TERM:
                return pb.GetTimingAttributeStringResponse(value=self._terminal(request, job, "SampClk.Term"))
            case pb.TIMING_ATTRIBUTE_SAMP_CLK_SRC:
                return pb.GetTimingAttributeStringResponse(value=job.source or "OnboardClock")
            case other:
                raise unsupported(other)

    def GetTimingAttributeInt32(
        self, request: pb.GetTimingAttributeInt32Request, context: object
    ) -> pb.GetTimingAttributeInt32Response:
        if (attribute := attribute_of(request)) != pb.TIMING_ATTRIBUTE_SAMP_QUANT_SAMP_MODE:
            raise unsupported(attribute)
        clocked = _sampled(self._task(request)).clock is not None
        mode = AcquisitionType.CONTINUOUS if clocked else AcquisitionType.FINITE
        return pb.GetTimingAttributeInt32Response(value_raw=mode.value)

    def GetTimingAttributeUInt32(
        self, request: pb.GetTimingAttributeUInt32Request, context: object
    ) -> pb.GetTimingAttributeUInt32Response:
        if (attribute := attribute_of(request)) != pb.TIMING_ATTRIBUTE_SAMP_TIMING_ENGINE:
            raise unsupported(attribute)
        job = _sampled(self._task(request))
        if len(job.engines) == 1:
            raise unsupported(attribute)
        if (number := job.engine.number(job.engines)) is None:
            raise undefined("SampTimingEngine", request.task.name)
        return pb.GetTimingAttributeUInt32Response(value=number)

    def SetTimingAttributeUInt32(
        self, request: pb.SetTimingAttributeUInt32Request, context: object
    ) -> pb.SetTimingAttributeUInt32Response:
        if (attribute := attribute_of(request)) != pb.TIMING_ATTRIBUTE_SAMP_TIMING_ENGINE:
            raise unsupported(attribute)
        job = self._changeable(request)
        job.engine.request(request.value, job.engines)
        return pb.SetTimingAttributeUInt32Response()

    def CfgDigEdgeStartTrig(
        self, request: pb.CfgDigEdgeStartTrigRequest, context: object
    ) -> pb.CfgDigEdgeStartTrigResponse:
        if (request.trigger_edge_raw or request.trigger_edge) != Edge.RISING.value:
            raise NotEmulated("a start trigger on a falling edge")
        job = self._task(request).required_job
        (job if isinstance(job, CounterOutput) else self._changeable(request)).awaited = request.trigger_source
        return pb.CfgDigEdgeStartTrigResponse()

    def DisableStartTrig(self, request: pb.DisableStartTrigRequest, context: object) -> pb.DisableStartTrigResponse:
        self._changeable(request).awaited = None
        return pb.DisableStartTrigResponse()

    def GetTrigAttributeString(
        self, request: pb.GetTrigAttributeStringRequest, context: object
    ) -> pb.GetTrigAttributeStringResponse:
        job = _sampled(self._task(request))
        match attribute_of(request):
            case pb.TRIGGER_ATTRIBUTE_START_TRIG_TERM:
                return pb.GetTrigAttributeStringResponse(value=self._terminal(request, job, "Start.Term"))
            case pb.TRIGGER_ATTRIBUTE_DIG_EDGE_START_TRIG_SRC:
                return pb.GetTrigAttributeStringResponse(value=job.awaited or "")
            case other:
                raise unsupported(other)

    def GetBufferAttributeUInt32(
        self, request: pb.GetBufferAttributeUInt32Request, context: object
    ) -> pb.GetBufferAttributeUInt32Response:
        return pb.GetBufferAttributeUInt32Response(value=self._buffered(request, attribute_of(request)).buffer)

    def SetBufferAttributeUInt32(
        self, request: pb.SetBufferAttributeUInt32Request, context: object
    ) -> pb.SetBufferAttributeUInt32Response:
        self._task(request).require_stopped()
        self._buffered(request, attribute_of(request)).buffer = request.value
        return pb.SetBufferAttributeUInt32Response()

    def CfgInputBuffer(self, request: pb.CfgInputBufferRequest, context: object) -> pb.CfgInputBufferResponse:
        task = self._task(request)
        task.require_stopped()
        task.doing(AnalogInput).buffer = request.num_samps_per_chan
        return pb.CfgInputBufferResponse()

    def CfgOutputBuffer(self, request: pb.CfgOutputBufferRequest, context: object) -> pb.CfgOutputBufferResponse:
        task = self._task(request)
        task.require_stopped()
        task.doing(AnalogOutput).buffer = request.num_samps_per_chan
        return pb.CfgOutputBufferResponse()

    def _terminal(self, request: AboutTask, job: Sampled, what: str) -> str:
        """The name of a terminal of the task. Raises DaqmxFailure while the task's timing engine is undefined."""
        if job.clock is None:
            return ""
        if job.engine.number(job.engines) is None:
            raise undefined(what, request.task.name)
        return (job.clock_terminal if what == "SampClk.Term" else job.start_terminal) or ""

    def _changeable(self, request: AboutTask) -> Sampled:
        task = self._task(request)
        task.require_stopped()
        return _sampled(task)

    def _buffered(self, request: AboutTask, attribute: int) -> Sampled:
        match attribute:
            case pb.BUFFER_ATTRIBUTE_INPUT_BUF_SIZE:
                return self._task(request).doing(AnalogInput)
            case pb.BUFFER_ATTRIBUTE_OUTPUT_BUF_SIZE:
                return self._task(request).doing(AnalogOutput)
            case other:
                raise unsupported(other)
