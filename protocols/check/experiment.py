"""The loop check as a session takes it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.config.model import BenchConfiguration
from bench.engine.steps import Plan
from bench.record.tables import Column, Table
from protocols.check.line import CheckLine
from protocols.check.parameters import CheckParameters
from sim.errors import InvalidInput
from sim.parameters import Parameters


class LoopCheck:
    """Every channel and the path through the shaker, at low level."""

    name = "check"
    figure_name = "margins.png"
    point_type: type[Parameters] = CheckLine

    def __init__(self, parameters: CheckParameters) -> None:
        self.parameters = parameters

    def check(self, configuration: BenchConfiguration) -> None:
        """Raise InvalidInput for motions beyond limits, stroke or the lasers' ranges."""
        limits, velocity = configuration.limits, self.parameters.velocity
        slow, fast = min(self.parameters.omega), max(self.parameters.omega)
        reach = min(configuration.half_stroke, limits.displacement)
        if configuration.laser_reference == "ground":
            reach = min(reach, 0.5 * min(configuration.laser_ranges))
        if velocity > limits.velocity:
            raise InvalidInput("velocity", velocity, f"limits.velocity = {limits.velocity:g} m/s")
        if velocity / slow > reach:
            needs = f"{velocity:g} m/s needs {1e3 * velocity / slow:.1f} mm there, the bench allows"
            raise InvalidInput("omega", slow, f"{needs} {1e3 * reach:.1f} mm")
        if velocity * fast > limits.acceleration:
            needs = f"{velocity:g} m/s needs {velocity * fast:.3g} m/s2 there, limits.acceleration ="
            raise InvalidInput("omega", fast, f"{needs} {limits.acceleration:g} m/s2")

    def predict(self, configuration: BenchConfiguration) -> Table:
        """The drive that the simulated shaker needs; NaN for a real one."""
        from protocols.check.drive import expected_drive

        omega = np.array(sorted(self.parameters.omega))
        expected = expected_drive(omega, configuration)
        drive = np.full(omega.shape, np.nan) if expected is None else expected
        return {
            "omega": Column(omega, "rad/s", "circular frequency of the table's motion"),
            "drive": Column(drive, "V s2/m", "amplitude of the drive over that of the table's acceleration"),
        }

    def plan(self, configuration: BenchConfiguration) -> Plan:
        """The lab sheet."""
        from protocols.check.sheet import check_plan

        return check_plan(self.parameters, configuration)

    def table(self, points: Sequence[Parameters]) -> str:
        """The lines as plain text."""
        from protocols.check.table import lines_table

        return lines_table(_lines(points))

    def figure(self, points: Sequence[Parameters], prediction: Table, path: Path) -> None:  # noqa: ARG002
        """Where each judged line lies between its limits."""
        from bench.report.style import write_figure
        from protocols.check.figure import margins

        write_figure(path, margins(_lines(points)))


def _lines(points: Sequence[Parameters]) -> list[CheckLine]:
    return [point for point in points if isinstance(point, CheckLine)]
