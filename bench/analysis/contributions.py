"""Contributions to the uncertainty budgets: type of evaluation, origin, and the action that reduces each.

The types are those of the GUM (JCGM 100:2008, 4.2 and 4.3): A is evaluated from repeated observations, B from other
information, such as a data sheet or a calibration.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import hypot, sqrt
from typing import Literal

from bench.analysis.sensor_uncertainty import LINEARITY, SCALES, STEPS, TIMING


@dataclass(frozen=True)
class Source:
    """Type of evaluation of a contribution, the origin of its value, and the action (`measure`) that reduces it."""

    type: Literal["A", "B"]
    origin: str
    measure: str


_CALIBRATE = "calibrate the lasers (laser calibration test)"
_CALIBRATE_TABLE = (
    "calibrate the accelerometer (against the lasers: laser calibration test; in addition by a laboratory, with the "
    "stated standard uncertainty as analysis.table_scale)"
)
_FASTER = "increase the measuring rate of the lasers"
_FINER = "use a laser with a finer resolution or a shorter range"
_MASSES = "weigh the storeys with a better balance"
_DECAYS = "record more decays"
_CLOCK = "calibrate the sample clock against a reference"

SOURCES: Mapping[str, Source] = {
    LINEARITY: Source("B", "data sheet or calibration, constrained by the tests", _CALIBRATE),
    SCALES: Source("B", "assumed difference between the lasers' scales, or calibration", _CALIBRATE),
    TIMING: Source("B", "assumed wander of the delay: one measuring period", _FASTER),
    STEPS: Source("B", "resolution of the lasers; of calibrated ones, what a correction leaves", _FINER),
    "scatter of the cycles": Source("A", "measured cycles, with their correlation", "measure more cycles"),
    "remaining transient": Source("A", "decay fitted to the measured cycles", "wait longer before measuring"),
    "amplitude of the table": Source(
        "B", "scale of the accelerometer, times the predicted slope of the gain", _CALIBRATE_TABLE
    ),
    "noise of the peaks": Source("A", "residual of the signals around the peaks", "repeat the test"),
    "choice of the largest peak": Source("B", "linearity of the lasers at peaks of almost the same size", _CALIBRATE),
    "pairs that are not fitted": Source(
        "A", "change of the fit without its first cycles", "observe more cycles after the release"
    ),
    "noise of the table's motion": Source(
        "A", "simulations with the noise of the accelerometer at rest", "use an accelerometer with less noise"
    ),
    "scale of the table's sensors": Source("B", "simulations with the assumed scale error", _CALIBRATE_TABLE),
    "stiffness and damping of the frame": Source(
        "B", "assumed or identified specimen, in simulations", "identify the frame (free vibration test)"
    ),
    "stiffness of the spring": Source(
        "B", "assumed or identified specimen, in simulations", "measure the mounted spring (coupling stiffness test)"
    ),
    "restitution of the block": Source(
        "B", "assumed or identified specimen, in simulations", "measure the restitution (free rocking test)"
    ),
    "noise": Source("A", "spectrum of the residual", "use longer or larger motions"),
    "table": Source("A", "noise of the table's sensor at rest", "clamp the table, or use a sensor with less noise"),
    "clock": Source("B", "assumed wander of the delay: one measuring period", _FASTER),
    "timing": Source("B", "assumed wander of the delay: one measuring period", _FASTER),
    "linearity": Source("B", "data sheet or calibration", _CALIBRATE),
    "scale": Source("B", "assumed slope error of the laser, or calibration", _CALIBRATE),
    "scatter": Source("A", "scatter beyond the uncertainties of the repeats, with Student's t", "repeat the test"),
    "masses": Source("B", "weighing", _MASSES),
    "timebase": Source("B", "assumed error of the sample clock", _CLOCK),
    "decays with the spring": Source("A", "fit of the decays with the spring", _DECAYS),
    "bare frame": Source("A", "fit of the decays of the bare frame", _DECAYS),
}
"""Source of every contribution to the budgets, by name."""


@dataclass(frozen=True)
class Improvement:
    """Effect of the removal of the contribution `name`: `factor` is the remaining share of the expanded uncertainty,
    the root mean square of the shares of several budgets.
    """

    name: str
    factor: float


def largest_improvement(budgets: Iterable[Mapping[str, float]]) -> Improvement | None:
    """The contribution whose removal would reduce the expanded uncertainties most; None if there are no contributions.

    `budgets` are standard uncertainties by contribution. Each budget has the same weight, whatever its size.
    """
    variances: dict[str, float] = {}
    number = 0
    for budget in budgets:
        total = hypot(*budget.values())
        if total > 0.0:
            number += 1
            for name, part in budget.items():
                variances[name] = variances.get(name, 0.0) + (part / total) ** 2
    if not number:
        return None
    name = max(variances, key=lambda each: variances[each])
    return Improvement(name, sqrt(max(1.0 - variances[name] / number, 0.0)))
