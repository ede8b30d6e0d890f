"""State and drive of a rig: permitted calls and samples, and the lead required when a block is read."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from enum import Enum
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import DriveUnderflow, RigError
from drivers.rig import RawValues
from sim.errors import InvalidInput


class Drive:
    """Checks drive samples and counts those queued; it does not play them.

    `range` is the largest magnitude [V], `lead` the number of samples required in addition to a block. Raises
    InvalidInput for a negative lead.
    """

    def __init__(self, range: float, lead: int) -> None:
        if lead < 0:
            raise InvalidInput("lead", lead, "it must be a number of samples, 0 or more")
        self._range = range
        self.lead = lead
        self._waiting = 0
        self.index = 0
        """Index of the next sample to be read, counted from `begin`."""

    def begin(self) -> None:
        """Begin a run at sample 0, without queued samples."""
        self._waiting = self.index = 0

    def append(self, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        """Count `volts`, shape (n,), as queued, and return a copy.

        Raises RigError unless the samples are one-dimensional, finite and within the range.
        """
        samples = np.array(volts, dtype=np.float64)
        if samples.ndim != 1:
            raise RigError(f"a drive of shape {samples.shape} is refused: it must be one-dimensional")
        # a comparison with NaN is false
        if not (samples.max(initial=0.0) <= self._range and samples.min(initial=0.0) >= -self._range):
            if not np.isfinite(samples).all():
                raise RigError("a drive with samples that are not finite is refused")
            peak = float(np.abs(samples).max(initial=0.0))
            raise RigError(f"a drive of {peak:.6g} V is refused: the range is +-{self._range:g} V")
        self._waiting += samples.size
        return samples

    def require(self, n: int) -> None:
        """Raise DriveUnderflow unless `n` samples and the lead are queued."""
        if self._waiting < n + self.lead:
            raise DriveUnderflow(
                f"the drive ran out at sample {self.index}: {self._waiting} of {n + self.lead} required samples were"
                " queued; write earlier, or increase acquisition.lead"
            )

    def advance(self, n: int, gap: int = 0) -> int:
        """Count `n` queued samples as played and read, and return the index of the first one. `gap` is the number of
        samples before it that are missing from a recording.
        """
        first = self.index + gap
        self._waiting -= n
        self.index = first + n
        return first


def require_block(n: int) -> None:
    """Raise InvalidInput unless `n` is a valid block length."""
    if n < 1:
        raise InvalidInput("samples to read", n, "it must be at least 1")


def ending_by(stop: Callable[[], None]) -> AbstractContextManager[None]:
    """Context manager that stops the rig if a RigError is raised in its body."""
    return _EndingBy(stop)


class _EndingBy(AbstractContextManager[None]):
    __slots__ = ("_stop",)

    def __init__(self, stop: Callable[[], None]) -> None:
        self._stop = stop

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, RigError):
            self._stop()


class RigState(Enum):
    """States of a rig. A rig whose sample clock starts with the first block read is armed until then, and running
    afterwards.
    """

    STOPPED = "not armed"
    ARMED = "armed"
    RUNNING = "running"
    CLOSED = "closed"


class RigBase:
    """State, drive and clock of a rig: methods of `drivers.rig.Rig` common to this program's backends.

    `lead` is the number of drive samples that must be queued beyond the block being read. As a context manager, it
    closes the rig on exit.
    """

    def __init__(self, drive_range: float, lead: int, clock: Clock) -> None:
        self._drive = Drive(drive_range, lead)
        self._state = RigState.STOPPED
        self.drive_range, self.lead, self.clock = drive_range, lead, clock

    @property
    def armed(self) -> bool:
        """Whether the rig accepts drive samples."""
        return self._state in (RigState.ARMED, RigState.RUNNING)

    def raw_values(self) -> tuple[RawValues, ...]:
        return ()

    def interlocks(self) -> Mapping[str, bool]:
        return {}

    def stop(self) -> None:
        if self._state is not RigState.CLOSED:
            self._state = RigState.STOPPED

    def halt(self) -> None:
        # only the state changes, so that a call from a signal handler or another thread never blocks
        self.stop()

    def close(self) -> None:
        self._state = RigState.CLOSED

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def require_stopped(self, call: str, remedy: str = "stop it first") -> None:
        """Raise RigError unless the rig is stopped."""
        if self._state is not RigState.STOPPED:
            raise RigError(f"{call} is refused: the rig is {self._state.value}; {remedy}")

    def require_armed(self, call: str) -> None:
        """Raise RigError unless the rig is armed."""
        if not self.armed:
            raise RigError(f"{call} is refused: the rig is {self._state.value}; arm it first")


REARM = "stop it first, or open a new one"
"""Remedy for a rig that cannot be armed."""
