"""Scales of lasers and table sensors from the error curves of a calibration.

The standard of length is the weighted mean (`protocols.laser_calibration.standards`) of the mean span of both lasers,
whose scale error over the passes follows from the linearity error on their data sheets, and of the span computed from
the accelerometer.
"""

from collections.abc import Sequence
from datetime import datetime
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from bench.analysis.laser_calibration import LaserCalibration, LaserCurve
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.uncertainty import COVERAGE
from bench.config.model import BenchConfiguration
from protocols.common.calibrate import Unmeasurable
from protocols.laser_calibration.curves import ErrorCurve, Pass, fit_curve
from protocols.laser_calibration.polynomial import jackknife, values
from protocols.laser_calibration.reference import ReferenceCurve, fit_reference
from protocols.laser_calibration.standards import IMPLAUSIBLE, standards

Array = NDArray[np.float64]


def calibrate(
    passes: Sequence[Pass],
    rests: tuple[float, float],
    devices: tuple[str, str],
    accuracy: SensorAccuracy,
    ranges: tuple[float, float],
    *,
    reference_linearity: float,
    valid_days: float,
    date: datetime,
) -> tuple[LaserCalibration, tuple[ErrorCurve, ErrorCurve], ReferenceCurve]:
    """Calibration of all sensors from the measured passes, the error curves of the lasers, and that of the table's
    displacement sensor, for which the passes are corrected.

    `rests` [m] are the readings of the lasers at rest; `accuracy` and `ranges` [m] are taken from their data sheets,
    `reference_linearity` [m] from that of the displacement sensor.

    Raises Unmeasurable if the lasers do not measure the same motion.
    """
    reference = fit_reference(passes, reference_linearity)
    passes = reference.corrected(passes)
    curves = fit_curve(passes, 0, rests[0]), fit_curve(passes, 1, rests[1])
    require_agreement(curves)
    found = calibration(
        passes,
        curves,
        rests,
        devices,
        accuracy,
        ranges,
        common_linearity=reference.remaining,
        valid_days=valid_days,
        date=date,
    )
    return found, curves, reference


def calibration(
    passes: Sequence[Pass],
    curves: tuple[ErrorCurve, ErrorCurve],
    rests: tuple[float, float],
    devices: tuple[str, str],
    accuracy: SensorAccuracy,
    ranges: tuple[float, float],
    *,
    common_linearity: float,
    valid_days: float,
    date: datetime,
) -> LaserCalibration:
    """Calibration of all sensors.

    `common_linearity` is the linearity error of the displacement sensor that is left in the passes [m]; `accuracy` and
    `ranges` [m] are taken from the lasers' data sheets.
    """
    slopes = [curve.slope for curve in curves]
    by_lasers = 1.0 / (1.0 - 0.5 * sum(slopes))
    ratios = np.array([each.ratio for each in passes])
    standard = standards(curves, accuracy, ranges)
    scatter = np.hypot(np.std(ratios, ddof=1) / sqrt(len(passes)), jackknife((curves[0].slopes + curves[1].slopes) / 2))
    corrected, uncertainty = standard.combined(by_lasers * float(ratios.mean()), float(scatter))
    # ratio of the true displacement to that measured by the table's sensor
    factor = by_lasers * corrected
    found = [
        LaserCurve(
            sensor=device,
            lowest=curve.low,
            highest=curve.high,
            rest=rest,
            error=tuple(_rescaled(curve, factor).tolist()),
            uncertainty=curve.uncertainty,
            scale=(1.0 - 0.5 * sum(slopes)) / (1.0 - slope),
            delay=curve.delay,
            delay_uncertainty=jackknife(curve.delays),
        )
        for curve, rest, device, slope in zip(curves, rests, devices, slopes, strict=True)
    ]
    span = min(curve.high - curve.low for curve in curves)
    # two lasers that disagree by more than they should leave half of the excess to their mean; since one of them must
    # have a fault that nobody has found, the accelerometer does not reduce it
    excess = 0.5 * sqrt(max((slopes[1] - slopes[0]) ** 2 - (COVERAGE * standard.apart) ** 2, 0.0))
    # an error due to missing orders at both ends, as large as at any reading
    bent = sqrt(2.0) * hypot(curves[0].residual, curves[1].residual) / span
    return LaserCalibration(
        date=date,
        valid_days=valid_days,
        laser_1=found[0],
        laser_2=found[1],
        differential_scale=found[1].scale / found[0].scale,
        differential_uncertainty=hypot(jackknife(curves[1].slopes - curves[0].slopes), bent),
        common_linearity=common_linearity,
        table_displacement=factor,
        table_acceleration=factor * float(ratios.mean()),
        table_uncertainty=hypot(uncertainty, excess, scatter),
    )


