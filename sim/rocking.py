"""Motion of the specimen under a base acceleration: rest, rocking, impacts and overturning.

Front end to `sim.kernel.rocking` with named types and checks.
"""

from dataclasses import dataclass, fields
from enum import IntEnum, StrEnum
from math import ceil, isfinite, log, log10, nan, pi
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.errors import InvalidInput
from sim.excitation import ROW, Excitation
from sim.specimen import Specimen

TOLERANCE = 1e-10
"""Default relative tolerance of a step. The error over 120 s of steady rocking is of the same order."""

REST_ANGLE = 1e-12
"""Angle of a bounce [rad] below which the block comes to rest; also the bound of the resulting error of the angle."""

MOST_IMPACTS = 1_000_000
"""Number of impacts after which a run fails; decaying bounces of the default block have several hundred."""


SMALLEST_PART, LARGEST_PART = 8, 64
"""Smallest and largest number of runs per task: enough to fill the lanes, and few enough to balance the load."""


class Mode(IntEnum):
    """Contact mode of the block; the value is the sign sg in the equations."""

    REST = 0
    ROCK_A = 1
    ROCK_B = -1


class Status(StrEnum):
    """Status at the end of a run."""

    COMPLETED = "completed"
    OVERTURNED_A = "overturned about A"
    OVERTURNED_B = "overturned about B"
    FAILED = "failed"


@dataclass(frozen=True)
class State:
    """Displacements [m] and velocities [m/s] relative to the base, angle [rad] and angular velocity [rad/s].

    theta > 0 is a rotation about the left corner A, with the top moving towards the frame.
    """

    u1: float = 0.0
    u2: float = 0.0
    v1: float = 0.0
    v2: float = 0.0
    theta: float = 0.0
    omega: float = 0.0

    @property
    def mode(self) -> Mode:
        """Contact mode, from angle and angular velocity: with theta = 0 and omega > 0, the block starts to rock about
        A.
        """
        return Mode(int(np.sign(self.theta or self.omega)))

    def as_array(self) -> NDArray[np.float64]:
        """[u1, u2, v1, v2, theta, omega], shape (6,)."""
        return np.array([self.u1, self.u2, self.v1, self.v2, self.theta, self.omega], dtype=np.float64)

    @staticmethod
    def from_array(x: NDArray[np.float64]) -> "State":
        """State with the components `x`, shape (6,)."""
        return State(*(float(value) for value in x))


@dataclass(frozen=True)
class Peaks:
    """Greatest |u1| [m], |u2 - u1| [m] and |theta| [rad]; NaN where they were not requested."""

    u1: float
    drift: float
    theta: float


@dataclass(frozen=True, eq=False)
class Motion:
    """Result of a run.

    `end_time` [s] is the end of the run, or the time of overturning or failure if there was one. `samples` has shape
    (n, 6) and the columns of `State.as_array`, without rows after the end of the run; None if no samples were
    requested.
    """

    status: Status
    end_time: float
    end: State
    peaks: Peaks
    impacts: int
    steps: int
    samples: NDArray[np.float64] | None

    @property
    def overturned(self) -> Literal["A", "B"] | None:
        """Corner about which the block overturned, at `end_time`; None if it did not."""
        if self.status is Status.OVERTURNED_A:
            return "A"
        return "B" if self.status is Status.OVERTURNED_B else None


def simulate(
    specimen: Specimen,
    excitation: Excitation,
    *,
    state: State | None = None,
    sample_times: ArrayLike | None = None,
    peaks_from: float | None = 0.0,
    tolerance: float = TOLERANCE,
    overturning_angle: float = pi / 2,
) -> Motion:
    """Integrate the specimen from `state` (default: at rest) through the whole `excitation`.

    `sample_times` [s], shape (n,), are ascending. `peaks_from` [s] is the start of the window of the peaks; None
    requests no peaks. `overturning_angle` [rad] is the |theta| that ends the run. A run that overturns or fails is a
    result, not an error. Samples and peaks do not affect the motion, and take time only when requested.

    Raises InvalidInput, before anything is integrated, for values outside their ranges. Source: Eq. (8), (9), (A.1) and
    (A.3) of the paper; the condition for the block to come to rest is given in `sim.kernel.rocking.run`.
    """
    check_options(tolerance, overturning_angle)
    run = RockingRun(
        specimen, Drive(excitation), state or State(), sample_times, peaks_from, tolerance, overturning_angle
    )
    return run.motion()


def series_order(tolerance: float, segment: float) -> int:
    """Order of the Taylor series that reaches `tolerance` at minimum cost; `segment` is the typical segment length [s].

    Long segments need 1.6 orders per digit (measured). Under a record, most steps end at a sample, so that a lower
    order that just spans one interval is cheaper; the radius of convergence is about 0.27 s for the default specimen.
    The step control meets the tolerance with any order.
    """
    longest = ceil(-1.6 * log10(tolerance))
    covering = 3 + ceil(log(tolerance) / log(min(segment, 0.2) / 0.27))
    return max(6, min(longest, covering))


