"""Analogue input tasks: channels, buffers and reads."""

import threading
from collections.abc import Callable
from math import ceil

import numpy as np
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from drivers.emulation.daqmx.conversion import DeltaSigma, conversion_period
from drivers.emulation.daqmx.device import (
    CLOCK,
    START,
    InputChannel,
    Seen,
)
from drivers.emulation.daqmx.engines import EngineSlot
from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated
from drivers.emulation.daqmx.timing import SampleClock, deadline_after, wait_until
from drivers.emulation.plant import Plant
from sim.channel import Counts
from sim.errors import InvalidInput

_AUTOMATIC_BUFFER = ((100.0, 1_000), (10_000.0, 10_000), (1.0e6, 100_000), (float("inf"), 1_000_000))
"""Sizes of the driver's default buffer in samples per channel, with the highest sample rate for each (NI-DAQmx help,
"How Is Buffer Size Determined?").
"""


class AnalogInput:
    """`Job` of an analogue input task.

    `changed` guards it, and wakes threads that wait for samples. The number of acquired samples includes only those
    transferred to the computer, in whole packets of `packet` samples.
    """

    def __init__(self, plant: Plant, changed: threading.Condition, packet: int = 1) -> None:
        self._plant = plant
        self._packet = packet
        self._changed = changed
        self._reading = threading.Lock()
        self.inputs: list[InputChannel] = []
        self.clock: SampleClock | None = None
        self.awaited: str | None = None
        self.source: str | None = None
        self.engine = EngineSlot()
        self._buffer: int | None = None
        self._first: int | None = None
        self._position = 0
        self.run = 0
        """Number of earlier runs of the task."""

    @property
    def channels(self) -> tuple[str, ...]:
        return tuple(channel.name for channel in self.inputs)

    @property
    def devices(self) -> frozenset[str]:
        return frozenset(channel.device.name for channel in self.inputs)

    @property
    def resources(self) -> frozenset[str]:
        engine = self.engine.resource(self.inputs[0].device, self.engines)
        return frozenset({engine, *(f"{name} analogue input" for name in self.devices)})

    @property
    def engines(self) -> tuple[str, ...]:
        """The timing engines of the chassis or device of the inputs."""
        return self.inputs[0].device.input_engines

    @property
    def start_terminal(self) -> str | None:
        return self.engine.terminal(self.inputs[0].device, self.engines, START)

    @property
    def clock_terminal(self) -> str | None:
        return self.engine.terminal(self.inputs[0].device, self.engines, CLOCK)

    @property
    def buffer(self) -> int:
        """Size of the driver's buffer in samples per channel."""
        if self._buffer is not None or self.clock is None:
            return self._buffer or 0
        automatic = next(size for rate, size in _AUTOMATIC_BUFFER if self.clock.rate <= rate)
        return max(automatic, self.clock.samples)

    @buffer.setter
    def buffer(self, samples: int) -> None:
        self._buffer = samples

    @property
    def highest_rate(self) -> float:
        """Highest sample rate per channel that all devices of the task support [1/s]."""
        rates: list[float] = []
        for name in self.devices:
            mine = [channel.inputs for channel in self.inputs if channel.device.name == name]
            shared = mine[0].simultaneous or len(mine) == 1
            rates.append(mine[0].rate if shared else mine[0].total_rate / len(mine))
        return min(rates)

    @property
    def converters(self) -> list[DeltaSigma]:
        """The task's delta-sigma converters, which restrict its sample rates; empty if it has none."""
        return [one.inputs.delta_sigma for one in self.inputs if one.inputs.delta_sigma is not None]

    def conversion(self, device: str) -> float | None:
        """Time between the conversions of a multiplexed device's inputs [s]; None for other devices."""
        mine = [channel for channel in self.inputs if channel.device.name == device]
        if self.clock is None or not mine or (fastest := mine[0].inputs.conversion) is None:
            return None
        return conversion_period(fastest, len(mine), self.clock.rate)

    @property
    def delays(self) -> NDArray[np.float64]:
        """Delay of each input's samples [s], shape (channels,); all 0 without a clock.

        It is the delay of the converter's filter, less the part that the device removes, and negative for the later
        inputs of a multiplexer.
        """
        if self.clock is None:
            return np.zeros(len(self.inputs))
        found: list[float] = []
        places: dict[str, int] = {}
        for channel in self.inputs:
            filtering = channel.inputs.delta_sigma
            place = places[channel.device.name] = places.get(channel.device.name, -1) + 1
            step = self.conversion(channel.device.name) or 0.0
            if filtering is None:
                found.append(-place * step)
                continue
            delay = filtering.delay(self.clock.rate)
            if filtering.readable and channel.filter.removed:
                delay -= round(filtering.samples) / self.clock.rate
            found.append(delay)
        return np.array(found)

    @property
    def acquired(self) -> int:
        """Samples per channel acquired since the start, read or not, in whole packets."""
        self._require_not_overrun()
        return self._passed(self._plant.tick()) // self._packet * self._packet

    @property
    def available(self) -> int:
        """Samples per channel available to a read."""
        self._require_not_overrun()
        return self._ready() - self._position

    @property
    def position(self) -> int:
        """Index of the next sample to be read."""
        return self._position

    def engage(self, is_free: Callable[[str], bool]) -> None:
        self.engine.choose(self.inputs[0].device, self.engines, is_free)

    def check(self) -> None:
        if self.clock is not None and not self.clock.is_whole(self._plant.tick_rate):
            raise NotEmulated(
                f"a sample rate of {self.clock.rate:g}/s on a plant with {self._plant.tick_rate:g} ticks per second"
            )

    def begin(self, tick: int) -> None:
        self._first, self._position = tick, 0

    def end(self) -> None:
        self._first = None
        self.run += 1
        self.engine.release()

    def verdict(self) -> None:
        pass

    def read(self, n: int, timeout: float, run: int) -> Seen:
        """The plant's counts at the next `n` samples of the run `run`, shape (n, channels); fewer after a time-out.

        Waits for the samples; called without holding `changed`. Raises DaqmxFailure if samples were lost, or the run
        has ended.
        """
        with self._reading:
            with self._changed:
                first, ticks, divider = self._take(n, deadline_after(timeout), run)
            return self._fetch(first, ticks, divider)

    def _take(self, n: int, deadline: float, run: int) -> tuple[int, int, int]:
        """Wait for samples and advance; returns the tick of the first sample, the number of samples, and the ticks
        between them.
        """
        if self.clock is None:
            # sampling on demand: each read returns the present value
            self._first, self._position = self._plant.tick() + 1, 0
        self._require_run(run)
        self._require_not_overrun()
        end = self._position + n
        while self._ready() < end:
            due = None if self._first is None else self._tick_of(end - 1) + 1 + self._ahead
            instant = float("inf") if due is None else self._plant.time_of(due)
            if not wait_until(self._changed, instant, deadline):
                break
            self._require_run(run)
        got = min(self._ready(), end) - self._position
        first = self._tick_of(self._position) if got else 0
        self._position += got
        return first, got, self.clock.divider if self.clock else 1

    def _fetch(self, first: int, n: int, divider: int) -> Seen:
        """The plant's counts, read without holding `changed`, since the plant may have to compute them first."""
        if n == 0:
            return np.zeros((0, len(self.inputs)), np.int16)
        shifts = self.delays * self._plant.tick_rate
        if not shifts.any():
            return self._at(first, (n - 1) * divider + 1)[::divider]
        # before the first tick of the plant, its signals are taken as constant at their first values
        begin = max(first - ceil(float(shifts.max())), 0)
        rows = self._at(begin, first + (n - 1) * divider + self._ahead - begin + 1).astype(np.float64)
        ticks = first + divider * np.arange(n)
        seen = np.empty((n, len(self.inputs)))
        for k, shift in enumerate(shifts):
            seen[:, k] = np.interp(ticks - shift, begin + np.arange(len(rows)), rows[:, k])
        return seen

    def _at(self, first: int, n: int) -> Counts:
        """The plant's counts at `n` consecutive ticks from `first` on, shape (n, channels)."""
        columns = [channel.terminal for channel in self.inputs]
        try:
            rows = self._plant.inputs(first, n)
        except InvalidInput as error:
            raise _lost() from error
        if max(columns) < self._plant.terminals:
            return rows[:, columns]
        padded = np.column_stack((rows, np.zeros(n, rows.dtype)))
        return padded[:, [min(column, self._plant.terminals) for column in columns]]

    @property
    def _ahead(self) -> int:
        """Time from the tick of a sample until its last input is sampled [ticks], rounded up."""
        return ceil(max(-float(self.delays.min()) * self._plant.tick_rate, 0.0))

    def raw(self, counts: Seen) -> NDArray[np.int16 | np.int32]:
        """Raw counts of the device for counts of the plant, shape (n, channels)."""
        first = self.inputs[0].converter
        if all(channel.converter.is_like(first) for channel in self.inputs):
            return first.raw(counts)
        columns = [channel.converter.raw(counts[:, k]) for k, channel in enumerate(self.inputs)]
        return np.column_stack(columns)

    def volts(self, counts: Seen) -> NDArray[np.float64]:
        """Volts for counts of the plant, shape (n, channels)."""
        raw = self.raw(counts)
        return np.column_stack([channel.converter.volts(raw[:, k]) for k, channel in enumerate(self.inputs)])

    def _tick_of(self, sample: int) -> int:
        assert self._first is not None
        return self._first + sample * (self.clock.divider if self.clock else 1)

    def _passed(self, tick: int) -> int:
        """Number of samples acquired up to `tick`."""
        if self._first is None:
            return 0
        return self.clock.passed(self._first, tick) if self.clock else max(tick - self._first + 1, 0)

    def _ready(self) -> int:
        """Number of readable samples: the plant completes a tick when the next one is due."""
        return self._passed(self._plant.tick() - 1 - self._ahead)

    def _require_run(self, run: int) -> None:
        if run != self.run:
            raise DaqmxFailure(
                DAQmxErrors.RUNTIME_ABORTING_ROUTING,
                "Operation cannot be completed: the task was stopped or aborted meanwhile.",
            )

    def _require_not_overrun(self) -> None:
        if self.clock is not None and self._ready() - self._position > self.buffer:
            raise _lost()


def _lost() -> DaqmxFailure:
    return DaqmxFailure(
        DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE,
        "The application is not able to keep up with the hardware acquisition.\n\n"
        "Increasing the buffer size, reading the data more frequently, or specifying a fixed number of samples to"
        " read instead of reading all available samples might correct the problem.",
    )
