"""A client of the optoNCDT 1420 that shares nothing with the emulated one: the manual in as few lines as possible."""

import time
from collections.abc import Callable

import numpy as np
import serial
from numpy.typing import NDArray

from drivers.emulation.optoncdt.actions import Actions, Identity
from drivers.emulation.optoncdt.dialogue import Dialogue
from drivers.emulation.optoncdt.sensor import Sensor
from drivers.emulation.optoncdt.settings import Settings
from sim.sensors import Laser
from tests.patience import LONG

PERFECT = Laser(measuring_range=0.2, noise=0.0, linearity=0.0, clock_error=0.0)
"""No errors: what the sensor sends is what the manual's formula says, to half a step."""


class Seen:
    """A `Sight` that is a function of time."""

    def __init__(self, motion: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> None:
        self._motion = motion

    def displacement(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._motion(times)


def still(place: float) -> Seen:
    """Something that stands at `place` [m] from mid range."""
    return Seen(lambda times: np.full(times.size, place))


def metres(code: float, measuring_range: float = 0.2) -> float:
    """Distance from the start of the measuring range (manual, p. 65)."""
    return (code * 102.0 / 65520.0 - 1.0) / 100.0 * measuring_range


def decode(received: bytes) -> tuple[list[tuple[int, bool]], bytes]:
    """Values, each with whether it is the first of its block, and the bytes that belong to none (manual, p. 84)."""
    values: list[tuple[int, bool]] = []
    rest, word = bytearray(), bytearray()
    for byte in received:
        place = min(byte >> 6, 2)
        if place != len(word) and word:
            rest += word
            word = bytearray()
        if place == len(word):
            word.append(byte)
        else:
            rest.append(byte)
        if len(word) == 3:
            low, middle, high = word
            values.append(((low & 63) + ((middle & 63) << 6) + ((high & 63) << 12), not high & 64))
            word = bytearray()
    return values, bytes(rest + word)


def blocks(received: bytes, size: int) -> NDArray[np.int64]:
    """The whole blocks of `size` values, shape (n, size)."""
    found: list[list[int]] = []
    for value, first in decode(received)[0]:
        if first:
            found.append([])
        if found:
            found[-1].append(value)
    return np.array([block for block in found if len(block) == size], dtype=np.int64).reshape(-1, size)


def receive(port: serial.Serial, enough: Callable[[bytes], bool]) -> bytes:
    """Read until it is enough; AssertionError when that takes too long."""
    received, deadline = b"", time.monotonic() + LONG
    while not enough(received):
        assert time.monotonic() < deadline, received[-200:]
        received += port.read(max(port.in_waiting, 1))
    return received


def say(port: serial.Serial, command: str) -> str:
    """The answer to a command without its prompt, values of the stream left out."""
    port.write(command.encode() + b"\n")
    received = receive(port, lambda so_far: b"->" in so_far)
    text, _, _ = decode(received)[1].decode().rpartition("->")
    return text


class Bare:
    """Sensor and dialogue without line and thread, at instants that the test makes up."""

    def __init__(
        self,
        sight: Seen | None = None,
        laser: Laser = PERFECT,
        *,
        start: float = 100.0,
        clock_error: float = 0.0,
        **as_found: object,
    ) -> None:
        settings = Settings(**{"output": "RS422", "rate": 4000.0, "echo": False, **as_found})  # type: ignore[arg-type]
        random = np.random.default_rng(1)
        self.now = start
        self.sensor = Sensor(sight or still(0.0), laser, clock_error, random, settings, start)
        identity = Identity("ILD1420-10", "15030002", laser.measuring_range)
        actions = Actions(self.sensor, identity, "000", boot_time=0.5)
        self.dialogue = Dialogue(self.sensor, actions, (250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0))

    def say(self, command: str) -> str:
        """The answer, prompt included."""
        return self.dialogue.receive(command.encode() + b"\r\n", self.now).decode()

    def stream(self, seconds: float, size: int = 1, turn: float = 0.002) -> NDArray[np.int64]:
        """Blocks sent while so much time passes, shape (n, size)."""
        return blocks(self.raw(seconds, turn), size)

    def raw(self, seconds: float, turn: float = 0.002) -> bytes:
        sent = b""
        for _ in range(round(seconds / turn)):
            self.now += turn
            sent += self.sensor.stream(self.now).tobytes()
        return sent
