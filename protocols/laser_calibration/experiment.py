# pyright: reportUnknownMemberType=false
"""Laser calibration: checks, forecast, and results as a table, a figure and a file for other runs."""

from collections.abc import Generator, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bench.analysis.laser_calibration import LaserCalibration
from bench.analysis.uncertainty import COVERAGE
from bench.config.model import BenchConfiguration
from bench.config.result_files import write_calibration
from bench.control.oscillator import Segment, program
from bench.datafile.tables import Column, Table
from bench.engine.steps import OperatorAction, Outcome, Publish, Step
from bench.events import PointFinished, Warned
from bench.figures.style import BLACK, BLUE, GREY, new_figure, set_grid, ticks_1_2_5, write_figure
from bench.figures.text_table import TextColumn, text_table
from bench.findings import FitFinished, FittedParameter, Series
from bench.preflight.demands import demands_of, load, response_of
from bench.preflight.margins import Forecast
from bench.preflight.motion import laser_demands
from bench.protocol import Plan, Prepared, Result, Sources
from drivers.rig import OperatorTask
from protocols.common.calibrate import STOREYS_CLAMPED
from protocols.laser_calibration.curves import ErrorCurve
from protocols.laser_calibration.plan import START, expected_duration, measure, planned_passes
from protocols.laser_calibration.polynomial import READINGS, values
from protocols.laser_calibration.protocol import CalibratedSensor, LaserCalibrationParameters
from protocols.laser_calibration.reference import ReferenceCurve
from protocols.laser_calibration.scales import disagreements
from sim.errors import InvalidInput, RockbenchError
from sim.parameters import Parameters

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARGIN = 1.05
"""Safety factor: this multiple of the requested amplitude must be within the limits."""

_COLUMNS = (
    TextColumn("sensor", words=True),
    TextColumn("scale - 1", "%"),
    TextColumn("U (k=2)", "%"),
    TextColumn("covered", "mm"),
    TextColumn("order", "1"),
    TextColumn("largest error", "um"),
    TextColumn("U (k=2)", "um"),
    TextColumn("delay", "ms"),
)

_CLAMP = (
    "Remove the spring and the block, and clamp both storeys to the table. Keep clear: the amplifier will be enabled."
)
_UNCLAMP = "Remove the clamps from the storeys."


