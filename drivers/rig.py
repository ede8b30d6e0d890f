"""What every backend offers: channels, a drive output, blocks of samples, and a way to cut the output.

Sample `i` of the drive leaves the output while sample `i` of the inputs is taken: both are counted from
`arm()`. The drive is non-regenerating: each sample is written once and played once, and at least
`lead` samples must be waiting when a block is read.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
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
class Block:
    """Consecutive samples of all inputs: `counts` has shape (n_samples, n_channels).

    `first` is the index, since `arm()`, of the first sample: a reader sees a gap as a jump of it.
    """

    first: int
    counts: Counts

    def __len__(self) -> int:
        return int(self.counts.shape[0])


@dataclass(frozen=True)
class Alignment:
    """How the values of a sensor with a clock of its own were placed on the sample clock in one run.

    A value taken at second t of the sensor's clock stands at second `offset + rate * t + delay` of the sample clock.
    `residual` is the root mean square of what the fit leaves of the clock readings that bound it [s], `delay` the
    fixed delay that was configured [s], `values` how many the sensor gave and `lost` how many it should have given.
    """

    sensor: str = column("", "name of the channel")
    offset: float = column("s", "time of the run at which second 0 of the sensor's clock stands, without delay")
    rate: float = column("1", "seconds of the sample clock per second of the sensor's clock")
    residual: float = column("s", "root mean square of what the fit leaves of the readings of the clocks")
    delay: float = column("s", "fixed delay by which the values were placed later, as configured")
    values: int = column("1", "values that the sensor gave")
    lost: int = column("1", "values that it should have given and that did not arrive")

    def __str__(self) -> str:
        rate, residual = 1e6 * (self.rate - 1.0), 1e6 * self.residual
        given = f"{self.values} values, {self.lost} lost"
        return f"{self.sensor}: clock {rate:+.1f} ppm, readings within {residual:.0f} us, {given}"


class Handwork(StrEnum):
    """What a person does at the bench between two tests. Some of it comes with an amount, in SI units."""

    MOUNT_SPRING = "mount spring"
    """Block and spring are mounted, the block free to rock; the amount is what the spring's label says [N/m]."""
    REMOVE_BLOCK = "remove block"
    STAND_BLOCK_UP = "stand block up"
    LOCK_FRAME = "lock frame"
    """The storeys are clamped to the table and move with it, without spring and block."""
    UNLOCK_FRAME = "unlock frame"
    HOLD_BLOCK = "hold block"
    """As MOUNT_SPRING, with the block clamped to the table: it cannot lift, the spring is grounded on the table."""
    LOCK_TABLE = "lock table"
    """The table is clamped to the ground at mid stroke, whatever stands or will stand on it; it must not be driven."""
    UNLOCK_TABLE = "unlock table"
    WATCH_BLOCK = "watch block"
    """The block stands alone, without spring, and the laser of storey 2 looks horizontally at its face on the frame's
    side, at the height of the amount above the table [m]: see `sim.block_face`. No spring is mounted while it does; it
    has nothing to measure when the block is taken away."""
    WATCH_STOREYS = "watch storeys"
    """The laser of storey 2 looks at its storey again."""
    TILT_BLOCK = "tilt block"
    """The block that stands alone is held tilted by the amount [rad], above zero with its top towards the frame, and
    let go without a push a few seconds after the rig is armed; to be done again before each test."""
    PULL_FRAME = "pull frame"
    """Storey 2 is held aside by the amount [m] and let go without a push a few seconds after the rig is armed; to be
    done again before each test."""


class Rig(Protocol):
    """A bench that can be driven and read. Every backend passes `tests/drivers/conformance.py`."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The inputs, in the order of the columns of a block."""
        ...

    @property
    def sample_rate(self) -> float:
        """Samples per second and channel, for inputs and drive alike, as the device made it [1/s]."""
        ...

    @property
    def drive_range(self) -> float:
        """Largest magnitude of the drive [V]."""
        ...

    @property
    def lead(self) -> int:
        """How many drive samples must be waiting ahead of the sample that is read: the output latency."""
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
        """How sensors with clocks of their own were placed on the sample clock since `arm()`; mostly none."""
        ...

    def interlocks(self) -> Mapping[str, bool]:
        """The safety inputs that exist, by name, and whether each is good at this moment."""
        ...

    def arm(self) -> None:
        """Close the enable line with the output at zero; sample 0 is taken then, or when the first block is read."""
        ...

    def write(self, volts: NDArray[np.float64]) -> None:
        """Append drive samples, shape (n,) [V]. Raises RigError when not armed, not finite or out of range."""
        ...

    def read(self, n: int) -> Block:
        """The next `n` samples of all inputs; waits for them.

        Raises DriveUnderflow, InputOverflow, DeviceTimeout or ConnectionLost, and RigError when not armed; the rig is
        stopped then.
        """
        ...

    def stop(self) -> None:
        """End the sample clock with the output at zero. Allowed in every state, any number of times."""
        ...

    def halt(self) -> None:
        """Cut the enable line now, then put the output to zero. Allowed in every state, any number of times.

        The one method that may be called while another is at work: from another thread while `read` waits, and from
        a signal handler in the middle of any call, so it waits for no lock that a call may hold. A call that it
        interrupts raises RigError, a `read` at the latest when its block was due.
        """
        ...

    def close(self) -> None:
        """Stop, and release every device. Allowed any number of times."""
        ...

    def handwork(self, work: Handwork, amount: float | None = None) -> None:
        """Told that a person has done `work`, by `amount` where it has one, while the rig was stopped.

        A simulated rig does it to its specimen; a real one has nothing to do. Raises RigError when armed.
        """
        ...
