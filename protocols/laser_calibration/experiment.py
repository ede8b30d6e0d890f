"""The laser calibration on a bench: both lasers against one motion, as a file that other runs load."""

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from bench.analysis.laser_calibration import LaserCalibration
from bench.config.calibration_file import write_calibration
from bench.config.model import BenchConfiguration
from bench.control.legs import Leg, program
from bench.preflight.asked import UNKNOWN_SHAKER
from bench.preflight.bounds import bounds
from bench.preflight.forecast import Demand, Forecast
from bench.preflight.load import load
from bench.preflight.response import response_of
from bench.protocol import Plan, Prepared, Result, Sources
from bench.record.tables import Column, Table
from bench.report.style import write_figure
from protocols.laser_calibration.fit import ErrorCurve
from protocols.laser_calibration.plan import START, calibration_steps, expected_duration, planned_passes
from protocols.laser_calibration.protocol import CalibratedSensor, LaserCalibrationParameters
from protocols.laser_calibration.results import errors_figure, sensors_table
from sim.errors import InvalidInput
from sim.parameters import Parameters

MARGIN = 1.05
"""Share of the amplitude that must be allowed: the drive is calibrated below it."""

_UNKNOWN = {
    "drive_voltage": "nothing is known of this table: the probes find out, within limits.drive_voltage",
    "drive_slew": "nothing is known of this table: the probes find out, within limits.drive_slew",
    **UNKNOWN_SHAKER,
}


class LaserCalibrationRun(Prepared[LaserCalibrationParameters]):
    """Refuses lasers that do not see the table, and motions that the bench does not allow."""

    def __init__(
        self, parameters: LaserCalibrationParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._found: LaserCalibration | None = None
        self._curves: tuple[ErrorCurve, ErrorCurve] | None = None
        p, limits = self.parameters, configuration.limits
        if configuration.laser_reference != "ground":
            raise InvalidInput(
                "lasers.reference",
                "table",
                "lasers on the table do not measure its motion: stand both on the ground, and set this to ground",
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

    @cached_property
    def forecast(self) -> Forecast:
        """The demands of the largest pass: sines of the table with the clamped storeys as a rigid load."""
        self.progress("predicting what the run asks of the bench")
        amplitude, omega, frame = (
            self.parameters.amplitude,
            self.parameters.omega,
            self.configuration.known_specimen.frame,
        )
        duration = expected_duration(self.parameters)
        level = amplitude * omega**2
        asked = load(
            program((Leg(START, level, omega), Leg(duration, level, omega))),
            START,
            duration,
            payload=frame.m1 + frame.m2,
            mover=self.configuration.mover,
            response=response_of(self.configuration),
            heating_time=self.configuration.limits.heating_time,
        )
        halves = [0.5 * whole for whole in self.configuration.laser_ranges]
        asked |= {"laser_1": amplitude / halves[0], "laser_2": amplitude / halves[1], "drift": 0.0}
        where = f"the pass of {1e3 * amplitude:.1f} mm"
        demands = [
            Demand(quantity, asked[quantity], None, where)
            if quantity in asked
            else Demand(quantity, None, None, _UNKNOWN[quantity])
            for quantity in bounds(self.configuration)
        ]
        return Forecast(demands=tuple(demands), duration=duration)

    @cached_property
    def prediction(self) -> Table:
        """The planned passes."""
        omega, amplitude = np.array(planned_passes(self.parameters)).T
        return {
            "omega": Column(omega, "rad/s", "circular frequency of each pass"),
            "amplitude": Column(amplitude, "m", "amplitude of the table in it"),
        }

    def plan(self) -> Plan:
        self._found = self._curves = None
        return self.collected(calibration_steps(self.parameters, self.configuration, self._keep))

    def result(self, points: Sequence[Parameters]) -> Result:
        found, curves = self._found, self._curves

        def write(path: Path) -> None:
            if found is not None:
                write_calibration(path, found)

        return Result(
            points=tuple(points),
            text=sensors_table([point for point in points if isinstance(point, CalibratedSensor)]),
            figures={"laser_errors.png": lambda path: write_figure(path, errors_figure(curves))},
            files={} if found is None else {"laser_calibration.json": write},
        )

    def _keep(self, found: LaserCalibration, curves: tuple[ErrorCurve, ErrorCurve]) -> None:
        self._found, self._curves = found, curves