def check_options(tolerance: float, overturning_angle: float) -> None:
    """Raise InvalidInput for options outside their ranges."""
    if not 1e-15 <= tolerance <= 1e-3:
        raise InvalidInput("tolerance", tolerance, "it must be between 1e-15 and 1e-3")
    if not 0.0 < overturning_angle <= pi / 2:
        raise InvalidInput("overturning_angle", overturning_angle, "it must be above 0 and at most pi/2 rad")


def check_state(specimen: Specimen, state: State, overturning_angle: float) -> None:
    """Raise InvalidInput for an invalid initial state."""
    components = {each.name: getattr(state, each.name) for each in fields(state)}
    for name, value in components.items():
        if not isfinite(value):
            raise InvalidInput(name, value, "it must be finite at the start")
        if specimen.beta is None and name in ("theta", "omega") and value != 0.0:
            raise InvalidInput(name, value, "the bare frame has no block: it must be 0")
    if abs(state.theta) >= overturning_angle:
        raise InvalidInput("theta", state.theta, f"its magnitude must be below {overturning_angle:g} rad at the start")
    if specimen.beta and abs(state.u1) >= specimen.d:
        raise InvalidInput("u1", state.u1, f"the spring's length must be positive: |u1| below d = {specimen.d:g} m")


def motion_of(
    report: NDArray[np.float64], x: NDArray[np.float64], samples: NDArray[np.float64] | None, *, watched: bool
) -> Motion:
    """Result of a run, from the kernel's `report`, shape (8,), and the end state `x`, shape (6,); `watched` is True if
    peaks were requested.
    """
    from sim.kernel import steps as kernel

    names = {
        kernel.COMPLETED: Status.COMPLETED,
        kernel.OVERTURNED_A: Status.OVERTURNED_A,
        kernel.OVERTURNED_B: Status.OVERTURNED_B,
    }
    return Motion(
        status=names.get(int(report[kernel.STATUS]), Status.FAILED),
        end_time=float(report[kernel.END]),
        end=State.from_array(x),
        peaks=Peaks(*(float(peak) for peak in report[kernel.PEAKS :])) if watched else Peaks(nan, nan, nan),
        impacts=int(report[kernel.IMPACTS]),
        steps=int(report[kernel.STEPS]),
        samples=None if samples is None else samples[: int(report[kernel.SAMPLES])],
    )


class Drive:
    """Checked table of an excitation: its segments, its duration [s], and the typical length of a segment [s]."""

    def __init__(self, excitation: Excitation) -> None:
        segments = excitation.packed()
        if segments.ndim != 2 or segments.shape[0] < 1 or segments.shape[1] != ROW:
            raise InvalidInput("excitation", segments.shape, f"its table must have at least one row of {ROW} numbers")
        # a finite sum implies finite terms, and takes half as long as a check of each
        if not np.isfinite(segments.sum()) and not np.isfinite(segments).all():
            raise InvalidInput("excitation", "a number that is not finite", "all of its numbers must be finite")
        lengths = segments[:, 0]
        if not lengths.min() > 0.0:
            raise InvalidInput("excitation", float(lengths.min()), "every segment must have a positive duration")
        self.segments = segments
        self.duration = float(lengths.sum())
        self.typical = float(np.median(lengths[:: 1 + lengths.size // 50]))


@dataclass(frozen=True, eq=False)
class RockingRun:
    """Run whose arguments are checked on construction."""

    specimen: Specimen
    drive: Drive
    state: State
    sample_times: ArrayLike | None
    peaks_from: float | None
    tolerance: float
    overturning_angle: float
    rest_angle: float = REST_ANGLE

    def __post_init__(self) -> None:
        check_state(self.specimen, self.state, self.overturning_angle)
        duration = self.drive.duration
        if self.peaks_from is not None and not 0.0 <= self.peaks_from < duration:
            raise InvalidInput("peaks_from", self.peaks_from, f"it must be within the {duration:g} s of the run")

    @property
    def order(self) -> int:
        return series_order(self.tolerance, self.drive.typical)

    def motion(self) -> Motion:
        from sim.kernel import rocking as kernel

        times = checked_times(self.sample_times, self.drive.duration)
        x, samples = self.state.as_array(), np.empty((times.size, 6))
        report = np.empty(kernel.REPORT)
        kernel.run(
            self.specimen.packed(),
            self.drive.segments,
            x,
            times,
            samples,
            self.order,
            self.tolerance,
            np.inf,
            self.overturning_angle,
            self.rest_angle,
            np.inf if self.peaks_from is None else self.peaks_from,
            MOST_IMPACTS,
            report,
        )
        return motion_of(report, x, None if self.sample_times is None else samples, watched=self.peaks_from is not None)


def checked_times(sample_times: ArrayLike | None, duration: float) -> NDArray[np.float64]:
    times = np.ascontiguousarray([] if sample_times is None else sample_times, dtype=np.float64)
    if times.ndim != 1 or not np.isfinite(times).all() or (np.diff(times) < 0.0).any():
        raise InvalidInput("sample_times", times.shape, "they must be one-dimensional, finite and ascending [s]")
    if times.size and not (times[0] >= 0.0 and times[-1] <= duration * (1.0 + 1e-12)):
        raise InvalidInput("sample_times", (times[0], times[-1]), f"they must be within the {duration:g} s of the run")
    return np.clip(times, 0.0, duration)
