"""The steps a plan is made of. A plan is a generator: it yields steps and is sent what came of them.

A step says what the bench does, not how; the same plan can be run, summarised or timed without a device.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle
from bench.control.calibration import DriveCalibration
from bench.control.legs import Leg
from bench.events import Event
from bench.guard.violation import Violation
from drivers.rig import Channel, Counts, Handwork
from sim.specimen import Specimen


@dataclass(frozen=True)
class Handle:
    """A person does something at the resting bench; `request` says what and why. Comes to nothing.

    `specimen` is what stands on the table afterwards. `amount` goes with the work, see `drivers.rig.Handwork`; absent:
    what the label of the specimen's spring says, if it has one [N/m].
    """

    work: Handwork
    specimen: Specimen
    request: str
    amount: float | None = None


@dataclass(frozen=True)
class Arm:
    """Arm the rig with the output at zero, wait until the storeys are still, and take the zero of every signal.

    Still: over `rest` seconds neither u1 nor the drift scatters by more than `still` [m]. After `patience` seconds the
    zero is taken all the same, with a warning.
    """

    rest: float
    still: float = 1e-4
    patience: float = 240.0


@dataclass(frozen=True)
class Listen:
    """Take samples for `duration` seconds with the output at zero, on a rig that is not armed. Comes to `Heard`."""

    duration: float


@dataclass(frozen=True)
class Calibrate:
    """From now on the drive is divided by this gain."""

    calibration: DriveCalibration


@dataclass(frozen=True)
class Follow:
    """Drive along legs, from where the drive is. Comes to `Fallen` as soon as the block has fallen, else to `Done`."""

    legs: tuple[Leg, ...]


@dataclass(frozen=True)
class Dwell:
    """Hold amplitude and frequency for `cycles` whole cycles. Comes to `Measured`, or to `Fallen`."""

    cycles: int


@dataclass(frozen=True)
class Trim:
    """Go to `shares`, over one cycle: complex, of the asked amplitude, for the fundamental, the second harmonic and so
    on, as `bench.control.oscillator` plays them. A `Follow` gives them up again.
    """

    shares: tuple[complex, ...]


Watch = Callable[[NDArray[np.float64]], Event | None]
"""Is shown the signals of each block while a drive is played, shape (n, n_signals); what it returns is published."""


@dataclass(frozen=True, eq=False)
class Play:
    """Play prepared `volts`, shape (n,), one per sample, from a drive at zero to a drive at zero, on an armed rig.

    `watch` is shown every block of signals while it is played, counted from the first sample of `volts`. Comes to
    `Played`, or to `Fallen` as soon as the block has fallen: the drive runs on until the plan ramps it out.
    """

    volts: NDArray[np.float64]
    watch: Watch | None = None


@dataclass(frozen=True)
class RampOut:
    """End the test: smooth ramp to zero, or the fast one; the rig is stopped afterwards.

    Comes to `Fallen` when the block fell on the way, else to `Done`.
    """

    fast: bool = False


@dataclass(frozen=True)
class Say:
    """Publish an event; its time is set by the engine."""

    event: Event


Step = Handle | Arm | Listen | Calibrate | Follow | Dwell | Trim | Play | RampOut | Say


@dataclass(frozen=True)
class Done:
    """The step was carried out."""


@dataclass(frozen=True, eq=False)
class Fallen:
    """The block has fallen; the drive still runs until the plan ramps it out.

    Of a `Play`: `signals`, shape (n, n_signals), are those until then, as `Played` has them.
    """

    signals: NDArray[np.float64] | None = None


@dataclass(frozen=True, eq=False)
class Played:
    """What a played drive did: `signals`, shape (n, n_signals), as `bench.analysis.signals` numbers them, and the drive
    [V] that really went out, shape (n,). Row i was taken while sample i of the volts was played; n is their number.

    Values that a sensor did not give are NaN.
    """

    signals: NDArray[np.float64]
    drive: NDArray[np.float64]


@dataclass(frozen=True)
class Measured:
    """The cycles of a dwell, in order; fewer than asked where samples were missing."""

    cycles: tuple[Cycle, ...]


@dataclass(frozen=True)
class Heard:
    """What all inputs gave with the output at zero: counts of shape (n, n_channels).

    `violation` is what the guard found wrong, if it did: the listening ended there, and with it nothing else.
    """

    channels: tuple[Channel, ...]
    counts: Counts
    violation: Violation | None


Outcome = Done | Fallen | Measured | Played | Heard
Plan = Generator[Step, Outcome, object]
"""Steps in order; what it returns is kept by the engine."""
