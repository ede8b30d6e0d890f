"""Instruments with clocks of their own: a list of tracks on the sample clock."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, now
from drivers.errors import RigError
from drivers.rig import Alignment, Channel
from drivers.timebase.sample_clock import SampleClock
from drivers.timebase.sensor_track import SensorTrack

_PATIENCE = 0.05
"""How long a block waits for values to arrive before they count as lost [s],"""
_SHARE = 0.5
"""and for which part of its own duration at most: the drive must be written meanwhile."""


class Readings(Protocol):
    """Values in their order, each array of shape (n,); see `SensorTrack.add`."""

    @property
    def index(self) -> NDArray[np.int64]:
        """Number of each value since the stream was started."""
        ...

    @property
    def time(self) -> NDArray[np.float64]:
        """Second of the sensor's clock."""
        ...

    @property
    def code(self) -> NDArray[np.int32]:
        """The value as it came."""
        ...

    @property
    def arrival(self) -> NDArray[np.float64]:
        """When the machine had read it [s of its clock]."""
        ...


class ClockedSensor(Protocol):
    """A sensor that is open, and streams by its own clock from `start` on."""

    @property
    def silent(self) -> bool:
        """Whether no value has arrived for long: it is not waited for then."""
        ...

    def start(self) -> None:
        """Begin to stream. Raises RigError."""
        ...

    def take(self) -> Readings:
        """Everything that came since the last time; never waits. Raises ConnectionLost."""
        ...

    def wait(self, timeout: float) -> bool:
        """Wait until there is something to take, or a failure; False after `timeout` [s]."""
        ...

    def close(self) -> None:
        """Release the device. Allowed any number of times, never raises."""
        ...


@dataclass(frozen=True)
class Track:
    """One instrument: its open sensor, its channel, and how its values are placed.

    `listening` is how long its clock is watched before the first run [s].
    """

    sensor: ClockedSensor
    channel: Channel
    placing: SensorTrack
    listening: float


class Tracks:
    """Sensors that stream from the moment they are given; `begin` a run, then ask for blocks of counts.

    The sensors are closed with it, also where one cannot be started.
    """

    def __init__(self, tracks: Sequence[Track]) -> None:
        self._tracks = tuple(tracks)
        with ExitStack() as opened:
            for track in self._tracks:
                opened.callback(track.sensor.close)
            for track in self._tracks:
                track.sensor.start()
            self._opened = opened.pop_all()
        self._known_from = now() + max((track.listening for track in self._tracks), default=0.0)
        self._sample_rate = 0.0
        self._clock: SampleClock | None = None
        self.channels: tuple[Channel, ...] = tuple(track.channel for track in self._tracks)

    def begin(self, sample_rate: float, clock: Clock) -> None:
        """A run begins: its sample clock is not known yet, the sensors' own clocks are."""
        clock.wait_until(self._known_from)
        self._take()
        for track in self._tracks:
            track.placing.begin()
        self._sample_rate = sample_rate
        self._clock = SampleClock(sample_rate)

    def observe(self, before: float, count: int, after: float) -> None:
        """The sample clock stood at `count` between two moments of the machine's clock [s]. RigError before a run."""
        self._running.observe(before, count, after)

    def counts(self, first: int, n: int) -> NDArray[np.int16]:
        """Counts at `n` samples from `first` on, shape (n, n_tracks); waits a little for the last of them.

        What a sensor has not sent by then is lost, and one that is silent is not waited for. Raises ConnectionLost, and
        RigError before a run.
        """
        last = (first + n - 1) / self._sample_rate
        deadline = now() + min(_PATIENCE, _SHARE * n / self._sample_rate)
        self._take()
        for track in self._tracks:
            sensor = track.sensor
            while track.placing.reach(self._running) < last and not sensor.silent and (left := deadline - now()) > 0.0:
                sensor.wait(left)
                self._take()
        placed = [track.placing.counts(self._running, first, n, self._sample_rate) for track in self._tracks]
        return np.column_stack(placed)

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        """How the sensors were placed in this run; none before the first."""
        clock = self._clock
        return () if clock is None else tuple(track.placing.alignment(clock) for track in self._tracks)

    def close(self) -> None:
        """Stop the streams and release the devices. Allowed any number of times."""
        self._opened.close()

    @property
    def _running(self) -> SampleClock:
        if self._clock is None:
            raise RigError("sensors with clocks of their own have no sample clock: arm the rig first")
        return self._clock

    def _take(self) -> None:
        for track in self._tracks:
            readings = track.sensor.take()
            track.placing.add(readings.index, readings.time, readings.code, readings.arrival)
