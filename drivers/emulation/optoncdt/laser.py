"""Emulated optoNCDT 1420 on a serial port or a socket."""

import threading
import time
from typing import Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from drivers.emulation.optoncdt.actions import Actions, Identity
from drivers.emulation.optoncdt.dialogue import Dialogue, PseudoTerminal
from drivers.emulation.optoncdt.evaluation import WORD, Fault
from drivers.emulation.optoncdt.sensor import Sensor
from drivers.emulation.optoncdt.settings import Settings
from drivers.emulation.optoncdt.socket_line import SocketLine
from drivers.emulation.plant import Sight
from sim import waiting
from sim.sensors import Laser

Bytes = NDArray[np.uint8]

_HYPHEN = 0x2D


class Line:
    """Transmission faults between sensor and client; none by default."""

    def __init__(self, random: Generator) -> None:
        self._random = random
        self.lose = 0
        """Number of bytes to be lost next."""
        self.probability = 0.0
        """Probability of the loss of a byte."""
        self.garbage = 0
        """Number of noise bytes to be sent next."""
        self.silent_until = -np.inf
        """End of the period without output [s of the monotonic clock]."""
        self.splits_words = False
        """Whether an answer may split a value."""

    def carried(self, stream: Bytes, answer: bytes, now: float) -> Bytes:
        """Bytes that reach the client under the present faults: the values of `stream`, with `answer` inserted at a
        random position.
        """
        sent = self._with_answer(stream, answer)
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
        """Noise that a client set to `read_at` baud receives in place of `sent`, which was sent at `baud`. The noise
        contains no hyphen, so it never resembles a prompt.
        """
        noise = self._random.integers(0, 256, round(sent.size * min(1.0, read_at / baud)), dtype=np.uint8)
        return np.where(noise == _HYPHEN, np.uint8(0), noise)

    def _with_answer(self, stream: Bytes, answer: bytes) -> Bytes:
        if not answer:
            return stream
        place = WORD * int(self._random.integers(0, stream.size // WORD + 1))
        if self.splits_words and place < stream.size:
            place += int(self._random.integers(1, WORD))
        return np.insert(stream, place, np.frombuffer(answer, dtype=np.uint8))


_TURN = 0.004
"""Pause between two services of the line [s]; the latency timers of serial adapters are 1 to 16 ms."""
_RATES = (250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0)
"""Measuring rates of a recent sensor [1/s]; older sensors lack the last rate (manual of the optoNCDT 1420, p. 84)."""
_TARGETS = {"too close": Fault.TOO_CLOSE, "too far": Fault.TOO_FAR, "none": Fault.NO_PEAK, None: None}


class EmulatedLaser:
    """A sensor that measures `sight` with the errors of the simulated `laser`; a client opens `port`.

    The constructor switches the sensor on; its line is served from `start()` on. `as_found` are the settings at
    power-up; with the default ones, the sensor does not stream. `clock_error` is the relative error of its clock, by
    default that of `laser`. `rates` [1/s], `password` and `boot_time` [s] differ between versions of the sensor or are
    not documented. Every method may be called from any thread. With `network`, the port is a socket, to which baud
    rates do not apply.

    Raises DeviceNotFound on Windows, which has no pseudo-terminals, unless `network` is set.
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
        network: bool = False,
    ) -> None:
        random = np.random.default_rng(seed)
        self._terminal = SocketLine() if network else PseudoTerminal()
        self._line = Line(random)
        error = laser.clock_error if clock_error is None else clock_error
        self._sensor = Sensor(sight, laser, error, random, as_found or Settings(), time.monotonic())
        identity = Identity(f"ILD1420-{1e3 * laser.measuring_range:g}", serial, laser.measuring_range)
        self._dialogue = Dialogue(self._sensor, Actions(self._sensor, identity, password, boot_time), rates)
        self._lock = threading.Lock()
        self._served = self._delivered = np.inf
        self._lateness = 0.0
        self._over = False
        self._thread = threading.Thread(target=self._serve, name=f"emulated {identity.name}", daemon=True)

    def start(self) -> None:
        """Start serving the line."""
        self._thread.start()

    def close(self) -> None:
        """Switch off, end the thread and close the port; may be called repeatedly."""
        self.unplug()
        if self._thread.is_alive():
            waiting.join(self._thread)

    @property
    def port(self) -> str:
        """Path of the serial port, or address of the socket, that a client opens."""
        return self._terminal.port

    @property
    def analogue(self) -> bool:
        """Whether the analogue output follows the target; otherwise it supplies its error current."""
        return self._sensor.settings.output == "ANALOG"

    @property
    def settings(self) -> Settings:
        return self._sensor.settings

    @property
    def dropped(self) -> int:
        """Bytes lost because the buffer of the client's port was full."""
        return self._terminal.dropped

    def take_lateness(self) -> float:
        """Longest delay [s], in addition to that of a real sensor, with which this computer has sent a value since the
        last call.
        """
        with self._lock:
            lateness, self._lateness = self._lateness, 0.0
        return lateness

    @property
    def epoch(self) -> float:
        """Host time at which the time stamps were zero: power-up or the last RESETCNT TIMESTAMP [s]."""
        with self._lock:
            return self._sensor.grid.epoch.now

    @property
    def rate_true(self) -> float:
        """Measurements per second of host time."""
        with self._lock:
            return self._sensor.grid.rate

    @property
    def stamp_lag(self) -> float:
        """Time by which the time stamps are earlier than the exposures, less than a tick [s of the sensor's clock]."""
        with self._lock:
            return self._sensor.grid.stamp_lag

    def host_time_of(self, index: int) -> float:
        """Host time of an exposure at the present rate [s]; `index` is its counter, continued beyond 18 bits."""
        with self._lock:
            grid = self._sensor.grid
            return float(grid.times(np.array([index + grid.count.now]))[0])

    def lose_bytes(self, count: int = 0, *, probability: float = 0.0) -> None:
        """Lose the next `count` bytes, and every later byte with the given probability."""
        with self._lock:
            self._line.lose, self._line.probability = count, probability

    def garbage(self, count: int) -> None:
        """Send `count` random bytes next."""
        with self._lock:
            self._line.garbage = count

    def silence(self, seconds: float) -> None:
        """Suppress all output to the client for `seconds` [s]; the sensor continues to measure."""
        with self._lock:
            self._line.silent_until = time.monotonic() + seconds

    def split_words(self, allowed: bool = True) -> None:
        """Allow answers to split values; whether a real sensor splits them is not documented."""
        with self._lock:
            self._line.splits_words = allowed

    def laser_off(self) -> None:
        """Switch the laser off, by opening its on/off input."""
        with self._lock:
            self._sensor.beam = False

    def laser_on(self) -> None:
        """Switch the laser on, by closing its on/off input."""
        with self._lock:
            self._sensor.beam = True

    def switch(self, times: NDArray[np.float64]) -> None:
        """Open and close the laser's on/off input in turn at ascending host times [s]; without times, the input remains
        closed and the laser on.
        """
        # without the lock: the device calls this while it holds locks for which the thread of the line may wait
        self._sensor.switching = times

    @property
    def switching(self) -> bool:
        """Whether the laser's on/off input is being opened and closed, as requested by `switch`."""
        return self._sensor.switching.size > 0

    def target(self, place: Literal["too close", "too far", "none"] | None) -> None:
        """Replace the target by one that is too close, too far or missing; None restores the original target."""
        with self._lock:
            self._sensor.target = _TARGETS[place]

    def unplug(self) -> None:
        """Disconnect the sensor permanently: a client's reads and writes fail."""
        with self._lock:
            self._over = True
            self._terminal.close()

    def _serve(self) -> None:
        """Thread that sends pending output and answers."""
        while True:
            with self._lock:
                if self._over:
                    return
                self._turn(time.monotonic())
            time.sleep(_TURN)

    def _note_lateness(self, now: float) -> None:
        """Update the longest delay from the time between two services of the line and the age of pending bytes."""
        if self._terminal.pending == 0:
            self._delivered = now
        self._lateness = max(self._lateness, now - self._served - _TURN, now - self._delivered)
        self._served = now

    def _turn(self, now: float) -> None:
        received = self._terminal.read()
        # read after the data, since a client configures the port before it sends data
        connected, baud = self._terminal.connected, self._sensor.settings.baud
        read_at = self._terminal.baud or baud
        if read_at != baud:
            # at the wrong rate no command is recognised, and the bytes received corrupt the next command
            received = b"\xff" * len(received)
        stream = self._sensor.stream(now)
        answer = self._dialogue.receive(received, now)
        sent = self._line.carried(stream, answer, now)
        if connected:
            self._terminal.write((sent if read_at == baud else self._line.misread(sent, baud, read_at)).tobytes())
        else:
            self._terminal.discard()
        self._note_lateness(now)
