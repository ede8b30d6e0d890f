"""Counter outputs: finite trains of pulses."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.emulation.daqmx.errors import NotEmulated
from drivers.emulation.plant import Plant

Edges = Callable[[NDArray[np.float64]], None]
"""Receiver of the times [s] of all edges of a train of n pulses, shape (2 n,), the first edge rising; it receives an
empty array when the train stops.
"""
_TIMEBASE = 100.0e6
"""Fastest internal timebase of the counters [1/s] (X Series User Manual, "Counters")."""


@dataclass(frozen=True)
class PulseChannel:
    """A counter of a device: name, timing of its pulses [s], and the receiver wired to its output terminal."""

    name: str
    device: str
    delay: float
    low: float
    high: float
    wired: Edges | None


class CounterOutput:
    """`Job` of one counter output, on the timebase of its device. The output is low at rest.

    The first pulse begins after the initial delay; each pulse is high, then low (NI-DAQmx help, "Pulse Train
    Generation").
    """

    start_terminal: str | None = None
    source: str | None = None
    clock_terminal: str | None = None

    def __init__(self, plant: Plant, channel: PulseChannel) -> None:
        self._plant = plant
        self.channel = channel
        self.pulses = 0
        self.awaited: str | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        return (self.channel.name,)

    @property
    def devices(self) -> frozenset[str]:
        return frozenset({self.channel.device})

    @property
    def resources(self) -> frozenset[str]:
        return frozenset({self.channel.name})

    def engage(self, is_free: Callable[[str], bool]) -> None:
        pass

    def check(self) -> None:
        if not self.pulses:
            raise NotEmulated("a counter output without implicit timing")

    def begin(self, tick: int) -> None:
        channel = self.channel
        if channel.wired is None:
            return
        delay, low, high = (round(each * _TIMEBASE) / _TIMEBASE for each in (channel.delay, channel.low, channel.high))
        rising = delay + (low + high) * np.arange(self.pulses)
        seconds = np.stack((rising, rising + high), axis=1).reshape(-1)
        ahead = 1_000_000
        second = self._plant.tick_rate * (self._plant.time_of(tick + ahead) - self._plant.time_of(tick)) / ahead
        channel.wired(np.asarray(self._plant.time_of(tick) + second * seconds, dtype=np.float64))

    def end(self) -> None:
        if self.channel.wired is not None:
            self.channel.wired(np.zeros(0))

    def verdict(self) -> None:
        pass
