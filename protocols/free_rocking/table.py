"""Free rocking as text for the terminal."""

from collections.abc import Sequence
from math import degrees, log10

from bench.report.columns import right_aligned
from protocols.free_rocking.protocol import ALL, RockingPoint

_TITLES = ("", "tilt", "impacts", "r", "U (k=2)", "r / r_th", "U (k=2)", "r, amplitudes", "U (k=2)", "residual")
_UNITS = ("", "[deg]", "[1]", "[1]", "[1]", "[1]", "[1]", "[1]", "[1]", "[um]")


def rocking_table(points: Sequence[RockingPoint]) -> str:
    """One row for each tilt and one for all, and below what the motion says of the block."""
    if not points:
        return "No tilt could be used."
    lines = right_aligned(_TITLES, _UNITS, (_cells(point) for point in points))
    combined = next((point for point in points if point.part == ALL), None)
    return "\n".join(lines if combined is None else [*lines, "", *_of_all(combined)])


def _cells(point: RockingPoint) -> tuple[str, ...]:
    return (
        point.part,
        "" if point.tilt_rad is None else f"{degrees(point.tilt_rad):+.2f}",
        str(point.impacts),
        *_pair(point.r_exp, point.r_exp_uncertainty),
        *_pair(point.ratio, point.ratio_uncertainty),
        *_pair(point.r_amplitudes, point.r_amplitudes_uncertainty),
        f"{1e6 * point.residual_m:.1f}",
    )


def _of_all(point: RockingPoint) -> list[str]:
    trend, alpha = _pair(point.trend, point.trend_uncertainty), _pair(point.alpha_rad, point.alpha_uncertainty_rad)
    p = _pair(point.p_rad_s, point.p_uncertainty_rad_s)
    birge = "" if point.birge is None else f"; the tilts scatter {point.birge:.2f} times what is expected"
    by = f", by the {point.estimator}" if point.estimator else ""
    return [
        f"r_exp / r_th = {point.ratio:.6f} +- {point.ratio_uncertainty:.1g} (k = 2){by}, r_th = {point.r_th:.6f}"
        f"{birge}",
        f"change of r over the impacts' speeds: {trend[0]} +- {trend[1]}",
        f"alpha = {alpha[0]} +- {alpha[1]} rad, by the sides {point.alpha_sides_rad:.6f} rad",
        f"p = {p[0]} +- {p[1]} rad/s, by the sides {point.p_sides_rad_s:.5f} rad/s",
        *([f"see to: {point.remarks}"] if point.remarks else []),
    ]


def _pair(value: float, uncertainty: float) -> tuple[str, str]:
    """A value with as many digits as its uncertainty's two."""
    places = min(max(1 - int(log10(uncertainty) // 1), 0), 8) if uncertainty > 0.0 else 8
    return f"{value:.{places}f}", f"{uncertainty:.{places}f}"
