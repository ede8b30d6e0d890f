"""A recorded file behind the interface of every rig: what was measured is measured again, run by run."""

from collections.abc import Collection, Mapping, Sequence
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


class Course(Protocol):
    """What is known of the recorded runs besides their samples; runs are counted from 0, in their order."""

    def in_hand(self, run: int, samples: int) -> float:
        """Bench time [s] at which the samples of `run` before number `samples` had been read."""
        ...

    def opened(self, run: int, samples: int) -> Collection[str]:
        """The safety inputs that were not good then."""
        ...

    def alignments(self, run: int) -> tuple[Alignment, ...]:
        """How sensors with clocks of their own were placed in `run`."""
        ...


class _State(Enum):
    STOPPED = "not armed"
    ARMED = "armed"
    CLOSED = "closed"


class ReplayRig:
    """Each arming plays the next recorded run. The drive is held to the rules of every rig and moves nothing.

    A block ends early where the recording has a gap or ends; after a gap the next one begins at a later sample, and
    the samples of the gap use up no drive. `lead` is that of the recording unless told. With a `course`, it says
    when blocks come, on a `clock` that begins at 0 with the recording, and when safety inputs open. The recording
    is the caller's to close, after the rig.
    """

    def __init__(
        self,
        recording: Recording,
        *,
        clock: Clock | None = None,
        lead: int | None = None,
        course: Course | None = None,
    ) -> None:
        self._drive = Drive(recording.drive_range, recording.lead if lead is None else lead)
        self._recording = recording
        self._clock = clock if clock is not None else VirtualClock()
        self._course = course
        self._number = -1
        self._run: RecordedRun | None = None
        self._over: str | None = None
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
        return () if self._course is None or self._run is None else self._course.alignments(self._number)

    @property
    def over(self) -> str | None:
        """What was asked for and is not recorded, in words; None while there was nothing."""
        return self._over

    def interlocks(self) -> Mapping[str, bool]:
        if self._course is None or self._state is not _State.ARMED:
            return {}
        return dict.fromkeys(self._course.opened(self._number, self._drive.index), False)

    def arm(self) -> None:
        if self._state is not _State.STOPPED:
            raise RigError(f"arm is refused: the rig is {self._state.value}; stop it first, or open a new one")
        runs = self._recording.runs
        if self._number + 1 >= len(runs):
            self._over = f"all {len(runs)} recorded runs were played"
            raise RigError(f"arm is refused: {self._over}; open it anew")
        self._number += 1
        self._run = runs[self._number]
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
                self._over = f"the recording of this run is over at sample {self._drive.index}"
                raise RigError(f"{self._over}; stop, and arm for the next run")
        first, length = self._rest.pop(0)
        taken = min(n, length)
        if taken < length:
            self._rest.insert(0, (first + taken, length - taken))
        self._drive.advance(taken, gap=first - self._drive.index)
        if taken < n and not self._rest:
            self._over = f"the recording of this run ends within a block, at sample {self._drive.index}"
        counts = run.counts(first, taken)
        end = self._drive.index
        due = self._started + end / self.sample_rate
        self._clock.wait_until(due if self._course is None else self._course.in_hand(self._number, end))
        return Block(first, counts)

    def stop(self) -> None:
        if self._state is _State.ARMED:
            self._state = _State.STOPPED

    def halt(self) -> None:
        self.stop()

    def close(self) -> None:
        self._state = _State.CLOSED

    def handwork(self, work: Handwork, amount: float | None = None) -> None:  # noqa: ARG002
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
