"""The calibrated sensors as text for the terminal."""

from collections.abc import Sequence

from bench.report.columns import right_aligned
from protocols.laser_calibration.protocol import CalibratedSensor

_TITLES = ("sensor", "scale - 1", "U (k=2)", "covered", "order", "largest error", "left, U", "delay")
_UNITS = ("", "[%]", "[%]", "[mm]", "[1]", "[um]", "[um]", "[ms]")


def sensors_table(points: Sequence[CalibratedSensor]) -> str:
    """One row for each sensor; "-" stands where a value is absent."""
    if not points:
        return "Nothing was calibrated."
    return "\n".join(right_aligned(_TITLES, _UNITS, (_cells(point) for point in points)))


def _cells(point: CalibratedSensor) -> tuple[str, ...]:
    covered = "-"
    if point.lowest_m is not None and point.highest_m is not None:
        covered = f"{1e3 * point.lowest_m:.1f} .. {1e3 * point.highest_m:.1f}"
    return (
        point.sensor,
        f"{100.0 * (point.scale - 1.0):+.3f}",
        f"{100.0 * point.scale_uncertainty:.3f}",
        covered,
        "-" if point.order is None else f"{point.order}",
        _number(point.largest_error_m, 1e6),
        _number(point.residual_m, 1e6),
        _number(point.delay_s, 1e3),
    )


def _number(value: float | None, factor: float) -> str:
    return "-" if value is None else f"{factor * value:.3g}"
