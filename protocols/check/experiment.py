# pyright: reportUnknownMemberType=false
"""Loop check of a bench: tests the channels at rest, then drive, shaker and sensors at low amplitude.

1. The storeys are clamped to the table, so that they move with it. All channels are acquired at rest.
2. If no check at rest fails, the drive is calibrated and sines of equal velocity amplitude are driven.
3. The clamps are removed.
"""

import textwrap
from collections.abc import Generator, Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bench.analysis.check_line import CheckLine, Verdict, failed, untested
from bench.analysis.cycles import Cycle
from bench.config.model import BenchConfiguration
from bench.control.oscillator import Segment
from bench.datafile.tables import Column, Table
from bench.document.typography import typeset
from bench.engine.steps import (
    AcquireAtRest,
    Arm,
    Calibrate,
    Dwell,
    Fallen,
    Measured,
    OperatorAction,
    Outcome,
    Publish,
    RampOut,
    RestSamples,
    Step,
    Sweep,
)
from bench.events import PointFinished, Progress, StepStarted
from bench.figures.style import BLUE, GREY, VERMILLION, new_figure, set_grid, write_figure
from bench.figures.text_table import TextColumn, text_table
from bench.protocol import Plan, Prepared, Result, Sources
from drivers.rig import OperatorTask
from protocols.check.comparison import allowed_delay, delay_lines, scale_lines, table_delay_lines
from protocols.check.lines import alignment_lines, drive_lines, expected_drive, input_lines, resting_lines, safety_lines
from protocols.check.protocol import MARKS, CheckParameters, allowed_range, number
from protocols.check.sines import divided, held_for, laser_delays
from protocols.common.calibrate import (
    CHANGE_TIME,
    SETTLING,
    STOREYS_CLAMPED,
    Unmeasurable,
    calibrate_drive,
    complete_cycles,
    probed_drive,
)
from sim.errors import InvalidInput
from sim.parameters import Parameters

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REST = 2.0
"""Time at rest before the table moves, during which the signals are zeroed [s]."""

WIDTH = 118
"""Width of a text line in characters."""

_OUTSIDE = 1.5
"""Position at which values far beyond their limits are drawn, in units of half the allowed range."""

_FALLEN = "storey 1 has a permanent offset although there is no block on the table: check lasers and specimen"

_CLAMP = (
    "Remove spring and block from the table and clamp both storeys to it. Keep clear: the amplifier will be enabled."
)
_UNCLAMP = "Remove the clamps from the storeys."


