"""A calibration of the lasers, for tests."""

from datetime import UTC, datetime

from bench.analysis.laser_calibration import LaserCalibration, LaserCurve


def calibration(
    lowest: float, highest: float, rest: float = 0.0, *, uncertainty: float = 1e-5, common_linearity: float = 3e-5
) -> LaserCalibration:
    """Both lasers with this standard uncertainty between two readings, and this error of the reference [m]."""
    curve = LaserCurve(
        sensor="ILD1420",
        lowest=lowest,
        highest=highest,
        rest=rest,
        error=(0.0, 1e-4),
        uncertainty=uncertainty,
        scale=1.0,
        delay=0.0,
        delay_uncertainty=0.0,
    )
    return LaserCalibration(
        date=datetime(2026, 1, 1, tzinfo=UTC),
        valid_days=90.0,
        laser_1=curve,
        laser_2=curve,
        differential_scale=1.0,
        differential_uncertainty=1e-4,
        common_linearity=common_linearity,
        table_displacement=1.0,
        table_acceleration=1.0,
        table_uncertainty=1e-3,
    )
