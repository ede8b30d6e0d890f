"""The rules for the drive that every rig keeps: what may be written, and what must be waiting when a block is read."""

from collections.abc import Callable, Generator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from drivers.errors import DriveUnderflow, RigError
from sim.errors import InvalidInput


class Drive:
    """Checks the samples that are written and counts those that wait; nothing is played here.

    `range` is the largest magnitude [V], `lead` the number of samples that must wait beyond those of a block. Raises
    InvalidInput for a negative lead.
    """

    def __init__(self, range: float, lead: int) -> None:
        if lead < 0:
            raise InvalidInput("lead", lead, "it must be a number of samples, 0 or more")
        self._range = range
        self.lead = lead
        self._waiting = 0
        self.index = 0
        """Number of the sample that is read next, counted from `begin`."""

    def begin(self) -> None:
        """A run begins: nothing waits, and sample 0 is the next."""
        self._waiting = self.index = 0

    def append(self, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        """A copy of `volts`, shape (n,), which waits from now on.

        Raises RigError when it is not one row, not finite or out of range.
        """
        samples = np.array(volts, dtype=np.float64)
        if samples.ndim != 1:
            raise RigError(f"a drive of shape {samples.shape} is refused: it must be one row of samples")
        if not np.isfinite(samples).all():
            raise RigError("a drive with samples that are not finite is refused")
        if (peak := float(np.abs(samples).max(initial=0.0))) > self._range:
            raise RigError(f"a drive of {peak:.6g} V is refused: the range is +-{self._range:g} V")
        self._waiting += samples.size
        return samples

    def require(self, n: int) -> None:
        """Raise DriveUnderflow unless the lead waits beyond the next `n` samples."""
        if self._waiting < n + self.lead:
            raise DriveUnderflow(
                f"the drive ran out at sample {self.index}: {self._waiting} samples were waiting and {n + self.lead}"
                " are needed; write earlier or read less at once"
            )

    def advance(self, n: int, gap: int = 0) -> int:
        """`n` samples were played and read, after a gap that used up no drive: the number of the first of them."""
        first = self.index + gap
        self._waiting -= n
        self.index = first + n
        return first


def require_block(n: int) -> None:
    """Raise InvalidInput unless `n` samples make a block."""
    if n < 1:
        raise InvalidInput("samples to read", n, "it must be at least 1")


@contextmanager
def ending_by(stop: Callable[[], None]) -> Generator[None]:
    """What is refused inside ends the run."""
    try:
        yield
    except RigError:
        stop()
        raise
