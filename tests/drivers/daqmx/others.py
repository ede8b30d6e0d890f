"""Other programs on the same device server, each with the real client."""

from contextlib import ExitStack
from typing import Any, Self, cast

import grpc
import nidaqmx
from nidaqmx.constants import AcquisitionType, TaskMode
from nidaqmx.grpc_session_options import GrpcSessionOptions


class Another:
    """Another program; what it holds it holds until the context ends."""

    def __init__(self, server: str) -> None:
        self._channel: Any = cast(Any, grpc).insecure_channel(server)
        self._held = ExitStack()

    def holds(self, kind: str) -> None:
        """Reserve the "inputs", "output" or "line" of Dev1, or an "engine" of the inputs of cRIO1."""
        task: Any = self._held.enter_context(
            nidaqmx.Task("somebody_else", grpc_options=GrpcSessionOptions(self._channel, "somebody_else"))
        )
        if kind == "line":
            task.do_channels.add_do_chan("Dev1/port0/line0")
        elif kind == "output":
            task.ao_channels.add_ao_voltage_chan("Dev1/ao0")
        elif kind == "engine":
            task.ai_channels.add_ai_voltage_chan("cRIO1Mod2/ai0")
            task.timing.cfg_samp_clk_timing(1000.0, sample_mode=AcquisitionType.CONTINUOUS)
        else:
            task.ai_channels.add_ai_voltage_chan("Dev1/ai7")
            task.timing.cfg_samp_clk_timing(1000.0, sample_mode=AcquisitionType.CONTINUOUS)
        task.control(TaskMode.TASK_RESERVE)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._held.close()
        self._channel.close()
