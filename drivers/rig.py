"""What every backend offers: channels, a drive output, blocks of samples, and a way to cut the output.

Sample `i` of the drive leaves the output while sample `i` of the inputs is taken: both are counted from
`arm()`. The drive is non-regenerating: each sample is written once and played once, and at least
`lead` samples must be waiting when a block is read.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from sim.channel import Channel as Channel
from sim.errors import RockbenchError


class RigError(RockbenchError):
    """The rig could not do what was asked; its output is at zero or on its way there."""


class DriveUnderflow(RigError):
    """The output ran out of samples: more were asked to be played than were written."""


@dataclass(frozen=True)
class Block:
    """Consecutive samples of all inputs: `counts` has shape (n_samples, n_channels).

    `first` is the index, since `arm()`, of the first sample: a reader sees a gap as a jump of it.
    """

    first: int
    counts: NDArray[np.int16]

    def __len__(self) -> int:
        return int(self.counts.shape[0])


class Handwork(StrEnum):
    """What a person does at the bench between two tests."""

    MOUNT_SPRING = "mount spring"
    REMOVE_BLOCK = "remove block"
    STAND_BLOCK_UP = "stand block up"


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

    def arm(self) -> None:
        """Close the enable line and start the sample clock at index 0, the output at zero."""
        ...

    def write(self, volts: NDArray[np.float64]) -> None:
        """Append drive samples, shape (n,) [V]. Raises RigError when not armed, not finite or out of range."""
        ...

    def read(self, n: int) -> Block:
        """The next `n` samples of all inputs; waits for them. Raises DriveUnderflow, or RigError when not armed."""
        ...

    def stop(self) -> None:
        """End the sample clock with the output at zero. Allowed in every state, any number of times."""
        ...

    def halt(self) -> None:
        """Cut the enable line now, then put the output to zero. Allowed in every state, any number of times."""
        ...

    def close(self) -> None:
        """Stop, and release every device. Allowed any number of times."""
        ...

    def handwork(self, work: Handwork, stiffness: float | None = None) -> None:
        """Told that a person has done `work` (with a spring of `stiffness` [N/m]) while the rig was stopped.

        A simulated rig does it to its specimen; a real one has nothing to do. Raises RigError when armed.
        """
        ...
