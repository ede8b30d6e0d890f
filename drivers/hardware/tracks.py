"""Tracks: the values of sensors with their own clocks, resampled to the sample clock."""

from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, now
from drivers.errors import RigError
from drivers.hardware.channels import serial_laser
from drivers.hardware.parameters import Hardware, LaserInput, Lasers
from drivers.optoncdt.codec import IMPLAUSIBLE, LATE, LOST, MEANINGS, MID_RANGE, count_size, marked
from drivers.optoncdt.sensor import SerialLaser
from drivers.rig import Alignment, Channel, RawValues
from drivers.timebase.clocks import SampleClock
from drivers.timebase.marking import Pulses
from drivers.timebase.resampling import Marks
from drivers.timebase.sensor_track import SensorTrack
from sim.errors import InvalidInput

_SHARE, _RESERVE = 0.5, 0.1
"""Limits of the wait for late values: the fraction `_SHARE` of the time for which the queued drive lasts, or this time
less `_RESERVE` [s], whichever is longer. The rest of the time is left for the next write.
"""
_LONGEST, _LEAST = 0.4, 0.05
"""`_LONGEST`: delay up to which a block waits for late values [s], shorter than the default of `limits.late`. `_LEAST`:
longest wait of a block that is already later [s], so that values received during a stall of the program are included.
"""


_FIRST_VALUE = 0.5
"""Longest time from the start of a sensor to its first value [s], by which its observation is prolonged."""
_ATTEMPTS, _PAUSE = 5, 0.05
"""Number of waits for the rest of an observation, whose last values may arrive late, and the shortest of them [s]."""

_FASTEST = 5.0
"""Largest plausible speed of a target between two values [m/s]; a faster change is marked as implausible."""
MARKS = Marks(LOST, LATE, IMPLAUSIBLE)


class Readings(Protocol):
    """Consecutive values of a sensor, each array of shape (n,); see `SensorTrack.add`."""

    @property
    def index(self) -> NDArray[np.int64]:
        """Number of each value since the stream was started."""
        ...

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each value on the sensor's clock [s]."""
        ...

    @property
    def code(self) -> NDArray[np.int32]:
        """The raw value."""
        ...

    @property
    def arrival(self) -> NDArray[np.float64]:
        """Arrival time of each value on the machine's clock [s]."""
        ...


class ClockedSensor(Protocol):
    """An open sensor that streams on its own clock from `start` on."""

    @property
    def silent(self) -> bool:
        """Whether no values have arrived for so long that blocks no longer wait for the sensor."""
        ...

    def start(self) -> None:
        """Start the stream. Raises RigError."""
        ...

    def take(self) -> Readings:
        """All values since the last call; never waits. Raises ConnectionLost."""
        ...

    def wait(self, timeout: float) -> bool:
        """Wait until values are available or a failure occurs; returns False after `timeout` [s]."""
        ...

    def close(self) -> None:
        """Release the device; may be called repeatedly, and never raises."""
        ...


@dataclass(frozen=True)
class Track:
    """An instrument: its open sensor, its channel, and the placement of its values on the sample clock.

    `observation_time` [s] is the time for which the sensor's clock is observed before the first run.
    """

    sensor: ClockedSensor
    channel: Channel
    placing: SensorTrack
    observation_time: float


