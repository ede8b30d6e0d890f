"""A rig around another that does as it is told: false samples, late blocks, calls that fail."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.rig import Alignment, Block, Channel, OperatorTask, RawValues, Rig, RigError
from drivers.simulated import SimulatedRig

Array = NDArray[np.float64]
SAFETY_INPUTS = ("emergency stop", "over-travel", "amplifier ready")


class FaultyClock:
    """A clock that can jump, and run fast from some moment on."""

    def __init__(self, inner: Clock) -> None:
        self._inner = inner
        self._fast = 0.0
        self._since = 0.0
        self.offset = 0.0

    def now(self) -> float:
        return self._inner.now() + self.offset + self._fast * (self._inner.now() - self._since)

    def wait_until(self, instant: float) -> None:
        self._inner.wait_until(instant - self.offset)

    def drift(self, rate: float) -> None:
        """Gain `rate` seconds per second from now on."""
        self._fast, self._since = rate, self._inner.now()


@dataclass
class Failure:
    """What a call raises, how often, and whether it does its work before."""

    error: RigError
    times: float = 1
    obeys: bool = False


@dataclass
class Run:
    """What went through the rig from one arming to its end."""

    written: list[Array] = field(default_factory=list[Array])
    read: int = 0
    """Samples that were played and read."""
    peaks: Array = field(default_factory=lambda: np.zeros(3))
    """Largest |x| [m], |v| [m/s] and |a| [m/s2] of the table in truth."""

    @property
    def drive(self) -> Array:
        """Everything that was written [V]."""
        return np.concatenate([np.zeros(0), *self.written])

    def moved(self, x: Array, v: Array, a: Array) -> None:
        """Count a stretch of the table's true motion in."""
        self.peaks = np.maximum(self.peaks, [np.abs(part).max() for part in (x, v, a)])


class FaultyRig:
    """The surface of `drivers.rig.Rig`. Without a fault it is the rig that it wraps, with safety inputs added.

    `before_read` is called ahead of each read; `falsify` changes the blocks that are read; `gain` is what stands
    between the output and the amplifier; `failures` says which calls raise what.
    """

    def __init__(self, inner: Rig) -> None:
        self.inner = inner
        self.faulty_clock = FaultyClock(inner.clock)
        self.safety = dict.fromkeys(SAFETY_INPUTS, True)
        self.failures: dict[str, Failure] = {}
        self.falsify: list[Callable[[Block], Block]] = []
        self.before_read: Callable[[], None] = lambda: None
        self.gain = 1.0
        self.runs: list[Run] = []
        self.struck: list[str] = []
        """Calls that failed as they were told to."""
        self.cuts = 0
        """How often the enable line of the armed rig was cut."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self.inner.channels

    @property
    def sample_rate(self) -> float:
        return self.inner.sample_rate

    @property
    def drive_range(self) -> float:
        return self.inner.drive_range

    @property
    def lead(self) -> int:
        return self.inner.lead

    @property
    def clock(self) -> Clock:
        return self.faulty_clock

    @property
    def description(self) -> dict[str, str]:
        return self.inner.description

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        return self.inner.alignments

    @property
    def armed(self) -> bool:
        """Whether the enable line is closed."""
        try:
            self.inner.write(np.zeros(0))
        except RigError:
            return False
        return True

    def raw_values(self) -> tuple[RawValues, ...]:
        return self.inner.raw_values()

    def interlocks(self) -> Mapping[str, bool]:
        self._fail("interlocks")
        return {**self.inner.interlocks(), **self.safety}

    def arm(self) -> None:
        self._fail("arm", self.inner.arm)
        self.inner.arm()
        self.runs.append(Run())

    def write(self, volts: NDArray[np.float64]) -> None:
        self._fail("write")
        reach = self.drive_range
        self.inner.write(volts if self.gain == 1.0 else np.clip(self.gain * volts, -reach, reach))
        self.runs[-1].written.append(np.array(volts))

    def read(self, n: int) -> Block:
        self.before_read()
        block = self.inner.read(n)
        self._played(n)
        self._fail("read", self.inner.stop)
        for change in self.falsify:
            changed = change(block)
            if changed is not block:
                self.struck.append("samples")
            block = changed
        return block

    def stop(self) -> None:
        self._fail("stop", self.inner.stop)
        self.inner.stop()

    def halt(self) -> None:
        self._fail("halt", self.inner.halt)
        self.cuts += self.armed
        self.inner.halt()

    def close(self) -> None:
        self.inner.close()

    def perform(self, work: OperatorTask, amount: float | None = None) -> None:
        self._fail("perform")
        self.inner.perform(work, amount)

    def _played(self, n: int) -> None:
        """Count samples that were played, and how the table moved meanwhile."""
        run = self.runs[-1]
        run.read += n
        if isinstance(self.inner, SimulatedRig):
            truth = self.inner.bench.truth
            run.moved(truth.x, truth.v, truth.a)

    def _fail(self, call: str, work: Callable[[], object] = lambda: None) -> None:
        failure = self.failures.get(call)
        if failure is None:
            return
        failure.times -= 1
        if failure.times <= 0:
            del self.failures[call]
        self.struck.append(call)
        if failure.obeys:
            work()
        raise failure.error
