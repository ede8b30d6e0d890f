"""Validated input that is common to all solvers."""

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.errors import InvalidInput
from sim.excitation import Excitation
from sim.rocking import TOLERANCE, Drive, State, check_options, check_state, checked_times
from sim.specimen import Specimen


@dataclass(frozen=True, eq=False)
class Problem:
    """An initial value problem ready for a solver.

    parameters : result of `Specimen.packed()`, shape (16,).
    segments : packed excitation, shape (n, 10).
    start : initial state, shape (6,).
    times : times of the samples, shape (m,) [s].
    sampled : whether samples are requested.
    peaks_from : time from which peaks are determined [s]; infinite if no peaks are requested.
    overturning_angle : tilt at which the block counts as overturned [rad].
    """

    parameters: NDArray[np.float64]
    segments: NDArray[np.float64]
    start: NDArray[np.float64]
    times: NDArray[np.float64]
    sampled: bool
    peaks_from: float
    overturning_angle: float

    @property
    def watched(self) -> bool:
        """Whether peaks are requested."""
        return self.peaks_from < inf

    @staticmethod
    def checked(
        specimen: Specimen,
        excitation: Excitation,
        state: State | None,
        sample_times: ArrayLike | None,
        peaks_from: float | None,
        overturning_angle: float,
    ) -> "Problem":
        """The problem defined by the arguments of `sim.rocking.simulate`. Raises InvalidInput for the same errors as
        that function.
        """
        check_options(TOLERANCE, overturning_angle)
        drive, start = Drive(excitation), state or State()
        check_state(specimen, start, overturning_angle)
        if peaks_from is not None and not 0.0 <= peaks_from < drive.duration:
            raise InvalidInput("peaks_from", peaks_from, f"it must lie within the {drive.duration:g} s of the run")
        return Problem(
            parameters=specimen.packed(),
            segments=drive.segments,
            start=start.as_array(),
            times=checked_times(sample_times, drive.duration),
            sampled=sample_times is not None,
            peaks_from=inf if peaks_from is None else peaks_from,
            overturning_angle=overturning_angle,
        )
