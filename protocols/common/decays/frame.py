"""Combination of decays: the eight quantities `response.NAMES` and the slopes of the damping, with all covariances."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.covariance import COMMON
from bench.analysis.free_decay.damping import DampingCourse
from bench.analysis.free_decay.decay import Combined, Decay, combine
from bench.analysis.free_decay.response import K1, K2, NAMES, XI1, XI2
from bench.analysis.gain import COVERAGE
from bench.analysis.uncertainty import plus_minus
from protocols.common.decays.parameters import DecayPoint

Array = NDArray[np.float64]

SIGNIFICANT = 2.576
"""Threshold of a significant slope or difference, in standard uncertainties: two-sided normal quantile for 99 %."""


@dataclass(frozen=True, eq=False)
class FrameResult:
    """Result of one or several decays.

    `frame` contains the eight combined quantities, `slopes` the combined changes of the damping ratios with amplitude
    [1/m]. `masses` [kg] are those of the storeys; `masses_covariance` [kg2], shape (2, 2), is their covariance.
    `mass_shift`, shape (8, 2), is the sensitivity of the quantities to the masses; `time_shift`, shape (8,), is their
    sensitivity to the timebase, multiplied by the timebase's standard uncertainty. `parts` holds the standard
    uncertainties of the quantities, shape (8,), by contribution.
    """

    decays: tuple[Decay, ...]
    frame: Combined
    slopes: Combined
    masses: tuple[float, float]
    masses_covariance: Array
    mass_shift: Array
    time_shift: Array
    parts: dict[str, Array]

    @property
    def shared_shift(self) -> Array:
        """Sensitivity of the quantities to the masses and the timebase, whose errors all frames of a run share, shape
        (8, 3).
        """
        return np.column_stack((self.mass_shift, self.time_shift))

    @property
    def shared(self) -> Array:
        """Covariance of both masses [kg2] and of the timebase in units of its standard uncertainty, shape (3, 3)."""
        whole = np.eye(3)
        whole[:2, :2] = self.masses_covariance
        return whole

    @property
    def uncertainty(self) -> Array:
        """Standard uncertainties of the quantities, shape (8,)."""
        return np.sqrt(np.diag(self.frame.covariance))

    @property
    def slope_uncertainty(self) -> Array:
        """Standard uncertainties of the slopes [1/m], shape (2,)."""
        return np.sqrt(np.diag(self.slopes.covariance))

    @property
    def nonlinear(self) -> NDArray[np.bool_]:
        """Whether each slope is significant, shape (2,)."""
        return np.abs(self.slopes.values) > SIGNIFICANT * self.slope_uncertainty


def frame_result(decays: Sequence[Decay], masses: tuple[float, float], masses_covariance: Array) -> FrameResult:
    """Combined result of the decays of one frame with the storey masses `masses` [kg]."""
    frame = combine(
        [one.quantities for one in decays],
        [one.uncertainty.own for one in decays],
        [one.uncertainty.common for one in decays],
    )
    slopes = combine(
        [np.array([course.slope for course in one.courses]) for one in decays],
        [np.diag([course.own for course in one.courses]) for one in decays],
        [np.diag([course.common for course in one.courses]) for one in decays],
    )
    names = decays[0].uncertainty.parts
    parts = {name: _part(name, decays, frame) for name in names} | {"scatter": frame.scatter}
    shift = np.mean([one.uncertainty.mass_shift for one in decays], axis=0)
    late = np.mean([one.uncertainty.time_shift for one in decays], axis=0)
    return FrameResult(tuple(decays), frame, slopes, masses, masses_covariance, shift, late, parts)


def decay_point(result: FrameResult, number: int) -> DecayPoint:
    """The result as a point; `number` is 0 for the combination of all decays."""
    names = dict(zip(NAMES, _FIELDS, strict=True))
    values = {
        name: value
        for index, (field, expanded) in enumerate(names.values())
        for name, value in (
            (field, float(result.frame.values[index])),
            (expanded, COVERAGE * float(result.uncertainty[index])),
        )
    }
    birge = result.frame.birge
    squares = [float(np.mean(one.fit.residual**2)) for one in result.decays]
    slopes, expanded = result.slopes.values, COVERAGE * result.slope_uncertainty
    return DecayPoint(
        decay=number,
        decays=len(result.decays),
        **values,
        drift_peak_m=max(one.peak for one in result.decays),
        residual_m=float(np.sqrt(np.mean(squares))),
        birge=None if np.isnan(birge).any() else float(birge.max()),
        slope1_per_m=float(slopes[0]),
        slope1_uncertainty=float(expanded[0]),
        slope2_per_m=float(slopes[1]),
        slope2_uncertainty=float(expanded[1]),
        damping_is_linear=not bool(result.nonlinear.any()),
        k1_parts=_parts_json(result, K1),
        k2_parts=_parts_json(result, K2),
        xi1_parts=_parts_json(result, XI1),
        xi2_parts=_parts_json(result, XI2),
        damping1_course=_course_json(result.decays[0].courses[0]) if number else "",
        damping2_course=_course_json(result.decays[0].courses[1]) if number else "",
    )


def parts_as_json(parts: Mapping[str, float]) -> str:
    """Standard uncertainties by contribution, largest first, as JSON."""
    return json.dumps({name: _short(part) for name, part in sorted(parts.items(), key=lambda each: -each[1])})


def _parts_json(result: FrameResult, index: int) -> str:
    return parts_as_json({name: float(part[index]) for name, part in result.parts.items()})


def _course_json(course: DampingCourse) -> str:
    rows = (course.amplitude, course.damping, course.uncertainty)
    return json.dumps([[_short(value) for value in row.tolist()] for row in rows])


def _short(value: float) -> float:
    """The value rounded to five significant digits, for strings in a data file."""
    return float(f"{value:.5g}")


_FIELDS = (
    ("k1_n_m", "k1_uncertainty"),
    ("k2_n_m", "k2_uncertainty"),
    ("xi1", "xi1_uncertainty"),
    ("xi2", "xi2_uncertainty"),
    ("c1_n_s_m", "c1_uncertainty"),
    ("c2_n_s_m", "c2_uncertainty"),
    ("omega1_rad_s", "omega1_uncertainty"),
    ("omega2_rad_s", "omega2_uncertainty"),
)


def _part(name: str, decays: Sequence[Decay], frame: Combined) -> Array:
    """Standard uncertainties due to one contribution, shape (8,); it averages out unless common to all decays."""
    variances = np.array([np.diag(one.uncertainty.parts[name]) for one in decays])
    return np.sqrt(np.mean(variances, axis=0) if name in COMMON else np.sum(frame.weights**2 * variances, axis=0))


def nonlinear_text(result: FrameResult) -> str:
    """Warning that the damping depends on the amplitude, with the significant slopes."""
    slopes = [
        f"xi{mode + 1} changes by {plus_minus(slope, COVERAGE * uncertainty)} (k = 2) per metre of drift"
        for mode, (slope, uncertainty) in enumerate(zip(result.slopes.values, result.slope_uncertainty, strict=True))
        if result.nonlinear[mode]
    ]
    return f"the damping depends on the amplitude: {', '.join(slopes)}; the stated ratios are means over the decays"
