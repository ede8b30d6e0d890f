"""Analogue input tasks: samples go by; the reader has a place among them."""

import threading

import numpy as np
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from drivers.emulation.daqmx.errors import DaqmxFailure
from drivers.emulation.daqmx.input_channel import InputChannel
from drivers.emulation.daqmx.timing import SampleClock, deadline_after, wait_until
from drivers.emulation.plant import Plant
from sim.channel import Counts
from sim.errors import InvalidInput

_AUTOMATIC_BUFFER = ((100.0, 1_000), (10_000.0, 10_000), (1.0e6, 100_000), (float("inf"), 1_000_000))
"""Sample rate up to which the driver's own buffer holds so many samples per channel (NI-DAQmx help, "How Is Buffer
Size Determined?")."""


class AnalogInput:
    """A `Job`. `changed` guards it, and wakes whoever waits for samples.

    The counter of samples that were taken shows whole packets of `packet` samples: what has reached the computer.
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
        self._buffer: int | None = None
        self._first: int | None = None
        self._position = 0
        self.run = 0
        """How many runs have ended before this one."""

    @property
    def channels(self) -> tuple[str, ...]:
        return tuple(channel.name for channel in self.inputs)

    @property
    def devices(self) -> frozenset[str]:
        return frozenset(channel.device.name for channel in self.inputs)

    @property
    def resources(self) -> frozenset[str]:
        return frozenset(f"{channel.device.clockwork} analogue input" for channel in self.inputs)

    @property
    def start_terminal(self) -> str | None:
        return self.inputs[0].device.input_start

    @property
    def clock_terminal(self) -> str | None:
        return self.inputs[0].device.input_clock

    @property
    def buffer(self) -> int:
        """How many samples per channel the driver keeps for a reader who is late."""
        if self._buffer is not None or self.clock is None:
            return self._buffer or 0
        automatic = next(size for rate, size in _AUTOMATIC_BUFFER if self.clock.rate <= rate)
        return max(automatic, self.clock.samples)

    @buffer.setter
    def buffer(self, samples: int) -> None:
        self._buffer = samples

    @property
    def highest_rate(self) -> float:
        """Samples per second and channel that the slowest of its devices can do."""
        rates: list[float] = []
        for name in self.devices:
            mine = [channel.inputs for channel in self.inputs if channel.device.name == name]
            shared = mine[0].simultaneous or len(mine) == 1
            rates.append(mine[0].rate if shared else mine[0].total_rate / len(mine))
        return min(rates)

    @property
    def acquired(self) -> int:
        """How many samples per channel have been taken: counted by the clock, whoever reads, in whole packets."""
        self._require_not_overrun()
        return self._passed(self._plant.tick()) // self._packet * self._packet

    @property
    def available(self) -> int:
        """How many samples per channel can be read at once."""
        self._require_not_overrun()
        return self._ready() - self._position

    @property
    def position(self) -> int:
        """The number of the next sample that is read."""
        return self._position

    def check(self) -> None:
        pass

    def begin(self, tick: int) -> None:
        self._first, self._position = tick, 0

    def end(self) -> None:
        self._first = None
        self.run += 1

    def verdict(self) -> None:
        pass

    def read(self, n: int, timeout: float, run: int) -> Counts:
        """The plant's counts at the next `n` samples of this run; fewer when the time is over.

        Shape (n, channels). Waits; called without `changed`. Raises DaqmxFailure when samples were lost, or the run
        has ended.
        """
        with self._reading:
            with self._changed:
                first, ticks, divider = self._take(n, deadline_after(timeout), run)
            return self._fetch(first, ticks, divider)

    def _take(self, n: int, deadline: float, run: int) -> tuple[int, int, int]:
        """Wait for samples and move on: tick of the first, their number, ticks from one to the next."""
        if self.clock is None:
            # on demand: the present, as often as asked for
            self._first, self._position = self._plant.tick() + 1, 0
        self._require_run(run)
        self._require_not_overrun()
        end = self._position + n
        while self._ready() < end:
            instant = float("inf") if self._first is None else self._plant.time_of(self._tick_of(end - 1) + 1)
            if not wait_until(self._changed, instant, deadline):
                break
            self._require_run(run)
        got = min(self._ready(), end) - self._position
        first = self._tick_of(self._position) if got else 0
        self._position += got
        return first, got, self.clock.divider if self.clock else 1

    def _fetch(self, first: int, n: int, divider: int) -> Counts:
        """The plant's counts; outside `changed`, because the plant may have to compute them first."""
        columns = [channel.terminal for channel in self.inputs]
        if n == 0:
            return np.zeros((0, len(columns)), np.int16)
        try:
            rows = self._plant.inputs(first, (n - 1) * divider + 1)[::divider]
        except InvalidInput as error:
            raise _lost() from error
        if max(columns) < self._plant.terminals:
            return rows[:, columns]
        padded = np.column_stack((rows, np.zeros(n, rows.dtype)))
        return padded[:, [min(column, self._plant.terminals) for column in columns]]

    def raw(self, counts: Counts) -> NDArray[np.int16 | np.int32]:
        """Raw counts of the device for counts of the plant, shape (n, channels)."""
        first = self.inputs[0].converter
        if all(channel.converter.is_like(first) for channel in self.inputs):
            return first.raw(counts)
        columns = [channel.converter.raw(counts[:, k]) for k, channel in enumerate(self.inputs)]
        return np.column_stack(columns)

    def volts(self, counts: Counts) -> NDArray[np.float64]:
        """Volts for counts of the plant, shape (n, channels)."""
        raw = self.raw(counts)
        return np.column_stack([channel.converter.volts(raw[:, k]) for k, channel in enumerate(self.inputs)])

    def _tick_of(self, sample: int) -> int:
        assert self._first is not None
        return self._first + sample * (self.clock.divider if self.clock else 1)

    def _passed(self, tick: int) -> int:
        """How many samples have been taken when `tick` has come."""
        if self._first is None:
            return 0
        return self.clock.passed(self._first, tick) if self.clock else max(tick - self._first + 1, 0)

    def _ready(self) -> int:
        """How many samples could have been read: the plant gives a tick when the next one comes."""
        return self._passed(self._plant.tick() - 1)

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
