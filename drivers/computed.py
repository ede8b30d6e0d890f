"""Rig whose samples are computed from its drive."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.drive import REARM, RigBase, RigState, ending_by, require_block
from drivers.errors import RigError
from drivers.rig import Alignment, Block, Channel, Counts, OperatorTask


class ComputedRig(RigBase, ABC):
    """Base class of backends without hardware, paced by the clock: a subclass implements `respond`, and optionally
    `begin` and `carry_out`. A block is returned at the time at which it would have been measured.
    """

    def __init__(
        self,
        channels: tuple[Channel, ...],
        sample_rate: float,
        drive_range: float,
        lead: int,
        clock: Clock,
        description: Mapping[str, str],
    ) -> None:
        super().__init__(drive_range, lead, clock)
        self.channels, self.sample_rate, self.description = channels, sample_rate, dict(description)
        self.alignments: tuple[Alignment, ...] = ()
        self._queue: deque[NDArray[np.float64]] = deque()
        self._started = 0.0

    @abstractmethod
    def respond(self, volts: NDArray[np.float64]) -> Counts:
        """Counts of all channels, shape (n, n_channels), in response to the next `volts`, shape (n,). Sample i of the
        drive must not affect the inputs before sample i + 1.
        """

    def begin(self) -> None:
        """Prepare a run; called by `arm` before sample 0."""

    def carry_out(self, work: OperatorTask, amount: float | None) -> None:
        """Carry out an operator action on the stopped rig."""

    def arm(self) -> None:
        self.require_stopped("arm", REARM)
        self.begin()
        self._queue.clear()
        self._drive.begin()
        self._started = self.clock.now()
        self._state = RigState.ARMED

    def write(self, volts: NDArray[np.float64]) -> None:
        self.require_armed("write")
        with ending_by(self.stop):
            self._queue.append(self._drive.append(volts))

    def read(self, n: int) -> Block:
        self.require_armed("read")
        require_block(n)
        with ending_by(self.stop):
            self._drive.require(n)
        counts = self.respond(self._next_samples(n))
        first = self._drive.advance(n)
        self.clock.wait_until(self._started + self._drive.index / self.sample_rate)
        if not self.armed:
            raise RigError("the rig was halted while it read a block; the block is lost: arm the rig again")
        return Block(first, counts)

    def perform(self, work: OperatorTask, amount: float | None = None) -> None:
        self.require_stopped(work.value)
        self.carry_out(work, amount)

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
