"""The loop check on a bench: every channel and the path through the shaker, at low level."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from bench.analysis.check_line import CheckLine, Verdict
from bench.config.model import BenchConfiguration
from bench.protocol import Plan, Prepared, Result, Sources
from bench.record.tables import Column, Table
from bench.report.style import write_figure
from protocols.check.drive import expected_drive
from protocols.check.figure import margins
from protocols.check.protocol import CheckParameters
from protocols.check.sheet import check_plan
from protocols.check.table import lines_table
from sim.errors import InvalidInput
from sim.parameters import Parameters


class LoopCheck(Prepared[CheckParameters]):
    """Refuses motions beyond limits, stroke or the lasers' ranges."""

    def __init__(
        self, parameters: CheckParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        limits, velocity = self.configuration.limits, self.parameters.velocity
        slow, fast = min(self.parameters.omega), max(self.parameters.omega)
        reach = min(self.configuration.half_stroke, limits.displacement)
        if self.configuration.laser_reference == "ground":
            reach = min(reach, 0.5 * min(self.configuration.laser_ranges))
        if velocity > limits.velocity:
            raise InvalidInput("velocity", velocity, f"limits.velocity = {limits.velocity:g} m/s")
        if velocity / slow > reach:
            needs = f"{velocity:g} m/s needs {1e3 * velocity / slow:.1f} mm there, the bench allows"
            raise InvalidInput("omega", slow, f"{needs} {1e3 * reach:.1f} mm")
        if velocity * fast > limits.acceleration:
            needs = f"{velocity:g} m/s needs {velocity * fast:.3g} m/s2 there, limits.acceleration ="
            raise InvalidInput("omega", fast, f"{needs} {limits.acceleration:g} m/s2")

    @cached_property
    def prediction(self) -> Table:
        """The drive that the simulated shaker needs; NaN for a real one."""
        omega = np.array(sorted(self.parameters.omega))
        expected = expected_drive(omega, self.configuration)
        drive = np.full(omega.shape, np.nan) if expected is None else expected
        return {
            "omega": Column(omega, "rad/s", "circular frequency of the table's motion"),
            "drive": Column(drive, "V s2/m", "amplitude of the drive over that of the table's acceleration"),
        }

    def plan(self) -> Plan:
        return self.collected(check_plan(self.parameters, self.configuration))

    def result(self, points: Sequence[Parameters]) -> Result:
        lines = [point for point in points if isinstance(point, CheckLine)]
        return Result(
            points=tuple(points),
            text=lines_table(lines),
            figures={"margins.png": lambda path: write_figure(path, margins(lines))},
            passed=all(line.verdict is not Verdict.FAILED for line in lines),
        )