class Tracks:
    """Tracks of sensors that stream from construction on: call `begin` for each run, then `counts` for each block.

    `close` closes the sensors; they are also closed if one of them cannot be started.
    """

    def __init__(self, tracks: Sequence[Track]) -> None:
        self._tracks = tuple(tracks)
        with ExitStack() as opened:
            for track in self._tracks:
                opened.callback(track.sensor.close)
            for track in self._tracks:
                track.sensor.start()
            self._opened = opened.pop_all()
        self._known_from = now() + max((track.observation_time for track in self._tracks), default=0.0)
        self._sample_rate = 0.0
        self._clock: SampleClock | None = None
        self._armed = 0.0
        self._raw: list[list[Readings]] = [[] for _ in self._tracks]
        self.channels: tuple[Channel, ...] = tuple(track.channel for track in self._tracks)

    def begin(self, sample_rate: float, clock: Clock, pulses: Pulses | None = None) -> None:
        """Begin a run with a new sample clock; the history of the sensors' clocks and the rate of the previous sample
        clock are kept. Before the first run, waits until these clocks have been observed for their `observation_time`.
        `pulses` are those that have switched the sensors' beams off since the last run, if any.
        """
        clock.wait_until(self._known_from)
        for _ in range(2):
            # the second call raises the failure of a sensor, if there is one: the values before it are taken first
            self._take()
        self._await_observation(clock)
        for track, raw in zip(self._tracks, self._raw, strict=True):
            if pulses is not None:
                track.placing.observe_pulses(pulses.spacing)
            track.placing.begin()
            raw.clear()
        self._armed = now()
        self._sample_rate = sample_rate
        self._clock = SampleClock(sample_rate, self._clock)

    def _await_observation(self, clock: Clock) -> None:
        """Wait for the rest of the observation, which begins with the first value of a sensor; not for a silent one."""
        for _ in range(_ATTEMPTS):
            missing = max((track.observation_time - track.placing.history for track in self._tracks), default=0.0)
            if not 0.0 < missing <= _FIRST_VALUE:
                return
            clock.wait_until(now() + max(missing, _PAUSE))
            self._take()

    def observe(self, before: float, count: int, after: float) -> None:
        """Add a reading: `count` samples had been taken at some instant between two times of the machine's clock [s].

        Raises RigError before a run.
        """
        self._running.observe(before, count, after)

    def counts(self, first: int, n: int, lead: int) -> NDArray[np.int16]:
        """Counts at `n` samples from `first` on, shape (n, n_tracks); waits for late values.

        `lead` is the number of drive samples queued beyond the block. The wait ends in time for the next write, however
        late the block already is. Values that have not arrived by then are marked as late; there is no wait for a
        silent sensor. Raises ConnectionLost, and RigError before a run.
        """
        last = (first + n - 1) / self._sample_rate
        self._await(last, now() + longest_wait(lead / self._sample_rate, self._since(last)))
        placed = [track.placing.counts(self._running, first, n, self._sample_rate) for track in self._tracks]
        return np.column_stack(placed)

    def mark(self, pulses: Pulses, lead: int) -> tuple[str, ...]:
        """Align the sensors by pulses that have switched their beams off; returns the names of those not aligned.

        Waits for late values as `counts` does.
        """
        deadline = now() + longest_wait(lead / self._sample_rate, self._since(pulses.end))
        self._await(pulses.end, deadline)
        return tuple(track.channel.name for track in self._tracks if not track.placing.mark(self._running, pulses))

    def raw(self) -> tuple[RawValues, ...]:
        """The values, before resampling, that were received since the last call or since the run began."""
        for track, raw in zip(self._tracks, self._raw, strict=True):
            # if a sensor has failed, the values received before the failure are returned
            with suppress(RigError):
                _take(track, raw)
        taken, self._raw = self._raw, [[] for _ in self._tracks]
        return tuple(
            self._raw_values(track.channel.name, readings)
            for track, readings in zip(self._tracks, taken, strict=True)
            if readings
        )

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        """Alignments of the sensors in this run; empty before the first run."""
        clock = self._clock
        return () if clock is None else tuple(track.placing.alignment(clock) for track in self._tracks)

    def close(self) -> None:
        """Stop the streams and release the devices; may be called repeatedly."""
        self._opened.close()

    def _await(self, seconds: float, deadline: float) -> None:
        """Wait for values up to the time `seconds` of the sample clock [s], at most until the time `deadline` of the
        machine's clock [s].
        """
        self._take()
        for track in self._tracks:
            sensor = track.sensor
            while (
                track.placing.reach(self._running) < seconds and not sensor.silent and (left := deadline - now()) > 0.0
            ):
                sensor.wait(left)
                self._take()

    def _since(self, seconds: float) -> float:
        """Time that has passed since `seconds` of the sample clock [s]; 0 before the first reading of that clock."""
        passed = float(self._running.seconds(np.array([now()]))[0]) - seconds
        return passed if passed > 0.0 else 0.0

    @property
    def _running(self) -> SampleClock:
        if self._clock is None:
            raise RigError("no sample clock is available for sensors with their own clocks: arm the rig first")
        return self._clock

    def _raw_values(self, sensor: str, readings: Sequence[Readings]) -> RawValues:
        index, code = (np.concatenate([getattr(one, name) for one in readings]) for name in ("index", "code"))
        time = np.concatenate([one.time for one in readings])
        arrival = np.concatenate([one.arrival for one in readings]) - self._armed
        microseconds = (np.rint(1e6 * seconds).astype(np.int64) for seconds in (time, arrival))
        time, arrival = microseconds
        return RawValues(sensor, index.astype(np.int64), time, code.astype(np.int64), arrival)

    def _take(self) -> None:
        for track, raw in zip(self._tracks, self._raw, strict=True):
            _take(track, raw)


def _take(track: Track, raw: list[Readings]) -> None:
    """Take the values received by a sensor, and append them to `raw`."""
    readings = track.sensor.take()
    if readings.index.size:
        raw.append(readings)
    track.placing.add(readings.index, readings.time, readings.code, readings.arrival)


def longest_wait(lead: float, passed: float) -> float:
    """Longest wait [s] for late values of a block whose last sample was taken `passed` [s] ago; counted from that
    sample, the queued drive lasts for `lead` [s].
    """
    left = max(lead - passed, 0.0)
    return min(max(_SHARE * left, left - _RESERVE), max(_LONGEST - passed, _LEAST))


def open_serial_lasers(hardware: Hardware) -> tuple[Track, ...]:
    """Open the serial lasers; returns no tracks if the lasers are connected by their analogue outputs.

    The caller closes them. Raises InvalidInput for a laser without port, RigError if a laser is missing or differs from
    the configuration; all are then closed.
    """
    with ExitStack() as opened:
        tracks: list[Track] = []
        for name, given in hardware.serial_lasers:
            track = _open(name, given, hardware.lasers)
            opened.callback(track.sensor.close)
            tracks.append(track)
        opened.pop_all()
    return tuple(tracks)


def _open(name: str, given: LaserInput, lasers: Lasers) -> Track:
    if given.port is None:
        allowed = (
            "specify the serial port of the laser (`rockbench devices` lists the ports), or set"
            " hardware.lasers.connection to analogue"
        )
        raise InvalidInput(f"hardware.{name}.port", given.port, allowed)
    reach = given.measuring_range
    step = _FASTEST / lasers.rate / count_size(reach)
    sensor = SerialLaser(
        name,
        given.port,
        baud=given.baud,
        rate=lasers.rate,
        measuring_range=reach,
        serial_number=given.serial_number,
    )
    return Track(
        sensor=sensor,
        channel=serial_laser(name, reach, given.polarity, sensor.description, MEANINGS),
        placing=SensorTrack(name, lasers.rate, lasers.delay, marked, MID_RANGE, MARKS, step),
        observation_time=lasers.observation_time,
    )
