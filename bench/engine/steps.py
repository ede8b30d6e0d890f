"""Steps of a plan and their outcomes.

A plan is a generator: it yields steps and receives their outcomes. The same plan can be run on a rig, or summarised and
timed without one.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import HARMONICS, Cycle
from bench.control.oscillator import DriveCalibration, Segment
from bench.events import Event
from bench.guard.limits import Violation
from drivers.rig import Alignment, Channel, Counts, OperatorTask
from sim.specimen import Specimen


@dataclass(frozen=True)
class OperatorAction:
    """Action, described by `request`, that the operator carries out on the bench at rest. Returns `Done`.

    `specimen` is the specimen on the table afterwards. The meaning of `amount` depends on the task (see
    `drivers.rig.OperatorTask`); the default is the nominal stiffness [N/m] of the specimen's spring, if it has one.
    """

    work: OperatorTask
    specimen: Specimen
    request: str
    amount: float | None = None


@dataclass(frozen=True)
class Arm:
    """Arm the rig with the output at zero, wait until the storeys are still, and tare the signals.

    The storeys are still when the standard deviations of u1 and the drift over `rest` seconds are at most `still` [m].
    After `patience` seconds the signals are tared regardless, with a warning.
    """

    rest: float
    still: float = 1e-4
    patience: float = 240.0


@dataclass(frozen=True)
class AcquireAtRest:
    """Acquire samples for `duration` seconds with the output at zero, on a rig that is not armed.

    Returns `RestSamples`.
    """

    duration: float


@dataclass(frozen=True)
class Calibrate:
    """Use this calibration of the drive from now on."""

    calibration: DriveCalibration


@dataclass(frozen=True)
class Sweep:
    """Sweep along `segments` from the current sine. Returns `Fallen` as soon as the block has fallen, else `Done`."""

    segments: tuple[Segment, ...]


@dataclass(frozen=True)
class Dwell:
    """Hold amplitude and frequency for `cycles` full cycles. Returns `Measured`, or `Fallen`.

    The count of cycles continues that of the previous dwell. If `phase` [rad] is given, the count restarts, and each
    cycle begins at this phase of the oscillator. `harmonics` is the number of fitted harmonics of a count that begins.
    """

    cycles: int
    phase: float | None = None
    harmonics: int = HARMONICS


@dataclass(frozen=True)
class SetHarmonics:
    """Change smoothly to `shares`: complex fractions of the set amplitude for the fundamental, second harmonic and so
    on, as in `bench.control.oscillator`. A `Sweep` resets them.

    The change lasts `blend` cycles. It begins at the start of cycle number `cycle` of the current count, or at once if
    `cycle` is None or that cycle has begun. Returns `Scheduled`.
    """

    shares: tuple[complex, ...]
    cycle: int | None = None
    blend: float = 1.0


Watch = Callable[[NDArray[np.float64]], Event | None]
"""Function of the signals of each block, shape (n, n_signals); the engine publishes the event that it returns."""


@dataclass(frozen=True, eq=False)
class Play:
    """Play the prepared `volts`, shape (n,), one value per sample, zero at both ends, on an armed rig at zero drive.

    `watch` receives every block of signals, from the first sample of `volts` on. Returns `Played`, or `Fallen` as soon
    as the block has fallen: the drive then continues until the plan ramps it out.
    """

    volts: NDArray[np.float64]
    watch: Watch | None = None


@dataclass(frozen=True)
class RampOut:
    """End the test: ramp to zero, smoothly or fast, then stop the rig.

    Returns `Fallen` if the block fell during the ramp, else `Done`.
    """

    fast: bool = False


@dataclass(frozen=True)
class Publish:
    """Publish an event. The engine sets its time."""

    event: Event


Step = OperatorAction | Arm | AcquireAtRest | Calibrate | Sweep | Dwell | SetHarmonics | Play | RampOut | Publish


@dataclass(frozen=True)
class Done:
    """Outcome of a completed step that has no other result."""


@dataclass(frozen=True)
class Scheduled:
    """Outcome of a `SetHarmonics`: its change begins `late` seconds after the start of the requested cycle; 0 if in
    time.
    """

    late: float


@dataclass(frozen=True, eq=False)
class Fallen:
    """The block has fallen; the drive continues until the plan ramps it out.

    For a `Play`, `signals`, shape (n, n_signals), are those acquired until then, as in `Played`.
    """

    signals: NDArray[np.float64] | None = None


@dataclass(frozen=True, eq=False)
class Played:
    """Result of a played drive of n samples: `signals`, shape (n, n_signals), in the order of `bench.analysis.signals`,
    and `drive` as sent [V], shape (n,). Row i was sampled while sample i of the drive was played.

    Missing values of a sensor are NaN.
    """

    signals: NDArray[np.float64]
    drive: NDArray[np.float64]


@dataclass(frozen=True)
class Measured:
    """Cycles of a dwell, in order; they are fewer than requested if samples were missing.

    `missing` is the channel and the invalid count of most missing samples of the dwell, or None.
    """

    cycles: tuple[Cycle, ...]
    missing: tuple[Channel, int] | None = None


@dataclass(frozen=True)
class RestSamples:
    """Counts of all inputs with the output at zero, shape (n, n_channels).

    `violation` is the exceeded limit that ended the acquisition, if any; the plan continues. `alignments` are those of
    the free-running sensors to the sample clock at the end of the acquisition.
    """

    channels: tuple[Channel, ...]
    counts: Counts
    violation: Violation | None
    alignments: tuple[Alignment, ...] = ()


Outcome = Done | Scheduled | Fallen | Measured | Played | RestSamples
Plan = Generator[Step, Outcome, object]
"""A plan: yields its steps in order; the engine keeps its return value."""