class LaserCalibrationRun(Prepared[LaserCalibrationParameters]):
    """Laser calibration. Raises InvalidInput for lasers mounted on the table, a configuration that already includes a
    calibration, and motions beyond the limits.
    """

    def __init__(
        self, parameters: LaserCalibrationParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._found: LaserCalibration | None = None
        self._curves: tuple[ErrorCurve, ErrorCurve] | None = None
        self._reference: ReferenceCurve | None = None
        self._clamped = False
        p, limits = self.parameters, configuration.limits
        if configuration.laser_reference != "ground":
            raise InvalidInput(
                "lasers.reference",
                "table",
                "lasers on the table do not measure its motion: mount both on the ground, and set this key to ground",
            )
        if configuration.calibrated is not None:
            raise InvalidInput(
                "laser_calibration",
                f"{configuration.calibrated.date:%Y-%m-%d}",
                "an existing calibration would affect the new one: remove it from the configuration",
            )
        reach = min(configuration.half_stroke, limits.displacement)
        reach = min(reach, limits.laser_range * min(configuration.laser_half_ranges))
        if MARGIN * p.amplitude > reach:
            raise InvalidInput("amplitude", p.amplitude, f"the bench allows at most {reach / MARGIN:.4g} m")
        for quantity, unit, value in (
            ("velocity", "m/s", p.amplitude * p.omega),
            ("acceleration", "m/s2", p.amplitude * p.omega**2),
        ):
            most = float(getattr(limits, quantity))
            if MARGIN * value > most:
                needs = (
                    f"at this frequency, an amplitude of {p.amplitude:g} m needs {value:.3g} {unit}, but"
                    f" limits.{quantity} = {most:g} {unit}"
                )
                raise InvalidInput("omega", p.omega, needs)

    @cached_property
    def forecast(self) -> Forecast:
        """Demands of the largest pass, a sine of the table with the clamped storeys as a rigid load."""
        self.progress("predicting the demands of the run")
        amplitude, omega = self.parameters.amplitude, self.parameters.omega
        duration = expected_duration(self.parameters)
        level = amplitude * omega**2
        asked = load(
            program((Segment(START, level, omega), Segment(duration, level, omega))),
            START,
            duration,
            payload=self.configuration.known_specimen.bare().mass,
            shaker=self.configuration.shaker_model,
            response=response_of(self.configuration),
            heating_time=self.configuration.limits.heating_time,
        )
        asked |= laser_demands(amplitude, amplitude, 0.0, self.configuration.laser_half_ranges)
        where = f"pass with an amplitude of {1e3 * amplitude:.1f} mm"
        return Forecast(demands=demands_of(asked, where, self.configuration), duration=duration)

    @cached_property
    def prediction(self) -> Table:
        """Circular frequencies and amplitudes of the planned passes."""
        omega, amplitude = np.array(planned_passes(self.parameters)).T
        return {
            "omega": Column(omega, "rad/s", "circular frequency of each pass"),
            "amplitude": Column(amplitude, "m", "amplitude of the table in the pass"),
        }

    def plan(self) -> Plan:
        self._found = self._curves = self._reference = None
        self._clamped = False
        return self.collected(self._steps())

    def _steps(self) -> Generator[Step, Outcome, None]:
        """Steps: clamp the storeys to the table, measure, publish, remove the clamps. Raises the error of a measurement
        that fails, after the clamps are removed.
        """
        bare = self.configuration.known_specimen.bare()
        yield OperatorAction(OperatorTask.LOCK_FRAME, bare, _CLAMP)
        self._clamped = True
        try:
            found, curves, reference = yield from measure(self.parameters, self.configuration)
        except RockbenchError:
            yield OperatorAction(OperatorTask.UNLOCK_FRAME, bare, _UNCLAMP)
            self._clamped = False
            raise
        for remark in disagreements(found, curves, reference, self.configuration):
            yield Publish(Warned(remark))
        self._found, self._curves, self._reference = found, curves, reference
        for number, (curve, laser) in enumerate(zip(curves, found.lasers, strict=True), 1):
            yield Publish(_fit_event(f"laser_{number}", curve, laser.delay, laser.delay_uncertainty))
        for point in _calibrated_sensors(found, reference):
            yield Publish(PointFinished(point))
        yield OperatorAction(OperatorTask.UNLOCK_FRAME, bare, _UNCLAMP)
        self._clamped = False

    def result(self, points: Sequence[Parameters]) -> Result:
        found, curves, reference = self._found, self._curves, self._reference

        def write(path: Path) -> None:
            if found is not None:
                write_calibration(path, found)

        text = _sensors_table([point for point in points if isinstance(point, CalibratedSensor)])
        return Result(
            points=tuple(points),
            text=f"{text}\n{STOREYS_CLAMPED}" if self._clamped else text,
            figures={"laser_errors.png": lambda path: write_figure(path, _errors_figure(curves, reference))},
            files={} if found is None else {"laser_calibration.json": write},
        )


def _fit_event(name: str, curve: ErrorCurve, delay: float, uncertainty: float) -> FitFinished:
    at, fit = np.linspace(curve.low, curve.high, READINGS), values(curve.error)
    passes = {
        f"without_{number}": Series(each - each.mean(), "m", f"curve fitted without pass {number}")
        for number, each in enumerate(curve.without, 1)
    }
    return FitFinished(
        f"error of {name}",
        f"{name}: order {curve.error.size - 1}, standard uncertainty {1e6 * curve.uncertainty:.1f} um at one reading",
        {
            "reading": Series(at, "m", "reading relative to mid range"),
            "error": Series(fit - fit.mean(), "m", "reading minus displacement measured by the table's sensor"),
            **passes,
        },
        {"delay": FittedParameter(delay, uncertainty, "s")},
    )


def _calibrated_sensors(found: LaserCalibration, reference: ReferenceCurve) -> Iterator[CalibratedSensor]:
    """Results of both lasers, of their ratio, and of both sensors of the table."""
    for name, laser in (("laser_1", found.laser_1), ("laser_2", found.laser_2)):
        at = np.linspace(laser.lowest, laser.highest, 201)
        error = at - laser.corrected(at)
        yield CalibratedSensor(
            sensor=name,
            scale=laser.scale,
            # relative to the mean of both lasers: half the difference of their slopes
            scale_uncertainty=0.5 * COVERAGE * found.differential_uncertainty,
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
    displacement, acceleration = found.table_displacement, found.table_acceleration
    uncertainty = COVERAGE * found.table_uncertainty
    yield CalibratedSensor(
        sensor="table_displacement",
        scale=1.0 / displacement,
        scale_uncertainty=uncertainty / displacement,
        lowest_m=reference.low,
        highest_m=reference.high,
        order=reference.error.size - 1,
        largest_error_m=reference.largest,
        residual_m=COVERAGE * reference.uncertainty,
    )
    yield CalibratedSensor(
        sensor="table_acceleration", scale=1.0 / acceleration, scale_uncertainty=uncertainty / acceleration
    )


def _sensors_table(points: Sequence[CalibratedSensor]) -> str:
    """Text table with a row for each sensor; absent values are "-"."""
    if not points:
        return "Nothing was calibrated."
    return text_table(_COLUMNS, map(_cells, points))


def _errors_figure(curves: tuple[ErrorCurve, ErrorCurve] | None, reference: ReferenceCurve | None) -> "Figure":
    """Figure with two panels for each laser and for the table's displacement sensor, empty without curves."""
    figure = new_figure(9.0, 9.0)
    panels = figure.subplots(3, 2, width_ratios=(3, 1), squeeze=False)
    titles = "laser 1", "laser 2", "table displacement"
    references = "displacement", "displacement", "acceleration integrated twice"
    for (over, orders), title, compared in zip(panels, titles, references, strict=True):
        over.set_title(title, loc="left", fontsize=10)
        over.set_xlabel("reading [mm]")
        over.set_ylabel(f"reading minus {compared} [µm]", fontsize=8)
        orders.set_xlabel("order [1]")
        orders.set_ylabel("prediction error [µm]")
        set_grid(over)
        # orders are integers
        orders.xaxis.get_major_locator().set_params(integer=True)
        set_grid(orders)
    for (over, orders), curve in zip(panels, (*(curves or ()), *filter(None, [reference])), strict=False):
        reading = 1e3 * np.linspace(curve.low, curve.high, READINGS)
        for each in curve.without:
            over.plot(reading, 1e6 * (each - each.mean()), color=GREY, linewidth=0.6)
        error = values(curve.error)
        over.plot(reading, 1e6 * (error - error.mean()), color=BLUE)
        tried = np.arange(1, curve.scores.size + 1)
        orders.semilogy(tried, 1e6 * curve.scores, "o-", color=BLACK, markersize=4)
        ticks_1_2_5(orders.yaxis)
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
