"""A plant with nothing but wires, an emulated DAQ device at it, and the real nidaqmx client."""

import threading
import time
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from math import floor
from typing import Any, Self

import grpc
import nidaqmx
import numpy as np
from nidaqmx.constants import AcquisitionType, RegenerationMode
from nidaqmx.errors import DaqResourceWarning, Error
from nidaqmx.grpc_session_options import GrpcSessionOptions, SessionInitializationBehavior
from nidaqmx.stream_readers import AnalogUnscaledReader
from nidaqmx.stream_writers import AnalogSingleChannelWriter
from nidaqmx.system import System
from nidaqmx.system.watchdog import WatchdogTask
from numpy.typing import NDArray

from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.lines import Wires as LineWires
from drivers.emulation.daqmx.models import x_series
from drivers.emulation.daqmx.server import DaqServer
from drivers.emulation.plant import Output
from sim.channel import Counts
from sim.sensors import Converter
from tests.patience import eventually

RATE = 2000.0
CONVERTER = Converter(bits=16, range=10.0)
LSB = 20.0 / 65536.0
CYCLE = 30_000
"""The clock at terminal 1 counts modulo this."""
STILL = 1234
"""Counts at terminal 2."""
NEW = SessionInitializationBehavior.INITIALIZE_SERVER_SESSION
ATTACH = SessionInitializationBehavior.ATTACH_TO_SERVER_SESSION


class Wires:
    """A `Plant`: terminal 0 is the output at the same tick, 1 the number of the tick, 2 a constant, 3 at its rail.

    It is `speed` times as fast as it says.
    """

    tick_rate = RATE
    terminals = 4

    def __init__(self, speed: float = 1.0) -> None:
        self._true_rate = RATE * speed
        self._began = time.monotonic()
        self._lock = threading.RLock()
        self._output: Output | None = None
        self._played = np.zeros(1_000_000)
        self._next = 0
        self.enabled = False

    def tick(self) -> int:
        return floor((time.monotonic() - self._began) * self._true_rate)

    def time_of(self, tick: int) -> float:
        return self._began + tick / self._true_rate

    def inputs(self, first: int, n: int) -> Counts:
        assert first >= 0
        assert first + n <= self.tick(), "the future is asked for"
        ticks = np.arange(first, first + n)
        counts = np.empty((n, self.terminals), np.int16)
        counts[:, 0] = np.rint(self.played(first + n)[first:] / LSB)
        counts[:, 1] = ticks % CYCLE
        counts[:, 2] = STILL
        counts[:, 3] = 32767
        return counts

    def wire(self, output: Output) -> None:
        self._output = output

    def enable(self, closed: bool) -> None:
        self.enabled = closed

    def played(self, end: int) -> NDArray[np.float64]:
        """Volts at the output at all ticks before `end`."""
        with self._lock:
            if end > self._next and self._output is not None:
                self._played[self._next : end] = self._output(self._next, end - self._next)
                self._next = end
            return self._played[:end].copy()

    def pass_ticks(self, n: int) -> None:
        """Wait until `n` more ticks have passed."""
        end = self.tick() + n
        eventually(lambda: self.tick() >= end)

    @property
    def output(self) -> float:
        """Volts at the output at the next tick."""
        self.pass_ticks(2)
        return float(self.played(self.tick())[-1])


class Desk:
    """Plant, server and client; everything that was opened is closed at the end."""

    def __init__(
        self,
        devices: Sequence[DeviceModel] = (),
        speed: float = 1.0,
        packet: int = 1,
        output_clock_error: float = 0.0,
        wires: LineWires | None = None,
        drive: str | None = None,
    ) -> None:
        self.plant = Wires(speed)
        self.server = DaqServer(
            self.plant,
            devices or [x_series()],
            converter=CONVERTER,
            packet=packet,
            output_clock_error=output_clock_error,
            wires=wires,
            drive=drive,
        )
        self.server.start()
        self.channel: Any = grpc.insecure_channel(self.server.address)
        self._opened = ExitStack()

    def options(self, name: str = "", behavior: SessionInitializationBehavior = NEW) -> GrpcSessionOptions:
        return GrpcSessionOptions(self.channel, name, initialization_behavior=behavior)

    @property
    def system(self) -> Any:
        return System.remote(self.options())

    def task(self, name: str, behavior: SessionInitializationBehavior = NEW) -> Any:
        task = nidaqmx.Task(name, grpc_options=self.options(name, behavior))
        self._opened.callback(_close, task)
        return task

    def watchdog(self, timeout: float, device: str = "Dev1") -> Any:
        task = WatchdogTask(device, "wd", timeout, grpc_options=self.options("wd"))
        self._opened.callback(_close, task)
        return task

    def inputs(
        self, channels: str = "Dev1/ai0:3", rate: float = RATE, buffer: int = 20_000, limit: float = 10.0
    ) -> Any:
        """A clocked input task that does not run yet."""
        task = self.task("in")
        task.ai_channels.add_ai_voltage_chan(channels, min_val=-limit, max_val=limit)
        task.timing.cfg_samp_clk_timing(rate, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=buffer)
        return task

    def output(self, channel: str = "Dev1/ao0", rate: float = RATE, buffer: int = 2000, name: str = "out") -> Any:
        """A clocked output task that plays each sample once; nothing is written yet."""
        task = self.task(name)
        task.ao_channels.add_ao_voltage_chan(channel, min_val=-10.0, max_val=10.0)
        task.timing.cfg_samp_clk_timing(rate, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=buffer)
        task.out_stream.regen_mode = RegenerationMode.DONT_ALLOW_REGENERATION
        task.out_stream.output_buf_size = buffer
        return task

    def close(self) -> None:
        self._opened.close()
        self.channel.close()
        self.server.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def counts(task: Any, n: int, timeout: float = 20.0) -> NDArray[np.int16]:
    """The next `n` raw counts, shape (n, channels)."""
    raw = np.empty((len(task.channels.channel_names), n), np.int16)
    assert AnalogUnscaledReader(task.in_stream).read_int16(raw, n, timeout) == n
    return raw.T.copy()


def write(task: Any, volts: NDArray[np.float64], timeout: float = 20.0) -> int:
    """Append samples to an output task."""
    return AnalogSingleChannelWriter(task.out_stream, auto_start=False).write_many_sample(volts, timeout)


def staircase(n: int) -> NDArray[np.float64]:
    """`n` voltages that fall on counts; no two of 1000 in a row are the same."""
    return ((np.arange(n) * 37) % 1000 - 500) * LSB


def _close(task: Any) -> None:
    # what the test has closed already warns
    with suppress(Error, ValueError, DaqResourceWarning):
        task.close()
    # where the server is gone, nobody can close it, and nidaqmx need not complain
    task._close_on_exit = False
