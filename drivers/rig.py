"""Interface of a rig: channels, drive output, blocks of samples, and emergency cut of the output.

Sample `i` of the drive is output while sample `i` of the inputs is acquired: both are counted from `arm()`. The drive
is non-regenerating: each sample is written once and played once, and at least `lead` samples must be queued when a
block is read.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import inf, isinf
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.errors import DriveUnderflow as DriveUnderflow
from drivers.errors import RigError as RigError
from sim.channel import Channel as Channel
from sim.channel import Counts as Counts
from sim.parameters import column


@dataclass(frozen=True)
class RawValues:
    """Values of a sensor with its own clock, before resampling: arrays of integers, shape (n,) each.

    `sensor` is the name of its channel. `index` is the number of the measurement, with gaps where values were lost;
    `time` is the time of the measurement on the sensor's clock [us], `code` the sensor's word, and `arrival` the time
    by which the word had been received [us of the computer's clock since `arm()`].
    """

    sensor: str
    index: NDArray[np.int64]
    time: NDArray[np.int64]
    code: NDArray[np.int64]
    arrival: NDArray[np.int64]

    def __len__(self) -> int:
        return int(self.index.size)


@dataclass(frozen=True)
class Block:
    """Consecutive samples of all inputs: `counts` has shape (n_samples, n_channels).

    `first` is the index of the first sample since `arm()`; it jumps at a gap.
    """

    first: int
    counts: Counts

    def __len__(self) -> int:
        return int(self.counts.shape[0])


@dataclass(frozen=True)
class Alignment:
    """Alignment of a sensor's own clock to the sample clock in one run.

    A value measured at time t on the sensor's clock is placed at `offset + rate * t + delay` on the sample clock.
    """

    sensor: str = column("", "name of the channel")
    offset: float = column("s", "time in the run at which the sensor's clock reads 0, excluding the delay")
    rate: float = column("1", "seconds of the sample clock per second of the sensor's clock")
    residual: float = column("s", "root mean square residual of the clock readings")
    delay: float = column("s", "configured delay added to the times of the values")
    values: int = column("1", "number of values received from the sensor")
    lost: int = column("1", "number of missing values")
    late: int = column("1", "number of samples whose values had not arrived when their block was due", default=0)
    implausible: int = column(
        "1", "number of values that differ from the last plausible one by more than the target can move", default=0
    )

    mark_uncertainty: float = column(
        "s",
        "standard uncertainty of the alignment by pulses at the beginning of the run; infinite if the clocks were "
        "aligned from arrival times alone",
        default=inf,
    )

    def __str__(self) -> str:
        rate, residual = 1e6 * (self.rate - 1.0), 1e6 * self.residual
        counted = (
            f"{number} {what}"
            for number, what in ((self.late, "samples late"), (self.implausible, "implausible"))
            if number
        )
        given = ", ".join((f"{self.values} values, {self.lost} lost", *counted))
        marked = (
            "" if isinf(self.mark_uncertainty) else f", aligned by pulses to +-{1e6 * self.mark_uncertainty:.0f} us"
        )
        return f"{self.sensor}: clock {rate:+.1f} ppm, rms residual {residual:.0f} us{marked}, {given}"


class OperatorTask(StrEnum):
    """An operator's task on the bench between two tests. Some tasks have an amount, in SI units."""

    MOUNT_SPRING = "mount spring"
    """Block and spring are mounted, and the block is free to rock; the amount is the stiffness on the spring's label
    [N/m].
    """
    REMOVE_BLOCK = "remove block"
    STAND_BLOCK_UP = "stand block up"
    LOCK_FRAME = "lock frame"
    """Spring and block are removed, and the storeys are clamped to the table, so that the storeys move with it."""
    UNLOCK_FRAME = "unlock frame"
    HOLD_BLOCK = "hold block"
    """Same as MOUNT_SPRING, but the block is clamped to the table: it cannot lift, and its end of the spring does not
    move relative to the table.
    """
    LOCK_TABLE = "lock table"
    """The table, with any specimen, is clamped to the ground at mid stroke; it must not be driven."""
    UNLOCK_TABLE = "unlock table"
    WATCH_BLOCK = "watch block"
    """The block stands alone, without spring, and the laser of storey 2 points horizontally at the block's face on the
    frame's side; the amount is the height of the beam above the table [m] (see `sim.block_face`). No spring can be
    mounted in this state. If the block is then removed, the laser has no target."""
    WATCH_STOREYS = "watch storeys"
    """The laser of storey 2 is aimed at its storey again."""
    TILT_BLOCK = "tilt block"
    """The stand-alone block is held tilted by the amount [rad], positive with its top towards the frame, and
    released without a push a few seconds after the rig is armed; required before each test."""
    PULL_FRAME = "pull frame"
    """Storey 2 is held displaced by the amount [m] and released without a push a few seconds after the rig is armed;
    required before each test."""


class Rig(Protocol):
    """A bench that can be driven and read. Every backend must pass `bench.testing.conformance`."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The input channels, in the order of the columns of a block."""
        ...

    @property
    def sample_rate(self) -> float:
        """Sample rate of each input and of the drive, as read back from the device [1/s]."""
        ...

    @property
    def drive_range(self) -> float:
        """Largest magnitude of the drive [V]."""
        ...

    @property
    def lead(self) -> int:
        """Number of drive samples that must be queued beyond the block being read: the output latency."""
        ...

    @property
    def clock(self) -> Clock:
        """The clock that paces this rig."""
        ...

    @property
    def description(self) -> dict[str, str]:
        """Names, models and identities of the devices, for the data file."""
        ...

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        """Clock alignments, since `arm()`, of the sensors that have their own clocks; usually none."""
        ...

    def raw_values(self) -> tuple[RawValues, ...]:
        """Values received from sensors with their own clocks since the last call, or since `arm()`; usually none.

        They remain available after `stop()` and a failure. A backend of another package may lack this method.
        """
        ...

    def interlocks(self) -> Mapping[str, bool]:
        """States of the wired safety inputs by name; True if closed (good)."""
        ...

    def arm(self) -> None:
        """Close the enable line with the output at zero. Sample 0 is acquired now, or with the first block read."""
        ...

    def write(self, volts: NDArray[np.float64]) -> None:
        """Append drive samples, shape (n,) [V]. Raises RigError if the rig is not armed, or if a sample is not finite
        or out of range.
        """
        ...

    def read(self, n: int) -> Block:
        """Wait for the next `n` samples of all inputs and return them.

        Raises DriveUnderflow, InputOverflow, DeviceTimeout or ConnectionLost, after which the rig is stopped, and
        RigError if the rig is not armed.
        """
        ...

    def stop(self) -> None:
        """Stop the sample clock and leave the output at zero. Allowed in every state, and repeatedly."""
        ...

    def halt(self) -> None:
        """Cut the enable line now, then set the output to zero. Allowed in every state, and repeatedly.

        The only method that may be called while another one runs: from another thread while `read` waits, and from a
        signal handler during any call. It must therefore not wait for locks held by other calls. The interrupted call
        raises RigError; `read` does so when its block is due, at the latest.
        """
        ...

    def close(self) -> None:
        """Stop the rig and release every device; may be called repeatedly."""
        ...

    def perform(self, work: OperatorTask, amount: float | None = None) -> None:
        """Register that the operator's task `work`, with its `amount` if any, was carried out on the stopped rig.

        A simulated rig carries out the task on its specimen; a real one does nothing. Raises RigError if armed.
        """
        ...
