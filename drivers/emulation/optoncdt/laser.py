"""An optoNCDT 1420 that any program can open as a serial port."""

import threading
import time
from typing import Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from drivers.emulation.optoncdt.actions import Actions, Identity
from drivers.emulation.optoncdt.dialogue import Dialogue
from drivers.emulation.optoncdt.line import PseudoTerminal
from drivers.emulation.optoncdt.sensor import Sensor
from drivers.emulation.optoncdt.settings import Settings
from drivers.emulation.optoncdt.words import WORD, Fault
from drivers.emulation.plant import Sight
from sim.sensors import Laser

Bytes = NDArray[np.uint8]

_HYPHEN = 0x2D


class Line:
    """What becomes of the bytes between sensor and client: faultless until told otherwise."""

    def __init__(self, random: Generator) -> None:
        self._random = random
        self.lose = 0
        """How many of the next bytes get lost."""
        self.probability = 0.0
        """The probability that a byte gets lost."""
        self.garbage = 0
        """How many bytes of noise come next."""
        self.silent_until = -np.inf
        """Until when nothing gets through [s]."""
        self.splits_words = False
        """Whether an answer may stand within a value."""

    def carried(self, stream: Bytes, answer: bytes, now: float) -> Bytes:
        """What arrives of the values of `stream` and of an answer, which stands between any two of the values."""
        sent = self._woven(stream, answer)
        if now < self.silent_until:
            return sent[:0]
        if self.garbage:
            noise = self._random.integers(0, 256, self.garbage, dtype=np.uint8)
            sent, self.garbage = np.concatenate((noise, sent)), 0
        if self.lose:
            lost = min(self.lose, sent.size)
            sent, self.lose = sent[lost:], self.lose - lost
        if self.probability:
            sent = sent[self._random.random(sent.size) >= self.probability]
        return sent

    def misread(self, sent: Bytes, baud: int, read_at: int) -> Bytes:
        """What a client makes of bytes sent at `baud` when it reads at another rate.

        Noise; without a hyphen, so that no test depends on whether it spells a prompt by chance.
        """
        noise = self._random.integers(0, 256, round(sent.size * min(1.0, read_at / baud)), dtype=np.uint8)
        return np.where(noise == _HYPHEN, np.uint8(0), noise)

    def _woven(self, stream: Bytes, answer: bytes) -> Bytes:
        if not answer:
            return stream
        place = WORD * int(self._random.integers(0, stream.size // WORD + 1))
        if self.splits_words and place < stream.size:
            place += int(self._random.integers(1, WORD))
        return np.insert(stream, place, np.frombuffer(answer, dtype=np.uint8))


_TURN = 0.002
"""How often the sensor looks after its line [s]."""
_RATES = (250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0)
"""Measuring rates of a recent sensor [1/s]; an old one lacks the last (manual of the optoNCDT 1420, p. 84)."""
_TARGETS = {"too close": Fault.TOO_CLOSE, "too far": Fault.TOO_FAR, "none": Fault.NO_PEAK, None: None}


class EmulatedLaser:
    """A sensor that looks at `sight` and has the errors of the simulated `laser`, on the serial port `port`.

    It is switched on when it is made and serves its line from `start()` on. `as_found` are the settings at power-up:
    unless they say otherwise it does not stream. `clock_error` is the relative error of its clock, that of `laser`
    unless given. `rates` [1/s], `password` and `boot_time` [s] differ between versions of the sensor or are not
    documented. Every method may be called from any thread.

    Raises DeviceNotFound on Windows, which has no pseudo-terminals.
    """

    def __init__(
        self,
        sight: Sight,
        laser: Laser,
        *,
        serial: str = "15030002",
        clock_error: float | None = None,
        seed: int = 0,
        as_found: Settings | None = None,
        rates: tuple[float, ...] = _RATES,
        password: str = "000",
        boot_time: float = 0.5,
    ) -> None:
        random = np.random.default_rng(seed)
        self._terminal = PseudoTerminal()
        self._line = Line(random)
        error = laser.clock_error if clock_error is None else clock_error
        self._sensor = Sensor(sight, laser, error, random, as_found or Settings(), time.monotonic())
        identity = Identity(f"ILD1420-{1e3 * laser.measuring_range:g}", serial, laser.measuring_range)
        self._dialogue = Dialogue(self._sensor, Actions(self._sensor, identity, password, boot_time), rates)
        self._lock = threading.Lock()
        self._over = False
        self._thread = threading.Thread(target=self._serve, name=f"emulated {identity.name}", daemon=True)

    def start(self) -> None:
        """Serve the line."""
        self._thread.start()

    def close(self) -> None:
        """Switch off: no thread and no port is left. Allowed any number of times."""
        self.unplug()
        if self._thread.is_alive():
            self._thread.join()

    @property
    def port(self) -> str:
        """Path of the serial port that a client opens."""
        return self._terminal.port

    @property
    def analogue(self) -> bool:
        """Whether the analogue output is live; otherwise it shows its error current."""
        return self._sensor.settings.output == "ANALOG"

    @property
    def settings(self) -> Settings:
        """What the sensor is set to."""
        return self._sensor.settings

    @property
    def dropped(self) -> int:
        """Bytes that found no room at the client."""
        return self._terminal.dropped

    @property
    def epoch(self) -> float:
        """Host time of the zero of the time stamps: power-up or the last RESETCNT TIMESTAMP [s]."""
        with self._lock:
            return self._sensor.grid.epoch.now

    @property
    def rate_true(self) -> float:
        """Measurements per second of host time."""
        with self._lock:
            return self._sensor.grid.rate

    def host_time_of(self, index: int) -> float:
        """Host time of an exposure [s]: `index` is its counter, counted on beyond 18 bits, at the present rate."""
        with self._lock:
            grid = self._sensor.grid
            return float(grid.times(np.array([index + grid.count.now]))[0])

    def lose_bytes(self, count: int = 0, *, probability: float = 0.0) -> None:
        """Lose the next `count` bytes, and from then on every byte with a probability."""
        with self._lock:
            self._line.lose, self._line.probability = count, probability

    def garbage(self, count: int) -> None:
        """Send `count` random bytes next."""
        with self._lock:
            self._line.garbage = count

    def silence(self, seconds: float) -> None:
        """Let nothing get through to the client for a while; the sensor goes on measuring."""
        with self._lock:
            self._line.silent_until = time.monotonic() + seconds

    def split_words(self, allowed: bool = True) -> None:
        """Let answers stand within values: whether a real sensor does that is not documented."""
        with self._lock:
            self._line.splits_words = allowed

    def laser_off(self) -> None:
        """Open the input that switches the laser on."""
        with self._lock:
            self._sensor.beam = False

    def laser_on(self) -> None:
        """Close it again."""
        with self._lock:
            self._sensor.beam = True

    def target(self, place: Literal["too close", "too far", "none"] | None) -> None:
        """Put something else before the sensor, or nothing; None: what its sight gives."""
        with self._lock:
            self._sensor.target = _TARGETS[place]

    def unplug(self) -> None:
        """Take the sensor off its line for good: a client that reads or writes gets an error."""
        with self._lock:
            self._over = True
            self._terminal.close()

    def _serve(self) -> None:
        """The thread: send what there is, answer what was asked."""
        while True:
            with self._lock:
                if self._over:
                    return
                self._turn(time.monotonic())
            time.sleep(_TURN)

    def _turn(self, now: float) -> None:
        received = self._terminal.read()
        # looked at after reading: who has sent something has opened and set up the port before
        connected, read_at, baud = self._terminal.connected, self._terminal.baud, self._sensor.settings.baud
        if read_at != baud:
            # at the wrong rate nothing is understood, and what was heard spoils the next command
            received = b"\xff" * len(received)
        stream = self._sensor.stream(now)
        answer = self._dialogue.hear(received, now)
        sent = self._line.carried(stream, answer, now)
        if connected and sent.size:
            self._terminal.write((sent if read_at == baud else self._line.misread(sent, baud, read_at)).tobytes())
