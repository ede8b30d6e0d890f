"""Analogue output tasks: single values at once, or samples that wait and are played once each."""

import threading
from dataclasses import dataclass

import numpy as np
from nidaqmx.constants import OutputDataTransferCondition, RegenerationMode
from nidaqmx.error_codes import DAQmxErrors
from numpy.typing import NDArray

from drivers.emulation.daqmx.device import DeviceModel
from drivers.emulation.daqmx.errors import DaqmxFailure, NotEmulated
from drivers.emulation.daqmx.generation import Generation
from drivers.emulation.daqmx.terminals import Instant, OutputTerminal
from drivers.emulation.daqmx.timing import SampleClock, deadline_after, wait_until
from drivers.emulation.plant import Plant

TRANSFER_CONDITIONS = {
    OutputDataTransferCondition.ON_BOARD_MEMORY_EMPTY.value: 0.0,
    OutputDataTransferCondition.ON_BOARD_MEMORY_HALF_FULL_OR_LESS.value: 0.5,
    OutputDataTransferCondition.ON_BOARD_MEMORY_LESS_THAN_FULL.value: 1.0,
}
"""Values of AO.DataXferReqCond, and how much of the device's memory is filled ahead."""


@dataclass(frozen=True)
class OutputChannel:
    """One channel of an output task."""

    name: str
    device: DeviceModel
    range: float
    minimum: float
    maximum: float
    memory: int
    highest_rate: float
    terminal: OutputTerminal


