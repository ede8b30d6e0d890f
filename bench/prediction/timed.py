"""Gains by another solver: from long runs that begin on the exact orbit, to compare solvers by what they are for."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import nan, tau

from bench.comparators.catalogue import steady_gain_by_time
from bench.prediction.requests import SineRequest
from sim.gain import GainPrediction
from sim.rocking import Status
from sim.specimen import Specimen
from sim.sweep import Done, sweep

DURATION = 120.0
"""Length of a run [s]: that of the paper."""


@dataclass(frozen=True)
class Timed:
    """What a run came to; its gains and peaks are NaN when it ended early. `impacts_per_period`: their mean number."""

    alpha_1: float
    alpha_2: float
    u1: float
    drift: float
    theta: float
    impacts_per_period: float
    status: str

    def as_row(self) -> dict[str, float | str | bool | None]:
        """The columns of the table of steady motions that the run decides."""
        return {
            "alpha_1": self.alpha_1,
            "alpha_2": self.alpha_2,
            "u1_max_m": self.u1,
            "drift_max_m": self.drift,
            "theta_max_rad": self.theta,
            "impacts_per_period": self.impacts_per_period,
            "status": self.status,
        }


def timed_gains(
    specimen: Specimen,
    request: SineRequest,
    predictions: Sequence[GainPrediction],
    scheduler: str | None = None,
    done: Done | None = None,
) -> list[Timed | None]:
    """A run by the request's solver for each prediction, on all processors; None where there is no rocking orbit.

    Raises InvalidInput for a tolerance that the solver refuses.
    """
    return sweep(partial(_timed, specimen, request.solver, request.tolerance), predictions, scheduler, done=done)


def _timed(specimen: Specimen, solver: str, tolerance: float | None, prediction: GainPrediction) -> Timed | None:
    if prediction.rocking is None:
        return None
    orbit = prediction.rocking.orbit
    run = steady_gain_by_time(
        solver,
        specimen.coupled(prediction.beta),
        prediction.omega,
        prediction.amplitude,
        DURATION,
        state=orbit.start,
        phase=orbit.phase,
        tolerance=tolerance,
    )
    motion = run.motion
    if motion.status is not Status.COMPLETED:
        return Timed(nan, nan, nan, nan, nan, nan, f"{motion.status} at {motion.end_time:.2f} s")
    impacts = motion.impacts / (DURATION * prediction.omega / tau)
    peaks = motion.peaks
    return Timed(run.alpha_1, run.alpha_2, peaks.u1, peaks.drift, peaks.theta, impacts, str(motion.status))
