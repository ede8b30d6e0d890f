"""A calibration of the lasers, for tests."""

from datetime import UTC, datetime

from bench.analysis.laser_calibration import LaserCalibration, LaserCurve


def calibration(lowest: float, highest: float, rest: float = 0.0) -> LaserCalibration:
    """Both lasers with a standard uncertainty of 10 um between two readings [m], and a reference error of 30 um."""
    curve = LaserCurve(
        sensor="ILD1420",
        lowest=lowest,
        highest=highest,
        rest=rest,
        error=(0.0, 1e-4),
        uncertainty=1e-5,
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
        common_linearity=3e-5,
        table_displacement=1.0,
        table_acceleration=1.0,
        table_uncertainty=1e-3,
    )