class AnalogOutput:
    """A `Job`. `changed` guards it, and wakes whoever waits for room."""

    def __init__(self, plant: Plant, instant: Instant, changed: threading.Condition) -> None:
        self._plant = plant
        self._instant = instant
        self._changed = changed
        self.outputs: list[OutputChannel] = []
        self._clock: SampleClock | None = None
        self.awaited: str | None = None
        self.source: str | None = None
        self.regeneration = RegenerationMode.ALLOW_REGENERATION.value
        self.transfer = OutputDataTransferCondition.ON_BOARD_MEMORY_LESS_THAN_FULL.value
        self._buffer: int | None = None
        self._generation: Generation | None = None
        self._playing = False
        self._ran_dry = False
        self._run = 0

    @property
    def channels(self) -> tuple[str, ...]:
        return tuple(channel.name for channel in self.outputs)

    @property
    def devices(self) -> frozenset[str]:
        return frozenset(channel.device.name for channel in self.outputs)

    @property
    def resources(self) -> frozenset[str]:
        own = {f"{channel.device.name} {channel.name}" for channel in self.outputs}
        clocks = {f"{channel.device.clockwork} output clock" for channel in self.outputs if self.clock}
        return frozenset(own | clocks)

    @property
    def start_terminal(self) -> str | None:
        return self.outputs[0].device.output_start if self.clock else None

    @property
    def clock_terminal(self) -> str | None:
        return self.outputs[0].device.output_clock if self.clock else None

    @property
    def highest_rate(self) -> float:
        """Samples per second and channel that the slowest of its devices can do."""
        return min(channel.highest_rate for channel in self.outputs)

    @property
    def clock(self) -> SampleClock | None:
        """The sample clock; without one, values go out when they are written."""
        return self._clock

    @clock.setter
    def clock(self, clock: SampleClock) -> None:
        self._clock, self._generation = clock, None

    @property
    def buffer(self) -> int:
        """How many samples per channel wait in the driver at most; 0 as long as nothing has said so."""
        return self._buffer or 0

    @buffer.setter
    def buffer(self, samples: int) -> None:
        self._buffer = samples
        self._generation = None

    @property
    def written(self) -> int:
        """How many samples per channel were written."""
        return self._generation.written if self._generation else 0

    @property
    def generated(self) -> int:
        """How many samples per channel have left: counted by the clock."""
        self._require_not_dry()
        return self._generation.played(self._instant.now) if self._generation and self._playing else 0

    @property
    def space(self) -> int:
        """How many samples per channel can be written at once."""
        self._require_not_dry()
        return self._generation.space(self._instant.now) if self._generation else self.buffer

    def check(self) -> None:
        if self.clock is None:
            return
        if self.regeneration != RegenerationMode.DONT_ALLOW_REGENERATION.value:
            raise NotEmulated("an output that plays its samples over and over")
        if self.written == 0:
            raise DaqmxFailure(
                DAQmxErrors.OUTPUT_BUFFER_EMPTY,
                "Generation cannot be started, because the selected buffer size is too small or no samples were"
                " written.\n\nWrite samples before starting the task.",
            )

    def begin(self, tick: int) -> None:
        if self._generation is None:
            return
        self._generation.begin(tick)
        self._playing = True
        for index, channel in enumerate(self.outputs):
            channel.terminal.follow(tick, self._generation.signal(index))

    def end(self) -> None:
        if self._playing and self._generation is not None:
            self._ran_dry = self._generation.dry(self._instant.now)
            for channel in self.outputs:
                channel.terminal.freeze()
        self._playing = False
        self._generation = None
        self._run += 1

    def verdict(self) -> None:
        dry, self._ran_dry = self._ran_dry, False
        if dry:
            raise _dried_up()

    def put(self, volts: NDArray[np.float64]) -> None:
        """Go to these values now, shape (channels,)."""
        self._require_in_range(volts[np.newaxis])
        with self._instant.next():
            for channel, value in zip(self.outputs, volts, strict=True):
                channel.terminal.hold(float(value))

    def write(self, volts: NDArray[np.float64], timeout: float) -> int:
        """Append samples, shape (n, channels) [V]; waits for room. How many there were.

        Raises DaqmxFailure with the number of samples that were taken.
        """
        self._require_in_range(volts)
        deadline = deadline_after(timeout)
        generation = self._prepared(volts.shape[0])
        run, taken = self._run, 0
        while True:
            with self._instant.next() as tick:
                # in one moment with the plant, which must not see the samples come after they were due
                if self._playing and generation.dry(tick - 1):
                    raise _dried_up(taken)
                part = volts[taken : taken + max(generation.space(tick - 1), 0)]
                generation.append(part)
            taken += part.shape[0]
            if taken == volts.shape[0]:
                return taken
            if not self._wait_for_room(generation, volts.shape[0] - taken, deadline):
                raise DaqmxFailure(
                    DAQmxErrors.SAMPLES_CAN_NOT_YET_BE_WRITTEN,
                    "Some or all of the samples to write could not be written yet.\n\n"
                    "Write fewer samples, wait longer, or start the task.",
                    samples_written=taken,
                )
            if run != self._run:
                raise DaqmxFailure(
                    DAQmxErrors.RUNTIME_ABORTING_ROUTING,
                    "Operation cannot be completed: the task was stopped or aborted meanwhile.",
                    samples_written=taken,
                )

    def _wait_for_room(self, generation: Generation, samples: int, deadline: float) -> bool:
        tick = generation.tick_of_space(samples)
        return wait_until(self._changed, float("inf") if tick is None else self._plant.time_of(tick), deadline)

    def _prepared(self, samples: int) -> Generation:
        """What the samples go to; the first write sizes the buffer when nobody did."""
        assert self.clock is not None
        if self._generation is None:
            self._buffer = self._buffer or samples
            share = TRANSFER_CONDITIONS[self.transfer]
            memory = max(round(share * min(channel.memory for channel in self.outputs)), 1)
            self._generation = Generation(len(self.outputs), self.clock, self._buffer, memory)
        return self._generation

    def _require_in_range(self, volts: NDArray[np.float64]) -> None:
        for index, channel in enumerate(self.outputs):
            values = volts[:, index]
            if not ((values >= channel.minimum) & (values <= channel.maximum)).all():
                raise DaqmxFailure(
                    DAQmxErrors.INVALID_AO_DATA_WRITE,
                    "Attempted writing analog data that is too large or too small.\n\n"
                    f"Channel Name: {channel.name}\nMinimum Value: {channel.minimum}\nMaximum Value: {channel.maximum}",
                )

    def _require_not_dry(self) -> None:
        if self._playing and self._generation is not None and self._generation.dry(self._instant.now):
            raise _dried_up()


def _dried_up(taken: int = 0) -> DaqmxFailure:
    return DaqmxFailure(
        DAQmxErrors.GEN_STOPPED_TO_PREVENT_REGEN_OF_OLD_SAMPLES,
        "The generation has stopped to prevent the regeneration of old samples. Your application was unable to write"
        " samples to the background buffer fast enough to prevent old samples from being regenerated.",
        samples_written=taken,
    )
