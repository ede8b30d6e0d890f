"""A recorded file behind the interface of every rig: what was measured is measured again, run by run."""

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, VirtualClock
from drivers.drive import Drive, ending_by, require_block
from drivers.errors import RigError
from drivers.rig import Alignment, Block, Channel, Counts, Handwork


class RecordedRun(Protocol):
    """What was recorded between an arming and its end."""

    @property
    def stretches(self) -> Sequence[tuple[int, int]]:
        """Index of the first sample and number of samples of each stretch without a gap, ascending."""
        ...

    def counts(self, first: int, n: int) -> Counts:
        """Counts at `n` samples from index `first` on, shape (n, n_channels); they lie within one stretch."""
        ...


class Recording(Protocol):
    """A file that can be played again."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The inputs, in the order of the columns of the counts."""
        ...

    @property
    def sample_rate(self) -> float:
        """Samples per second and channel [1/s]."""
        ...

    @property
    def drive_range(self) -> float:
        """Largest magnitude of the drive [V] of the rig that was recorded."""
        ...

    @property
    def lead(self) -> int:
        """How many drive samples had to wait in the rig that was recorded."""
        ...

    @property
    def description(self) -> dict[str, str]:
        """Names and identities of what was recorded."""
        ...

    @property
    def runs(self) -> Sequence[RecordedRun]:
        """The runs, in the order in which they were recorded."""
        ...


class _State(Enum):
    STOPPED = "not armed"
    ARMED = "armed"
    CLOSED = "closed"


class ReplayRig:
    """Each arming plays the next recorded run. The drive is held to the rules of every rig and moves nothing.

    A block ends early where the recording has a gap or ends; after a gap the next one begins at a later sample, and
    the samples of the gap use up no drive. `lead` is that of the recording unless told. The recording is the
    caller's to close, after the rig.
    """

    def __init__(self, recording: Recording, *, clock: Clock | None = None, lead: int | None = None) -> None:
        self._drive = Drive(recording.drive_range, recording.lead if lead is None else lead)
        self._recording = recording
        self._clock = clock if clock is not None else VirtualClock()
        self._runs = iter(recording.runs)
        self._run: RecordedRun | None = None
        self._rest: list[tuple[int, int]] = []
        self._state = _State.STOPPED
        self._started = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self._recording.channels

    @property
    def sample_rate(self) -> float:
        return self._recording.sample_rate

    @property
    def drive_range(self) -> float:
        return self._recording.drive_range

    @property
    def lead(self) -> int:
        return self._drive.lead

    @property
    def clock(self) -> Clock:
        return self._clock

    @property
    def description(self) -> dict[str, str]:
        return {**self._recording.description, "backend": "replay"}

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        return ()

    def interlocks(self) -> Mapping[str, bool]:
        return {}

    def arm(self) -> None:
        if self._state is not _State.STOPPED:
            raise RigError(f"arm is refused: the rig is {self._state.value}; stop it first, or open a new one")
        self._run = next(self._runs, None)
        if self._run is None:
            raise RigError(f"arm is refused: all {len(self._recording.runs)} recorded runs were played; open it anew")
        self._rest = list(self._run.stretches)
        self._drive.begin()
        self._started = self._clock.now()
        self._state = _State.ARMED

    def write(self, volts: NDArray[np.float64]) -> None:
        self._require_armed("write")
        with ending_by(self.stop):
            self._drive.append(volts)

    def read(self, n: int) -> Block:
        run = self._require_armed("read")
        require_block(n)
        with ending_by(self.stop):
            self._drive.require(n)
            if not self._rest:
                over = f"the recording of this run is over at sample {self._drive.index}"
                raise RigError(f"{over}; stop, and arm for the next run")
        first, length = self._rest.pop(0)
        taken = min(n, length)
        if taken < length:
            self._rest.insert(0, (first + taken, length - taken))
        self._drive.advance(taken, gap=first - self._drive.index)
        counts = run.counts(first, taken)
        self._clock.wait_until(self._started + self._drive.index / self.sample_rate)
        return Block(first, counts)

    def stop(self) -> None:
        if self._state is _State.ARMED:
            self._state = _State.STOPPED

    def halt(self) -> None:
        self.stop()

    def close(self) -> None:
        self._state = _State.CLOSED

    def handwork(self, work: Handwork, stiffness: float | None = None) -> None:  # noqa: ARG002
        if self._state is not _State.STOPPED:
            raise RigError(f"{work.value} is refused: the rig is {self._state.value}; hands belong on a stopped rig")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _require_armed(self, what: str) -> RecordedRun:
        if self._state is not _State.ARMED or self._run is None:
            raise RigError(f"{what} is refused: the rig is {self._state.value}; arm it first")
        return self._run
