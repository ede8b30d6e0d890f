"""Both lasers on their serial lines, placed on the sample clock."""

from contextlib import ExitStack

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, now
from drivers.errors import RigError
from drivers.hardware.channels import serial_laser
from drivers.hardware.parameters import Hardware, LaserInput
from drivers.optoncdt.codec import MID_RANGE
from drivers.optoncdt.faults import LOST, MEANINGS, marked
from drivers.optoncdt.sensor import SerialLaser
from drivers.rig import Alignment, Channel
from drivers.timebase.laser_track import LaserTrack
from drivers.timebase.sample_clock import SampleClock
from sim.errors import InvalidInput

_PATIENCE = 0.05
"""How long a block waits for the lasers' values to arrive before they count as lost [s],"""
_SHARE = 0.5
"""and for which part of its own duration at most: the drive must be written meanwhile."""


class SerialLasers:
    """Two sensors that stream from the moment they are opened; `begin` a run, then ask for blocks of counts.

    Raises InvalidInput for a laser without port, RigError when one is not there or not as configured.
    """

    def __init__(self, hardware: Hardware) -> None:
        self._rate, self._delay = hardware.lasers.rate, hardware.lasers.delay
        with ExitStack() as opened:
            self._sensors: list[SerialLaser] = []
            for name, given in (("laser_1", hardware.laser_1), ("laser_2", hardware.laser_2)):
                sensor = self._open(name, given)
                opened.callback(sensor.close)
                self._sensors.append(sensor)
            for sensor in self._sensors:
                sensor.start()
            self._opened = opened.pop_all()
        self._known_from = now() + hardware.lasers.listening
        self._tracks = [LaserTrack(s.name, self._rate, self._delay, marked, MID_RANGE, LOST) for s in self._sensors]
        self._sample_rate = 0.0
        self._clock: SampleClock | None = None
        self.channels: tuple[Channel, ...] = tuple(
            serial_laser(sensor.name, given.measuring_range, given.polarity, sensor.description, MEANINGS)
            for sensor, given in zip(self._sensors, (hardware.laser_1, hardware.laser_2), strict=True)
        )

    def begin(self, sample_rate: float, clock: Clock) -> None:
        """A run begins: its sample clock is not known yet, the lasers' own clocks are."""
        clock.wait_until(self._known_from)
        self._take()
        for track in self._tracks:
            track.begin()
        self._sample_rate = sample_rate
        self._clock = SampleClock(sample_rate)

    def observe(self, before: float, count: int, after: float) -> None:
        """The sample clock stood at `count` between two moments of the machine's clock [s]. RigError before a run."""
        self._running.observe(before, count, after)

    def counts(self, first: int, n: int) -> NDArray[np.int16]:
        """Counts of both lasers at `n` samples from `first` on, shape (n, 2); waits a little for the last of them.

        What a laser has not sent by then is lost, and one that is silent is not waited for. Raises ConnectionLost, and
        RigError before a run.
        """
        last = (first + n - 1) / self._sample_rate
        deadline = now() + min(_PATIENCE, _SHARE * n / self._sample_rate)
        self._take()
        for sensor, track in zip(self._sensors, self._tracks, strict=True):
            while track.reach(self._running) < last and not sensor.silent and (left := deadline - now()) > 0.0:
                sensor.wait(left)
                self._take()
        return np.column_stack([track.counts(self._running, first, n, self._sample_rate) for track in self._tracks])

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        """How the lasers were placed in this run; none before the first."""
        clock = self._clock
        return () if clock is None else tuple(track.alignment(clock) for track in self._tracks)

    def close(self) -> None:
        """Stop the streams and let go of the ports. Allowed any number of times."""
        self._opened.close()

    @property
    def _running(self) -> SampleClock:
        if self._clock is None:
            raise RigError("the lasers have no sample clock: arm the rig first")
        return self._clock

    def _open(self, name: str, given: LaserInput) -> SerialLaser:
        if given.port is None:
            allowed = "give the serial port of the laser (`rockbench devices` lists them), or lasers.connection"
            raise InvalidInput(f"hardware.{name}.port", given.port, allowed)
        return SerialLaser(name, given.port, baud=given.baud, rate=self._rate, measuring_range=given.measuring_range)

    def _take(self) -> None:
        for sensor, track in zip(self._sensors, self._tracks, strict=True):
            readings = sensor.take()
            track.add(readings.index, readings.time, readings.code, readings.arrival)
