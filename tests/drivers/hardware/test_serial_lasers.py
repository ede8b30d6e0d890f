"""Both lasers on emulated lines, without a DAQ: how long a block waits for them, and what it gets."""

import sys
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.clock import WallClock, now
from drivers.emulation.optoncdt.laser import EmulatedLaser
from drivers.errors import ConnectionLost, RigError
from drivers.hardware.parameters import Hardware, Laser1, Laser2, Lasers
from drivers.hardware.tracks import MARKS, Track, Tracks, open_serial_lasers
from drivers.optoncdt.codec import LATE
from drivers.optoncdt.stream import Readings
from drivers.rig import Channel
from drivers.timebase.sensor_track import SensorTrack
from sim.sensors import Laser
from tests.patience import LONG, eventually

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="emulated serial lasers need pseudo-terminals")

RATE = 2000.0
OBSERVED = 1.0


class Still:
    def displacement(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.zeros(times.size)


@pytest.fixture
def emulated() -> Iterator[tuple[EmulatedLaser, EmulatedLaser]]:
    pair = tuple(EmulatedLaser(Still(), Laser(), boot_time=0.0, seed=seed) for seed in (1, 2))
    for one in pair:
        one.start()
    yield pair
    for one in pair:
        one.close()


def observed(emulated: tuple[EmulatedLaser, EmulatedLaser], delay: float = 0.0) -> tuple[Track, ...]:
    """The lasers, whose clocks are observed for as short a time as a configuration can say."""
    first, second = (one.port for one in emulated)
    hardware = Hardware(
        lasers=Lasers(rate=4000.0, observation_time=OBSERVED, delay=delay),
        laser_1=Laser1(port=first, baud=921_600),
        laser_2=Laser2(port=second, baud=921_600),
    )
    return open_serial_lasers(hardware)


@pytest.fixture
def lasers(emulated: tuple[EmulatedLaser, EmulatedLaser]) -> Iterator[Tracks]:
    made = Tracks(observed(emulated, 5e-3))
    yield made
    # a silent sensor that is switched off is waited for
    for one in emulated:
        one.silence(0.0)
    made.close()


class Run:
    """A sample clock that is the machine's, in blocks of `n` samples."""

    def __init__(self, lasers: Tracks, n: int) -> None:
        self.lasers, self.n = lasers, n
        lasers.begin(RATE, WallClock())
        self.began, self.first = now(), 0

    def block(self) -> tuple[NDArray[np.int16], float]:
        """The next block, and how long it took after its last sample [s]."""
        end = self.began + (self.first + self.n - 1) / RATE
        WallClock().wait_until(end)
        asked = now()
        count = int((asked - self.began) * RATE) + 1
        self.lasers.observe(asked, count, asked)
        begun = now()
        counts = self.lasers.counts(self.first, self.n, self.n)
        self.first += self.n
        return counts, now() - begun


@pytest.mark.milliseconds
@pytest.mark.seconds
def test_a_silent_laser_is_late_and_soon_not_waited_for(
    emulated: tuple[EmulatedLaser, EmulatedLaser], lasers: Tracks
) -> None:
    run = Run(lasers, 200)
    deadline = now() + LONG
    while (run.block()[0] == LATE).any():
        assert now() < deadline
    emulated[1].silence(60.0)
    while run.block()[0][:, 1].max() != LATE:
        assert now() < deadline
    waits: list[float] = []
    for _ in range(15):
        counts, wait = run.block()
        assert (counts[:, 1] == LATE).all()
        waits.append(wait)
    # waiting in vain takes 50 ms of each block
    assert np.median(waits) < 0.025


@pytest.mark.milliseconds
@pytest.mark.seconds
def test_a_short_block_waits_for_half_its_duration_at_most(
    emulated: tuple[EmulatedLaser, EmulatedLaser], lasers: Tracks, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A laser that has just stopped counts as silent a tenth of a second later only; here it never does."""
    monkeypatch.setattr("drivers.optoncdt.sensor._SILENT_TIME", 1e9)
    run = Run(lasers, 40)
    run.block()
    for one in emulated:
        one.silence(60.0)
    waits = [run.block()[1] for _ in range(25)]
    # half of 20 ms, and what a busy machine takes; not 50 ms
    assert 0.009 < np.median(waits) < 0.035


def test_a_laser_that_was_unplugged_before_the_arming_prevents_it(
    emulated: tuple[EmulatedLaser, EmulatedLaser], lasers: Tracks
) -> None:
    """Although values from before are still held."""
    lasers.begin(RATE, WallClock())
    WallClock().wait_until(now() + 0.2)
    emulated[1].unplug()
    # the process that reads the port notices it
    sensor = lasers._tracks[1].sensor
    eventually(lambda: sensor._stream._failure is not None)
    with pytest.raises(ConnectionLost, match="laser_2"):
        lasers.begin(RATE, WallClock())


def test_blocks_before_a_run_are_refused_as_such(lasers: Tracks) -> None:
    with pytest.raises(RigError, match="arm the rig first"):
        lasers.observe(0.0, 1, 1.0)


class Inclinometer:
    """A second kind of sensor with a clock of its own: 100 values per second, the number of each is its value."""

    def __init__(self) -> None:
        self.closed = False
        self._taken = 0

    @property
    def silent(self) -> bool:
        return False

    def start(self) -> None:
        self._started = now()

    def take(self) -> Readings:
        arrived = int((now() - self._started) * 100.0)
        index = np.arange(self._taken, arrived)
        self._taken = arrived
        time = index / 100.0
        return Readings(index, time, index.astype(np.int32), self._started + time + 0.001)

    def wait(self, timeout: float) -> bool:
        WallClock().wait_until(now() + min(timeout, 0.01))
        return True

    def close(self) -> None:
        self.closed = True


def test_a_second_kind_of_sensor_is_one_more_track(emulated: tuple[EmulatedLaser, EmulatedLaser]) -> None:
    sensor = Inclinometer()
    placing = SensorTrack("tilt", 100.0, 0.0, lambda code: code.astype(np.int16), 32_000, MARKS)
    channel = Channel("tilt", "angle", "rad", 1e-4, 0.0, (-32_000, 32_000), "an inclinometer")
    tracks = Tracks([*observed(emulated), Track(sensor, channel, placing, OBSERVED)])
    try:
        assert [each.name for each in tracks.channels] == ["laser_1", "laser_2", "tilt"]
        run = Run(tracks, 200)
        blocks = [run.block()[0] for _ in range(8)]
        assert [one.sensor for one in tracks.alignments] == ["laser_1", "laser_2", "tilt"]
        shown = np.concatenate(blocks)[:, 2].astype(np.float64)
        # a busy machine may be late with some
        there = np.flatnonzero(np.abs(shown) < 32_000)
        assert there.size > 400
        # its value rises by 100 per second of its clock, which is the machine's: on the samples of the DAQ as well
        slope = np.polyfit(there / RATE, shown[there], 1)[0]
        assert slope == pytest.approx(100.0, rel=0.02)
    finally:
        tracks.close()
    assert sensor.closed
