"""The frame as text for the terminal."""

from collections.abc import Sequence
from math import tau

from bench.analysis.rounding import plus_minus
from bench.report.columns import right_aligned
from protocols.common.decays.point import DecayPoint
from protocols.common.decays.results import FrameResult

_TITLES = ("decay", "k1", "k2", "xi1", "xi2", "f1", "f2", "drift", "residual", "xi1 over drift")
_UNITS = ("", "[N/m]", "[N/m]", "[%]", "[%]", "[Hz]", "[Hz]", "[mm]", "[um]", "[%/mm]")


def decays_table(points: Sequence[DecayPoint], result: FrameResult | None) -> str:
    """One row for each decay, the last for all of them, with expanded uncertainties (k = 2); then the correlations."""
    if not points:
        return "Nothing was identified."
    lines = right_aligned(_TITLES, _UNITS, (_cells(point) for point in points))
    return "\n".join([*lines, *(_notes(points[-1], result) if result is not None else ())])


def _cells(point: DecayPoint) -> tuple[str, ...]:
    return (
        str(point.decay) if point.decay else "all",
        plus_minus(point.k1_n_m, point.k1_uncertainty),
        plus_minus(point.k2_n_m, point.k2_uncertainty),
        plus_minus(100.0 * point.xi1, 100.0 * point.xi1_uncertainty),
        plus_minus(100.0 * point.xi2, 100.0 * point.xi2_uncertainty),
        plus_minus(point.omega1_rad_s / tau, point.omega1_uncertainty / tau),
        plus_minus(point.omega2_rad_s / tau, point.omega2_uncertainty / tau),
        f"{1e3 * point.drift_peak_m:.1f}",
        f"{1e6 * point.residual_m:.1f}",
        plus_minus(0.1 * point.slope1_per_m, 0.1 * point.slope1_uncertainty),
    )


def _notes(point: DecayPoint, result: FrameResult) -> list[str]:
    damping = (
        "The damping does not depend on the amplitude, as far as can be told."
        if point.damping_is_linear
        else "The damping depends on the amplitude: see the figure; what is stated is its mean over the decays."
    )
    # parts of one decay and of all, by the name of the largest
    largest = {
        name: max(result.parts, key=lambda part: float(result.parts[part][place]))
        for place, name in enumerate(("k1", "k2", "xi1", "xi2"))
    }
    most = ", ".join(f"{name}: {part}" for name, part in largest.items())
    birge = "" if point.birge is None else f" Birge ratio at most {point.birge:.2f}."
    return ["", f"+- is the expanded uncertainty, k = 2. Largest part of it: {most}.{birge}", damping]
