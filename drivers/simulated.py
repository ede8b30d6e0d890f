"""The simulated rig: the virtual bench behind the interface of the hardware."""

from collections import deque
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, VirtualClock
from drivers.drive import Drive, ending_by, require_block
from drivers.errors import RigError
from drivers.further import FurtherChannel
from drivers.handyman import Handyman
from drivers.rig import Alignment, Block, Channel, Handwork
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters

_STILL_VELOCITY = 2.0e-4
"""Velocity of table, storeys and the block's top [m/s] below which the bench counts as at rest."""
_STILL_DISPLACEMENT = 2.0e-4
"""Displacement of the table from mid stroke [m] below which it counts as at rest."""
_LONGEST_WAIT = 300.0
"""Longest wait for that [s]; a block that hangs in its catch or a tilted table is not waited for."""
_WARM_UP = 0.5
"""How long filters and lasers have watched the bench at rest before the sample clock starts [s]."""


class _State(Enum):
    STOPPED = "not armed"
    ARMED = "armed"
    CLOSED = "closed"


class SimulatedRig:
    """A rig whose bench is computed. Under a `VirtualClock` it is as fast as the machine allows; under a
    `WallClock` a block is handed out when it would have been measured.

    `lead` is the number of drive samples that must be waiting, 50 ms unless told. Between two arms as much time
    passes as a person waits: the bench coasts at zero drive until it is at rest. What is held by hand is let go a few
    seconds after sample 0; after a run that ended before, it is held on. Every spring that is mounted is
    `spring_factor` times as stiff as it is said to be.
    """

    def __init__(
        self,
        parameters: VirtualBenchParameters,
        specimen: Specimen,
        *,
        seed: int,
        clock: Clock | None = None,
        lead: int | None = None,
        spring_factor: float = 1.0,
        further: Sequence[FurtherChannel] = (),
    ) -> None:
        lead = round(0.05 * parameters.sample_rate) if lead is None else lead
        self._drive = Drive(parameters.shaker.drive_range, lead)
        self.bench = VirtualBench(parameters, specimen, seed, [each.simulated for each in further])
        self._clock = clock if clock is not None else VirtualClock()
        self._seed = seed
        self._handyman = Handyman(specimen, spring_factor)
        self._state = _State.STOPPED
        self._moved = False
        self._queue: deque[NDArray[np.float64]] = deque()
        self._started = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self.bench.channels

    @property
    def sample_rate(self) -> float:
        return self.bench.parameters.sample_rate

    @property
    def drive_range(self) -> float:
        return self.bench.parameters.shaker.drive_range

    @property
    def lead(self) -> int:
        return self._drive.lead

    @property
    def clock(self) -> Clock:
        return self._clock

    @property
    def description(self) -> dict[str, str]:
        p = self.bench.parameters
        return {
            "backend": "simulated",
            "seed": str(self._seed),
            "shaker": f"simulated, {p.shaker.moving_mass:g} kg, {p.shaker.amplifier} amplifier",
            "converter": f"simulated, {p.converter.bits} bit, +-{p.converter.range:g} V",
            "filter_unit": f"simulated, Butterworth order {p.filter_unit.order}, {p.filter_unit.cutoff:g} Hz",
            **{channel.name: channel.device for channel in self.bench.channels},
        }

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        return ()

    def interlocks(self) -> Mapping[str, bool]:
        return {}

    def arm(self) -> None:
        if self._state is not _State.STOPPED:
            raise RigError(f"arm is refused: the rig is {self._state.value}; stop it first, or open a new one")
        self._come_to_rest()
        self.bench.run(np.zeros(round(_WARM_UP * self.sample_rate)))
        self._queue.clear()
        self._drive.begin()
        self.bench.arm()
        self._started = self._clock.now()
        self._moved = True
        self._state = _State.ARMED

    def write(self, volts: NDArray[np.float64]) -> None:
        self._require_armed("write")
        with ending_by(self.stop):
            self._queue.append(self._drive.append(volts))

    def read(self, n: int) -> Block:
        self._require_armed("read")
        require_block(n)
        with ending_by(self.stop):
            self._drive.require(n)
        counts = self.bench.run(self._next_samples(n))
        first = self._drive.advance(n)
        self._clock.wait_until(self._started + self._drive.index / self.sample_rate)
        if self._state is not _State.ARMED:
            raise RigError("the rig was halted while it read a block; the block is lost, arm it again")
        return Block(first, counts)

    def stop(self) -> None:
        if self._state is _State.ARMED:
            self._state = _State.STOPPED
        self._queue.clear()

    def halt(self) -> None:
        # the enable line and the output are one thing here: what follows is zero drive. Another thread may be taking
        # samples from the queue, so that is left to the next `arm`
        if self._state is _State.ARMED:
            self._state = _State.STOPPED

    def close(self) -> None:
        self.stop()
        self._state = _State.CLOSED

    def handwork(self, work: Handwork, amount: float | None = None) -> None:
        if self._state is not _State.STOPPED:
            raise RigError(f"{work.value} is refused: the rig is {self._state.value}; hands belong on a stopped rig")
        arrangement = self._handyman.after(work, amount, self.bench.arrangement)
        self._come_to_rest()
        self.bench.mount(arrangement)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _require_armed(self, what: str) -> None:
        if self._state is not _State.ARMED:
            raise RigError(f"{what} is refused: the rig is {self._state.value}; arm it first")

    def _next_samples(self, n: int) -> NDArray[np.float64]:
        """Take `n` samples from the queue."""
        taken: list[NDArray[np.float64]] = []
        missing = n
        while missing:
            head = self._queue.popleft()
            if head.size > missing:
                self._queue.appendleft(head[missing:])
                head = head[:missing]
            taken.append(head)
            missing -= head.size
        return np.concatenate(taken)

    def _come_to_rest(self) -> None:
        """Let time pass at zero drive until nothing moves to speak of."""
        # here and not in `halt`, which may interrupt a read
        self.bench.disarm()
        waited = 0.0
        while self._moved and waited < _LONGEST_WAIT:
            self.bench.coast(1.0)
            waited += 1.0
            truth = self.bench.truth
            top = 2.0 * self.bench.specimen.block.h_b * truth.omega
            velocity = max(float(np.abs(v).max()) for v in (truth.v, truth.v1, truth.v2, top))
            self._moved = velocity > _STILL_VELOCITY or abs(float(truth.x[-1])) > _STILL_DISPLACEMENT
        self._moved = False