class LoopCheck(Prepared[CheckParameters]):
    """Loop check. Raises InvalidInput for motions beyond the limits, the stroke or the ranges of the lasers."""

    def __init__(
        self, parameters: CheckParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._clamped = False
        limits, velocity = self.configuration.limits, self.parameters.velocity
        slow, fast = min(self.parameters.omega), max(self.parameters.omega)
        reach = min(self.configuration.half_stroke, limits.displacement)
        if self.configuration.laser_reference == "ground":
            reach = min(reach, min(self.configuration.laser_half_ranges))
        if velocity > limits.velocity:
            raise InvalidInput("velocity", velocity, f"it must not exceed limits.velocity = {limits.velocity:g} m/s")
        if velocity / slow > reach:
            needs = (
                f"a velocity of {velocity:g} m/s at this frequency is an amplitude of {1e3 * velocity / slow:.1f} mm"
            )
            raise InvalidInput("omega", slow, f"{needs}, but the bench allows {1e3 * reach:.1f} mm")
        if velocity * fast > limits.acceleration:
            needs = f"a velocity of {velocity:g} m/s at this frequency requires {velocity * fast:.3g} m/s2"
            raise InvalidInput("omega", fast, f"{needs}, but limits.acceleration = {limits.acceleration:g} m/s2")

    @cached_property
    def prediction(self) -> Table:
        """Drive required by the simulated shaker; NaN for a real shaker."""
        omega = np.array(sorted(self.parameters.omega))
        expected = expected_drive(omega, self.configuration)
        drive = np.full(omega.shape, np.nan) if expected is None else expected
        return {
            "omega": Column(omega, "rad/s", "circular frequency of the table's motion"),
            "drive": Column(
                drive, "V s2/m", "amplitude of the drive relative to the amplitude of the table's acceleration"
            ),
        }

    def plan(self) -> Plan:
        self._clamped = False
        found = yield from self.collected(self._steps())
        return self._result(found.points, complete=True)

    def _steps(self) -> Generator[Step, Outcome, None]:
        """Steps of the check; each line is published as a point as soon as it has been measured."""
        bare = self.configuration.known_specimen.bare()
        yield OperatorAction(OperatorTask.LOCK_FRAME, bare, _CLAMP)
        self._clamped = True
        yield from _clamped_steps(self.parameters, self.configuration)
        yield OperatorAction(OperatorTask.UNLOCK_FRAME, bare, _UNCLAMP)
        self._clamped = False

    def result(self, points: Sequence[Parameters]) -> Result:
        return self._result(points, complete=False)

    def _result(self, points: Sequence[Parameters], *, complete: bool) -> Result:
        """Result of a complete or interrupted check; an interrupted one has not passed, since lines are missing."""
        lines = [point for point in points if isinstance(point, CheckLine)]
        text = _table(lines, complete=complete)
        return Result(
            points=tuple(points),
            text=f"{text}\n{STOREYS_CLAMPED}" if self._clamped else text,
            figures={"margins.png": lambda path: write_figure(path, _margins(lines))},
            passed=complete and all(line.verdict is not Verdict.FAILED for line in lines),
        )


def _clamped_steps(parameters: CheckParameters, configuration: BenchConfiguration) -> Generator[Step, Outcome, None]:
    yield Publish(StepStarted("acquire at rest"))
    at_rest = yield AcquireAtRest(parameters.rest)
    if not isinstance(at_rest, RestSamples):
        raise TypeError(f"the acquisition at rest ended with {at_rest}")
    yield from _publish(safety_lines(configuration))
    resting = list(resting_lines(at_rest, parameters, configuration.analysis))
    if at_rest.violation is not None and all(line.verdict is not Verdict.FAILED for line in resting):
        resting.append(
            failed("table", "rest", f"{at_rest.violation} at zero drive: check the amplifier and the limits")
        )
    yield from _publish(resting)
    yield from _publish(input_lines(at_rest.channels))
    yield from _publish(alignment_lines(at_rest.alignments, configuration))
    if any(line.verdict is Verdict.FAILED for line in resting):
        remedy = "the table was not moved: correct the failures found at rest, then repeat the check"
        yield from _publish([untested("bench", "motion", remedy)])
    else:
        yield from _motion(parameters, configuration)


def _motion(parameters: CheckParameters, configuration: BenchConfiguration) -> Generator[Step, Outcome, None]:
    yield Arm(REST)
    try:
        measured = yield from _measured(parameters)
    except Unmeasurable as error:
        yield RampOut(fast=True)
        yield from _publish([failed("bench", "motion", str(error))])
        return
    yield RampOut()
    parts, windows = divided(measured, configuration.sample_rate)
    sines = parts.means()
    on_ground = configuration.laser_reference == "ground"
    yield from _publish(drive_lines(sines, parameters, configuration))
    yield from _publish(scale_lines(sines, parameters, lasers=on_ground))
    most = allowed_delay(configuration.known_specimen, parameters.highest_omega, parameters.u1_error)
    rate = configuration.sample_rate
    accelerometer, displacement = (
        laser_delays(parts, windows, table, held_for(configuration), rate) if on_ground else None
        for table in ("accelerometer", "displacement")
    )
    yield from _publish(table_delay_lines(sines, parameters, rate, lasers=accelerometer, most=most))
    if displacement is not None:
        yield from _publish(delay_lines(sines, displacement, parameters, configuration))
    else:
        remedy = "lasers on the table do not measure its motion: mount them on the ground for this test"
        yield from _publish([untested("lasers", "polarity, scale and delay", remedy)])


def _publish(lines: Iterable[CheckLine]) -> Generator[Step, Outcome, None]:
    for line in lines:
        yield Publish(PointFinished(line))


def _measured(parameters: CheckParameters) -> Generator[Step, Outcome, list[tuple[float, Sequence[Cycle]]]]:
    """Calibrate the drive, then measure the cycles at all frequencies. Raises Unmeasurable if the response is
    insufficient.
    """
    omegas = sorted(parameters.omega)
    yield Publish(StepStarted("calibrate the drive"))
    # the table's travel is smallest at the highest frequency
    probed = yield from probed_drive(omegas[-1])
    calibration = yield from calibrate_drive(omegas, parameters.velocity * omegas[0], probed)
    if isinstance(calibration, Fallen):
        raise Unmeasurable(_FALLEN)
    yield Calibrate(calibration)
    found: list[tuple[float, Sequence[Cycle]]] = []
    for index, omega in enumerate(omegas):
        yield Publish(StepStarted(f"common motion at {omega:g} rad/s"))
        yield Publish(_progress(omegas, index, parameters))
        yield Sweep((Segment(CHANGE_TIME, parameters.velocity * omega, omega),))
        outcome = yield Dwell(SETTLING + parameters.cycles)
        if not isinstance(outcome, Measured):
            raise Unmeasurable(_FALLEN)
        found.append((omega, complete_cycles(outcome, parameters.cycles)))
    yield Publish(Progress(1.0, 0.0, "common motion finished"))
    return found


def _progress(omegas: list[float], index: int, parameters: CheckParameters) -> Progress:
    lengths = [CHANGE_TIME + (SETTLING + parameters.cycles) * 2.0 * np.pi / omega for omega in omegas]
    left = float(sum(lengths[index:]))
    return Progress(1.0 - left / float(sum(lengths)), left, f"common motion at {omegas[index]:g} rad/s")


_COLUMNS = (
    TextColumn("verdict", words=True),
    TextColumn("signal", words=True),
    TextColumn("quantity", words=True),
    TextColumn("measured"),
    TextColumn("U (k=2)"),
    TextColumn("expected"),
    TextColumn("allowed"),
    TextColumn("unit", words=True),
)


def _table(lines: Sequence[CheckLine], *, complete: bool) -> str:
    """Text table of the lines, each followed by its remedy, if any, and the number of lines by verdict."""
    title, rule, *rows = text_table(_COLUMNS, map(_cells, lines)).splitlines()
    text = [title, rule]
    for line, row in zip(lines, rows, strict=True):
        text.append(row)
        if line.remedy:
            text += textwrap.wrap(line.remedy, WIDTH, initial_indent="    -> ", subsequent_indent="       ")
    counted = [sum(line.verdict is verdict for line in lines) for verdict in Verdict]
    summary = ", ".join(f"{number} {verdict}" for number, verdict in zip(counted, Verdict, strict=True) if number)
    incomplete = "" if complete else " The check was not completed: further lines are missing."
    return "\n".join([*text, "", f"{summary or 'nothing was checked'}.{incomplete}"])


def _margins(lines: Sequence[CheckLine]) -> "Figure":
    """Figure of all lines with two limits, on a scale from the lowest (-1) to the highest allowed value (+1)."""
    judged = [(line, position) for line in lines if (position := _position(line)) is not None]
    figure = new_figure(8.0, 1.2 + 0.24 * len(judged))
    panel = figure.subplots()
    panel.axvspan(-1.0, 1.0, color=BLUE, alpha=0.08, linewidth=0.0)
    for row, (line, position) in enumerate(judged):
        passed = line.verdict is Verdict.PASSED
        panel.plot(position, row, "o" if passed else "X", color=BLUE if passed else VERMILLION, markersize=6)
    labels = [typeset(f"{line.subject}: {line.what}") for line, _ in judged]
    panel.set_yticks(range(len(judged)), labels, fontsize=7)
    panel.set_xlim(-1.1 * _OUTSIDE, 1.1 * _OUTSIDE)
    panel.set_xticks([-1.0, 0.0, 1.0], ["lowest", "middle", "highest"])
    panel.set_xlabel("position within the allowed range (circles: passed, crosses: failed)", color=GREY)
    panel.invert_yaxis()
    set_grid(panel)
    return figure


def _cells(line: CheckLine) -> tuple[str, ...]:
    return (
        MARKS[line.verdict],
        line.subject,
        line.what,
        number(line.measured),
        number(line.uncertainty, 2),
        number(line.expected),
        allowed_range(line),
        "" if line.measured is None or line.unit == "1" else line.unit,
    )


def _position(line: CheckLine) -> float | None:
    """Measured value on a scale from -1 to 1 between its limits, clipped at +-`_OUTSIDE`; None unless it has two
    limits.
    """
    if line.measured is None or line.lowest is None or line.highest is None:
        return None
    middle, half = 0.5 * (line.lowest + line.highest), 0.5 * (line.highest - line.lowest)
    if half == 0.0:
        return 0.0 if line.measured == middle else _OUTSIDE
    return min(max((line.measured - middle) / half, -_OUTSIDE), _OUTSIDE)
