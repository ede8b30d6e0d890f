"""The lab sheet of the loop check.

1. The storeys are clamped to the table, so that every sensor sees one motion. The bench is listened to at rest.
2. Only if every sensor measures: the drive is calibrated and sines of one velocity are driven.
3. The clamps are taken off.
"""

from collections.abc import Generator, Iterator

from bench.analysis.check_line import CheckLine, Verdict, failed, untested
from bench.config.model import BenchConfiguration
from bench.engine.steps import Arm, Handle, Heard, Listen, Outcome, RampOut, Say, Step
from bench.events import PointFinished, StepStarted
from drivers.rig import Handwork
from protocols.check.delays import delay_lines
from protocols.check.drive import drive_lines
from protocols.check.protocol import CheckParameters
from protocols.check.resting import resting_lines
from protocols.check.safety import safety_lines
from protocols.check.scales import scale_lines
from protocols.check.sines import measured_sines
from protocols.common.calibrate import Unmeasurable

REST = 2.0
"""Time at rest before the table moves, over which the zero of the signals is taken [s]."""

_CLAMP = "Take spring and block off the table and clamp both storeys to it; keep clear, the amplifier is switched on."
_UNCLAMP = "Take the clamps off the storeys."


def check_plan(parameters: CheckParameters, configuration: BenchConfiguration) -> Generator[Step, Outcome, None]:
    """The whole check as steps; every line is published as a point as soon as it is known."""
    bare = configuration.known_specimen.bare()
    yield Handle(Handwork.LOCK_FRAME, bare, _CLAMP)
    yield Say(StepStarted("listen at rest"))
    heard = yield Listen(parameters.rest)
    if not isinstance(heard, Heard):
        raise TypeError(f"listening came to {heard}")
    yield from _say(safety_lines(configuration))
    resting = list(resting_lines(heard, parameters, configuration.analysis))
    if heard.violation is not None and all(line.verdict is not Verdict.FAILED for line in resting):
        resting.append(failed("table", "rest", f"{heard.violation} without drive: see to amplifier and limits"))
    yield from _say(resting)
    if any(line.verdict is Verdict.FAILED for line in resting):
        remedy = "the table was not moved: see to the failed lines, then check again"
        yield from _say([untested("bench", "motion", remedy)])
    else:
        yield from _motion(parameters, configuration)
    yield Handle(Handwork.UNLOCK_FRAME, bare, _UNCLAMP)


def _motion(parameters: CheckParameters, configuration: BenchConfiguration) -> Generator[Step, Outcome, None]:
    yield Arm(REST)
    try:
        sines = yield from measured_sines(parameters)
    except Unmeasurable as error:
        yield RampOut(fast=True)
        yield from _say([failed("bench", "motion", str(error))])
        return
    yield RampOut()
    on_ground = configuration.laser_reference == "ground"
    yield from _say(drive_lines(sines, parameters, configuration))
    yield from _say(scale_lines(sines, parameters, lasers=on_ground))
    if on_ground:
        yield from _say(delay_lines(sines, parameters, configuration))
    else:
        remedy = "lasers on the table do not see its motion: stand them on the ground for this"
        yield from _say([untested("lasers", "polarity, scale and delay", remedy)])


def _say(lines: Iterator[CheckLine] | list[CheckLine]) -> Generator[Step, Outcome, None]:
    for line in lines:
        yield Say(PointFinished(line))
