"""Real-time virtual bench to which the emulated instruments are wired."""

import threading
import time
from collections.abc import Callable
from math import floor

import numpy as np
from numpy.typing import NDArray

from drivers.emulation.plant import History, Output
from drivers.errors import RigError
from drivers.rig import OperatorTask
from drivers.specimen_handling import SpecimenHandling
from sim import waiting
from sim.channel import Channel, Counts
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters

_KEPT = 30.0
"""Duration of the retained history [s]."""
_IDLE_TURN = 0.02
"""Interval at which the bench advances while no client reads it [s]."""


class EmulatedBench:
    """A `Plant` that contains the virtual bench. A read of new ticks advances the bench to the present; between reads,
    a separate thread advances it.

    One tick is one sample of the virtual bench; `clock_error` is the relative error of the tick rate, in addition to
    that of the bench's own sample clock.
    """

    def __init__(
        self,
        parameters: VirtualBenchParameters,
        specimen: Specimen,
        *,
        seed: int,
        spring_factor: float = 1.0,
        clock_error: float = 0.0,
    ) -> None:
        self._bench = VirtualBench(parameters, specimen, seed)
        self._handling = SpecimenHandling(specimen, spring_factor)
        self._rate = parameters.tick_rate * (1.0 + clock_error)
        kept = round(_KEPT * parameters.sample_rate)
        self._counts = History(kept, self.terminals, np.int16)
        self._displacements = History(kept, 4, np.float64)
        laser, lsb = parameters.laser_1, parameters.converter.lsb
        self._error_counts = round(laser.error_current * laser.load / lsb)
        self._outputs: dict[int, Callable[[], bool]] = {}
        self._output: Output | None = None
        self._enabled = False
        self._half_stroke = parameters.shaker.half_stroke
        self._subscriber: Callable[[NDArray[np.float64]], None] | None = None
        self.lock = threading.RLock()
        """Guards the bench; held while the subscriber receives the table's motion."""
        # load the compiled code and run one sample before the clock starts
        self._bench.run(np.zeros(1))
        self._started = time.monotonic()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._idle, name="emulated-bench", daemon=True)

    def start(self) -> None:
        """Start the thread that advances the bench."""
        while self._displacements.end < 2:
            # interpolation requires two ticks
            self._advance()
        self._thread.start()

    def close(self) -> None:
        """Stop the thread; may be called repeatedly."""
        self._over.set()
        if self._thread.is_alive():
            waiting.join(self._thread)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels of the bench, one per input terminal."""
        return self._bench.channels

    @property
    def tick_rate(self) -> float:
        return self._bench.parameters.sample_rate

    @property
    def rate_true(self) -> float:
        """Tick rate by the machine's clock [1/s]."""
        return self._rate

    @property
    def terminals(self) -> int:
        return len(self._bench.channels)

    def tick(self) -> int:
        return floor((time.monotonic() - self._started) * self._rate)

    def time_of(self, tick: int) -> float:
        return self._started + tick / self._rate

    def inputs(self, first: int, n: int) -> Counts:
        with self.lock:
            if first + n > self._counts.end:
                self._advance()
            return self._counts.at(np.arange(first, first + n))

    def wire(self, output: Output) -> None:
        with self.lock:
            self._advance()
            self._output = output

    def enable(self, closed: bool) -> None:
        with self.lock:
            self._advance()
            if closed and not self._enabled:
                self._bench.arm()
            elif not closed:
                self._bench.disarm()
            self._enabled = closed

    @property
    def half_stroke(self) -> float:
        """Distance from mid stroke to each end stop of the table [m]."""
        return self._half_stroke

    def watch(self, subscriber: Callable[[NDArray[np.float64]], None]) -> None:
        """Pass the table's displacement [m] at all ticks, shape (n,), to the subscriber as soon as it is computed."""
        with self.lock:
            self._subscriber = subscriber

    def connect_laser(self, storey: int, live: Callable[[], bool]) -> None:
        """Connect the analogue output of the laser on storey 1 or 2: it follows the laser's target while `live` returns
        True, and otherwise supplies the error current.
        """
        with self.lock:
            self._outputs[1 + storey] = live

    def sight(self, storey: int) -> "Storey":
        """Target of the laser on storey 1 or 2: the storey, or the block while laser 2 is aimed at it."""
        return Storey(self, storey)

    def target_displacement(self, storey: int, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacement [m] of the target of a storey's laser at times of the machine's monotonic clock [s], with cubic
        interpolation between ticks.
        """
        ticks = (times - self._started) * self._rate
        with self.lock:
            if ticks.size and ticks[-1] > self._displacements.end - 1:
                self._advance()
            ticks = np.clip(ticks, 0.0, self._displacements.end - 1)
            before = np.minimum(np.floor(ticks).astype(np.int64), max(self._displacements.end - 2, 0))
            columns = [2 * (storey - 1), 2 * (storey - 1) + 1]
            (x0, v0), (x1, v1) = (
                self._displacements.at(before)[:, columns].T,
                self._displacements.at(before + 1)[:, columns].T,
            )
        place, length = ticks - before, 1.0 / self.tick_rate
        rest = 1.0 - place
        start = x0 * (1.0 + 2.0 * place) + length * v0 * place
        end = x1 * (1.0 + 2.0 * rest) - length * v1 * rest
        return start * rest * rest + end * place * place

    def perform(self, work: OperatorTask, amount: float | None) -> None:
        """Carry out an operator's task. Raises RigError while the amplifier is enabled, and the errors of
        `SpecimenHandling.after`.
        """
        with self.lock:
            if self._enabled:
                raise RigError(
                    f"{work.value} is refused: the amplifier is enabled; operator actions require a stopped bench"
                )
            self._advance()
            self._bench.mount(self._handling.after(work, amount, self._bench.arrangement))

    @property
    def enabled(self) -> bool:
        """Whether the amplifier follows the drive."""
        return self._enabled

    @property
    def specimen(self) -> Specimen:
        """The specimen on the table."""
        return self._bench.specimen

    @property
    def fallen(self) -> bool:
        """Whether the block has fallen and is held by its catch."""
        return self._bench.fallen

    def _idle(self) -> None:
        while not self._over.wait(_IDLE_TURN):
            with self.lock:
                self._advance()

    def _advance(self) -> None:
        """Compute all ticks that have passed."""
        first = self._counts.end
        n = self.tick() - first
        if n <= 0:
            return
        # the output continues to play, whatever the state of the amplifier
        volts = np.zeros(n) if self._output is None else self._output(first, n)
        counts = self._bench.run(volts if self._enabled else np.zeros(n))
        for column, live in self._outputs.items():
            if not live():
                counts[:, column] = self._error_counts
        self._counts.append(counts)
        self._displacements.append(self._bench.sights.T)
        if self._subscriber is not None:
            self._subscriber(self._bench.truth.x)


class Storey:
    """Target of one of the lasers, as a `Sight`."""

    def __init__(self, bench: EmulatedBench, storey: int) -> None:
        self._bench, self._storey = bench, storey

    def displacement(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._bench.target_displacement(self._storey, times)
