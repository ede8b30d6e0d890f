"""Rig that replays the recorded samples of a file, run by run."""

from collections.abc import Collection, Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, VirtualClock
from drivers.drive import REARM, RigBase, RigState, ending_by, require_block
from drivers.errors import RigError
from drivers.rig import Alignment, Block, Channel, Counts, OperatorTask


class RecordedRun(Protocol):
    """Recorded samples of one run, from arming to the end of the run."""

    @property
    def stretches(self) -> Sequence[tuple[int, int]]:
        """Index of the first sample and number of samples of each gap-free section, in ascending order."""
        ...

    def counts(self, first: int, n: int) -> Counts:
        """Counts at `n` samples from index `first` on, shape (n, n_channels); the samples must be in one gap-free
        section.
        """
        ...


class Recording(Protocol):
    """A file that can be replayed."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The inputs, in the order of the columns of the counts."""
        ...

    @property
    def sample_rate(self) -> float:
        """Samples per second per channel [1/s]."""
        ...

    @property
    def drive_range(self) -> float:
        """Largest magnitude of the recorded rig's drive [V]."""
        ...

    @property
    def lead(self) -> int:
        """Number of drive samples that the recorded rig required to be queued beyond a block."""
        ...

    @property
    def description(self) -> dict[str, str]:
        """Names and identities of the recorded devices."""
        ...

    @property
    def runs(self) -> Sequence[RecordedRun]:
        """The runs, in recorded order."""
        ...


class Course(Protocol):
    """Block times, safety inputs and clock alignments of the recorded runs; runs are numbered from 0."""

    def in_hand(self, run: int, samples: int) -> float:
        """Time since the start of the recording [s] at which the first `samples` samples of `run` were available."""
        ...

    def opened(self, run: int, samples: int) -> Collection[str]:
        """Safety inputs open after `samples` samples of `run`."""
        ...

    def alignments(self, run: int) -> tuple[Alignment, ...]:
        """Clock alignments, in `run`, of the sensors that have their own clocks."""
        ...


class ReplayRig(RigBase):
    """Rig that replays the next recorded run at each arming.

    The drive is checked as in every rig but has no effect. A block ends early at a gap or at the end of the recording;
    after a gap the next block begins at a later sample, and the samples of the gap consume no drive. `lead` defaults to
    the recording's lead. An optional `course` determines when blocks arrive, on a `clock` that starts at 0 with the
    recording, and when safety inputs open; it also supplies the clock alignments. The caller closes the recording after
    closing the rig.
    """

    def __init__(
        self,
        recording: Recording,
        *,
        clock: Clock | None = None,
        lead: int | None = None,
        course: Course | None = None,
    ) -> None:
        lead = recording.lead if lead is None else lead
        super().__init__(recording.drive_range, lead, clock if clock is not None else VirtualClock())
        self.channels, self.sample_rate = recording.channels, recording.sample_rate
        self.description = {**recording.description, "backend": "replay"}
        self._recording = recording
        self._course = course
        self._number = -1
        self._overrun: str | None = None
        self._rest: list[tuple[int, int]] = []
        self._started = 0.0

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        return () if self._course is None or self._number < 0 else self._course.alignments(self._number)

    @property
    def overrun(self) -> str | None:
        """Description of a request beyond the end of the recording; None if there was none."""
        return self._overrun

    def interlocks(self) -> Mapping[str, bool]:
        if self._course is None or not self.armed:
            return {}
        return dict.fromkeys(self._course.opened(self._number, self._drive.index), False)

    def arm(self) -> None:
        self.require_stopped("arm", REARM)
        runs = self._recording.runs
        if self._number + 1 >= len(runs):
            self._overrun = f"no recorded run remains (recorded: {len(runs)})"
            raise RigError(f"arm is refused: {self._overrun}; reopen the recording")
        self._number += 1
        self._rest = list(runs[self._number].stretches)
        self._drive.begin()
        self._started = self.clock.now()
        self._state = RigState.ARMED

    def write(self, volts: NDArray[np.float64]) -> None:
        self.require_armed("write")
        with ending_by(self.stop):
            self._drive.append(volts)

    def read(self, n: int) -> Block:
        self.require_armed("read")
        require_block(n)
        with ending_by(self.stop):
            self._drive.require(n)
            if not self._rest:
                self._overrun = f"the recording of this run ends at sample {self._drive.index}"
                raise RigError(f"{self._overrun}; stop, and arm for the next run")
        first, length = self._rest.pop(0)
        taken = min(n, length)
        if taken < length:
            self._rest.insert(0, (first + taken, length - taken))
        self._drive.advance(taken, gap=first - self._drive.index)
        if taken < n and not self._rest:
            self._overrun = f"the recording of this run ends within a block, at sample {self._drive.index}"
        counts = self._recording.runs[self._number].counts(first, taken)
        end = self._drive.index
        due = self._started + end / self.sample_rate
        self.clock.wait_until(due if self._course is None else self._course.in_hand(self._number, end))
        return Block(first, counts)

    def perform(self, work: OperatorTask, amount: float | None = None) -> None:  # noqa: ARG002
        self.require_stopped(work.value)
