"""The fits as the data file and reports keep them: the motion with what is left, and every impact."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.findings import Findings
from bench.analysis.free_rocking.fit import NAMES, R
from bench.analysis.free_rocking.tilt import Tilt
from bench.events import FitFinished, FittedParameter, Series

Array = NDArray[np.float64]

_UNITS = dict(zip(NAMES, ("rad", "rad/s", "1", "1", "s", "m", "1/m", "1/m2"), strict=True))


def fits_of(tilt: Tilt, alone: Findings, uncertain: Array, number: int) -> Iterator[FitFinished]:
    """Two fits of tilt `number`: the exact motion over time, and the impacts in their order.

    `alone` is what this tilt alone comes to, `uncertain`, shape (8,), the standard uncertainties of the fit's values.
    """
    yield _motion(tilt, uncertain, number)
    yield _impacts(tilt, alone, number)


def _motion(tilt: Tilt, uncertain: Array, number: int) -> FitFinished:
    fit = tilt.fit
    r, u = float(fit.motion.restitution), float(uncertain[R])
    columns = {
        "time": Series(fit.times, "s", "since the recording began"),
        "measured": Series(fit.displacement, "m", "displacement of the block's face at the laser's height"),
        "fitted": Series(fit.fitted, "m", "the exact nonlinear motion"),
        "residual": Series(fit.residual, "m", "measured less fitted"),
    }
    parameters = {
        name: FittedParameter(float(value), float(doubt), _UNITS[name])
        for name, value, doubt in zip(NAMES, fit.values, uncertain, strict=True)
    }
    text = f"exact motion of tilt {number}: r = {r:.6f} +- {u:.1g} (k = 1) from {fit.impacts} impacts"
    return FitFinished(f"tilt {number}", text, columns, parameters)


def _impacts(tilt: Tilt, alone: Findings, number: int) -> FitFinished:
    relation, points = tilt.relation, tilt.points
    count = relation.each.size
    # the first impact has no turning point before it but the hand
    columns = {
        "time": Series(points.impacts[1 : count + 1], "s", "instant of the impact"),
        "restitution": Series(relation.each, "1", "r of this impact, from the largest angles before and after"),
        "restitution_uncertainty": Series(relation.each_uncertainty, "1", "its standard uncertainty by noise"),
        "speed": Series(relation.speed, "1", "angular velocity before, over that of a fall from the critical angle"),
        "angle_before": Series(relation.angles[:-1], "rad", "largest angle before"),
        "angle_after": Series(relation.angles[1:], "rad", "largest angle after"),
        "time_uncertainty": Series(points.impact_uncertainty[1 : count + 1], "s", "standard uncertainty by noise"),
    }
    text = f"impacts of tilt {number}: r = {relation.restitution:.5f} +- {alone.relation.uncertainty:.1g} (k = 1)"
    found = {"restitution": FittedParameter(relation.restitution, alone.relation.uncertainty, "1")}
    return FitFinished(f"impacts of tilt {number}", text, columns, found)
