"""The springs as text for the terminal."""

from collections.abc import Sequence
from math import tau

from bench.analysis.rounding import plus_minus
from bench.report.columns import right_aligned
from protocols.coupling_stiffness.protocol import SpringPoint

_TITLES = ("spring", "decays", "k1 + kC", "kC", "nominal kC", "beta", "k2", "f1", "f2")
_UNITS = ("", "", "[N/m]", "[N/m]", "[N/m]", "[1]", "[N/m]", "[Hz]", "[Hz]")


def springs_table(points: Sequence[SpringPoint]) -> str:
    """The bare frame and every spring, all decays together, with expanded uncertainties (k = 2)."""
    together = [point for point in points if point.decay == 0]
    if not together:
        return "Nothing was identified."
    lines = right_aligned(_TITLES, _UNITS, (_cells(point) for point in together))
    return "\n".join([*lines, "", "+- is the expanded uncertainty, k = 2."])


def _cells(point: SpringPoint) -> tuple[str, ...]:
    return (
        "none" if point.beta is None else f"{point.beta:g}",
        str(point.decays),
        plus_minus(point.k1_with_spring_n_m, point.k1_with_spring_uncertainty),
        "" if point.k_c_n_m is None else plus_minus(point.k_c_n_m, point.k_c_uncertainty or 0.0),
        "" if point.k_c_nominal_n_m is None else f"{point.k_c_nominal_n_m:.2f}",
        "" if point.beta_mounted is None else plus_minus(point.beta_mounted, point.beta_uncertainty or 0.0),
        plus_minus(point.k2_n_m, point.k2_uncertainty),
        plus_minus(point.omega1_rad_s / tau, point.omega1_uncertainty / tau),
        plus_minus(point.omega2_rad_s / tau, point.omega2_uncertainty / tau),
    )
