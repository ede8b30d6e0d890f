"""The laser calibration as a session takes it."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bench.analysis.laser_calibration import LaserCalibration
from bench.config.model import BenchConfiguration
from bench.engine.steps import Plan
from bench.preflight.forecast import Forecast
from bench.progress import Progress, silent
from bench.record.tables import Column, Table
from protocols.laser_calibration.parameters import LaserCalibrationParameters
from protocols.laser_calibration.point import CalibratedSensor
from sim.errors import InvalidInput
from sim.parameters import Parameters

if TYPE_CHECKING:
    from protocols.laser_calibration.fit import Fitted

MARGIN = 1.05
"""Share of the amplitude that must be allowed: the drive is calibrated below it."""


class LasersCalibrated:
    """Both lasers against one motion, as a file that other runs load."""

    name = "laser-calibration"
    figure_name = "laser_errors.png"
    kept_name = "laser_calibration.json"
    point_type: type[Parameters] = CalibratedSensor

    def __init__(self, parameters: LaserCalibrationParameters) -> None:
        self.parameters = parameters
        self._found: LaserCalibration | None = None
        self._curves: tuple[Fitted, Fitted] | None = None

    def check(self, configuration: BenchConfiguration) -> None:
        """Raise InvalidInput for lasers that do not see the table, and for motions that the bench does not allow."""
        p, limits = self.parameters, configuration.limits
        if configuration.laser_reference != "ground":
            raise InvalidInput(
                "lasers.reference",
                "table",
                "lasers on the table do not see its motion: stand both on the ground for this, and say so",
            )
        if configuration.calibrated is not None:
            raise InvalidInput(
                "laser_calibration",
                f"{configuration.calibrated.date:%Y-%m-%d}",
                "an older calibration would be applied to the new one: leave it out of the configuration",
            )
        reach = min(configuration.half_stroke, limits.displacement)
        reach = min(reach, 0.5 * limits.laser_range * min(configuration.laser_ranges))
        if MARGIN * p.amplitude > reach:
            raise InvalidInput("amplitude", p.amplitude, f"the bench allows {reach / MARGIN:.4g} m")
        for quantity, unit, value in (
            ("velocity", "m/s", p.amplitude * p.omega),
            ("acceleration", "m/s2", p.amplitude * p.omega**2),
        ):
            most = float(getattr(limits, quantity))
            if MARGIN * value > most:
                needs = f"{p.amplitude:g} m needs {value:.3g} {unit} there, limits.{quantity} = {most:g} {unit}"
                raise InvalidInput("omega", p.omega, needs)

    def preflight(self, configuration: BenchConfiguration, progress: Progress = silent) -> Forecast:
        """The most that is asked of every limited quantity."""
        from protocols.laser_calibration.preflight import forecast

        progress("predicting what the run asks of the bench")
        return forecast(self.parameters, configuration)

    def predict(self, configuration: BenchConfiguration) -> Table:  # noqa: ARG002
        """The passes that are asked for."""
        from protocols.laser_calibration.sheet import passes_of

        omega, amplitude = np.array(passes_of(self.parameters)).T
        return {
            "omega": Column(omega, "rad/s", "circular frequency of each pass"),
            "amplitude": Column(amplitude, "m", "amplitude of the table in it"),
        }

    def plan(self, configuration: BenchConfiguration) -> Plan:
        """The lab sheet."""
        from protocols.laser_calibration.sheet import calibration_plan

        def keep(found: LaserCalibration, curves: "tuple[Fitted, Fitted]") -> None:
            self._found, self._curves = found, curves

        return calibration_plan(self.parameters, configuration, keep)

    def keep(self, path: Path) -> None:
        """Write the calibration for other runs, if there is one."""
        if self._found is not None:
            from bench.config.calibration_file import write_calibration

            write_calibration(path, self._found)

    def table(self, points: Sequence[Parameters]) -> str:
        """One row for each sensor."""
        from protocols.laser_calibration.table import sensors_table

        return sensors_table([point for point in points if isinstance(point, CalibratedSensor)])

    def figure(self, points: Sequence[Parameters], prediction: Table, path: Path) -> None:  # noqa: ARG002
        """The lasers' errors over their readings."""
        from bench.report.style import write_figure
        from protocols.laser_calibration.figure import errors_figure

        write_figure(path, errors_figure(self._curves))