DISAGREE = 0.05
"""Largest relative difference between the spans of two lasers that measure the same motion; a larger one is no error of
scale.
"""


def require_agreement(curves: tuple[ErrorCurve, ErrorCurve]) -> None:
    """Raise Unmeasurable if the lasers do not measure the same motion."""
    first, second = (curve.slope for curve in curves)
    if not abs(second - first) <= DISAGREE:
        raise Unmeasurable(
            f"the spans of the two lasers differ by {100.0 * (second - first):+.1f} %, although both measure the "
            "motion of the table: check where they are aimed, their ranges, and the load resistors of analogue outputs"
        )


def disagreements(
    found: LaserCalibration,
    curves: tuple[ErrorCurve, ErrorCurve],
    reference: ReferenceCurve,
    configuration: BenchConfiguration,
) -> list[str]:
    """Remarks on sensors whose scales differ by more than `IMPLAUSIBLE` times the uncertainty of their difference, and
    on linearity errors that the data sheets do not allow.
    """
    standard = standards(curves, configuration.analysis, configuration.laser_ranges)
    lasers, remarks = curves[1].slope - curves[0].slope, list[str]()
    if abs(lasers) > (bound := IMPLAUSIBLE * standard.apart):
        remarks.append(
            f"the spans of the two lasers differ by {100.0 * lasers:+.2f} %, more than their data sheets allow "
            f"({100.0 * bound:.2f} %): check their ranges and the load resistors of analogue outputs; the uncertainty "
            "of the table's scale contains the difference"
        )
    for name, factor in (("displacement", found.table_displacement), ("acceleration", found.table_acceleration)):
        if not abs(factor - 1.0) <= standard.bound:
            remarks.append(
                f"the scale of the table's {name} differs by {100.0 * (factor - 1.0):+.2f} % from that of the lasers, "
                f"more than the data sheets allow ({100.0 * standard.bound:.2f} %): check its sensitivity in the "
                "configuration"
            )
    limits = [configuration.analysis.laser_linearity * whole for whole in configuration.laser_ranges]
    for number, (curve, limit) in enumerate(zip(curves, limits, strict=True), 1):
        # a curve within the limits differs from its straight line by less than twice the limit
        bent = float(np.abs(values(np.append([0.0, 0.0], curve.error[2:]))).max())
        if bent > (most := 2.0 * limit + found.common_linearity):
            remarks.append(
                f"the linearity error of laser_{number} is {1e6 * bent:.0f} um, more than the data sheets allow "
                f"({1e6 * most:.0f} um): check its range, its target and analysis.laser_linearity"
            )
    if not reference.plausible:
        remarks.append(
            "the linearity error of the table's displacement sensor, compared with the accelerometer, is "
            f"{1e6 * reference.largest:.0f} um, more than reference_linearity allows ({1e6 * reference.limit:.0f} um): "
            "check the sensor, and whether the table tilts as it moves, which an accelerometer measures as well"
        )
    return remarks


def _rescaled(curve: ErrorCurve, factor: float) -> Array:
    """Coefficients of the error relative to the true displacement, which is `factor` times the measured displacement:
    r - factor * (r - e).
    """
    error = factor * curve.error
    error[:2] += (1.0 - factor) * np.array([0.5 * (curve.high + curve.low), 0.5 * (curve.high - curve.low)])
    return error
