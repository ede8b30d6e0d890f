"""The loop check on a bench: every channel and the path through the shaker, at low level.

1. The storeys are clamped to the table, so that every sensor measures one motion. All channels are acquired at rest.
2. Only if every sensor measures: the drive is calibrated and sines of one velocity are driven.
3. The clamps are taken off.
"""

from collections.abc import Generator, Iterable, Sequence
from functools import cached_property

import numpy as np

from bench.analysis.check_line import CheckLine, Verdict, failed, untested
from bench.config.model import BenchConfiguration
from bench.engine.steps import Arm, Handle, Heard, Listen, Outcome, RampOut, Say, Step
from bench.events import PointFinished, StepStarted
from bench.protocol import Plan, Prepared, Result, Sources
from bench.record.tables import Column, Table
from bench.report.style import write_figure
from drivers.rig import Handwork
from protocols.check.comparison import delay_lines, scale_lines
from protocols.check.drive import drive_lines, expected_drive
from protocols.check.protocol import CheckParameters
from protocols.check.resting import resting_lines, safety_lines
from protocols.check.results import lines_table, margins
from protocols.check.sines import measured_sines
from protocols.common.calibrate import Unmeasurable
from sim.errors import InvalidInput
from sim.parameters import Parameters

REST = 2.0
"""Time at rest before the table moves, over which the zero of the signals is taken [s]."""

_CLAMP = "Take spring and block off the table and clamp both storeys to it; keep clear, the amplifier is switched on."
_UNCLAMP = "Take the clamps off the storeys."


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
        return self.collected(_steps(self.parameters, self.configuration))

    def result(self, points: Sequence[Parameters]) -> Result:
        lines = [point for point in points if isinstance(point, CheckLine)]
        return Result(
            points=tuple(points),
            text=lines_table(lines),
            figures={"margins.png": lambda path: write_figure(path, margins(lines))},
            passed=all(line.verdict is not Verdict.FAILED for line in lines),
        )


def _steps(parameters: CheckParameters, configuration: BenchConfiguration) -> Generator[Step, Outcome, None]:
    """The steps of the whole check; every line is published as a point as soon as it is measured."""
    bare = configuration.known_specimen.bare()
    yield Handle(Handwork.LOCK_FRAME, bare, _CLAMP)
    yield Say(StepStarted("listen at rest"))
    heard = yield Listen(parameters.rest)
    if not isinstance(heard, Heard):
        raise TypeError(f"acquiring at rest came to {heard}")
    yield from _publish(safety_lines(configuration))
    resting = list(resting_lines(heard, parameters, configuration.analysis))
    if heard.violation is not None and all(line.verdict is not Verdict.FAILED for line in resting):
        resting.append(failed("table", "rest", f"{heard.violation} without drive: see to amplifier and limits"))
    yield from _publish(resting)
    if any(line.verdict is Verdict.FAILED for line in resting):
        remedy = "the table was not moved: see to the failed lines, then check again"
        yield from _publish([untested("bench", "motion", remedy)])
    else:
        yield from _motion(parameters, configuration)
    yield Handle(Handwork.UNLOCK_FRAME, bare, _UNCLAMP)


def _motion(parameters: CheckParameters, configuration: BenchConfiguration) -> Generator[Step, Outcome, None]:
    yield Arm(REST)
    try:
        sines = yield from measured_sines(parameters)
    except Unmeasurable as error:
        yield RampOut(fast=True)
        yield from _publish([failed("bench", "motion", str(error))])
        return
    yield RampOut()
    on_ground = configuration.laser_reference == "ground"
    yield from _publish(drive_lines(sines, parameters, configuration))
    yield from _publish(scale_lines(sines, parameters, lasers=on_ground))
    if on_ground:
        yield from _publish(delay_lines(sines, parameters, configuration))
    else:
        remedy = "lasers on the table do not see its motion: stand them on the ground for this"
        yield from _publish([untested("lasers", "polarity, scale and delay", remedy)])


def _publish(lines: Iterable[CheckLine]) -> Generator[Step, Outcome, None]:
    for line in lines:
        yield Say(PointFinished(line))
