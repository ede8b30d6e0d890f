# pyright: reportUnknownMemberType=false
"""The results of a calibration: a point for each sensor, a table for the terminal, and a figure of the lasers' errors.

The figure shows the errors over the readings, the curves found without each pass, and the orders that were tried.
matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bench.analysis.budget import COVERAGE
from bench.analysis.laser_calibration import LaserCalibration
from bench.report.style import BLACK, BLUE, GREY, new_figure, set_grid
from bench.report.text_table import TextColumn, text_table
from protocols.laser_calibration.fit import ErrorCurve
from protocols.laser_calibration.protocol import CalibratedSensor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLUMNS = (
    TextColumn("sensor", words=True),
    TextColumn("scale - 1", "%"),
    TextColumn("U (k=2)", "%"),
    TextColumn("covered", "mm"),
    TextColumn("order", "1"),
    TextColumn("largest error", "um"),
    TextColumn("left, U", "um"),
    TextColumn("delay", "ms"),
)


def calibrated_sensors(found: LaserCalibration) -> Iterator[CalibratedSensor]:
    """A row for each sensor, and one for the lasers against each other."""
    for name, laser in (("laser_1", found.laser_1), ("laser_2", found.laser_2)):
        at = np.linspace(laser.lowest, laser.highest, 201)
        error = at - laser.corrected(at)
        yield CalibratedSensor(
            sensor=name,
            scale=laser.scale,
            scale_uncertainty=COVERAGE * found.differential_uncertainty,
            lowest_m=laser.lowest,
            highest_m=laser.highest,
            order=len(laser.error) - 1,
            largest_error_m=float(np.abs(error - error.mean()).max()),
            residual_m=COVERAGE * laser.uncertainty,
            delay_s=laser.delay,
            delay_uncertainty_s=COVERAGE * laser.delay_uncertainty,
        )
    yield CalibratedSensor(
        sensor="laser_2 / laser_1",
        scale=found.differential_scale,
        scale_uncertainty=COVERAGE * found.differential_uncertainty,
    )
    for name, factor in (
        ("table_displacement", found.table_displacement),
        ("table_acceleration", found.table_acceleration),
    ):
        uncertainty = COVERAGE * found.table_uncertainty / factor
        yield CalibratedSensor(sensor=name, scale=1.0 / factor, scale_uncertainty=uncertainty)


def sensors_table(points: Sequence[CalibratedSensor]) -> str:
    """One row for each sensor; "-" stands where a value is absent."""
    if not points:
        return "Nothing was calibrated."
    return text_table(_COLUMNS, map(_cells, points))


def errors_figure(curves: tuple[ErrorCurve, ErrorCurve] | None) -> "Figure":
    """Two panels for each laser; without curves they are empty."""
    figure = new_figure(9.0, 6.5)
    panels = figure.subplots(2, 2, width_ratios=(3, 1), squeeze=False)
    for number, (over, orders) in enumerate(panels, 1):
        over.set_title(f"laser {number}", loc="left", fontsize=10)
        over.set_xlabel("reading [mm]")
        over.set_ylabel("reading minus displacement [um]")
        orders.set_xlabel("order [1]")
        orders.set_ylabel("foretold wrongly [um]")
        set_grid(over)
        set_grid(orders)
        if curves is None:
            continue
        curve = curves[number - 1]
        at = np.linspace(-1.0, 1.0, curve.without.shape[1])
        reading = 1e3 * np.linspace(curve.low, curve.high, at.size)
        for each in curve.without:
            over.plot(reading, 1e6 * (each - each.mean()), color=GREY, linewidth=0.6)
        error = np.polynomial.chebyshev.chebval(at, curve.error)
        over.plot(reading, 1e6 * (error - error.mean()), color=BLUE)
        tried = np.arange(1, curve.scores.size + 1)
        orders.semilogy(tried, 1e6 * curve.scores, "o-", color=BLACK, markersize=4)
        orders.axvline(curve.error.size - 1, color=BLUE)
    return figure


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
