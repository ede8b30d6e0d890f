"""Live view of the check: its lines with their verdicts, and the lines that are still pending."""

from collections.abc import Iterator

from bench.analysis.check_line import CheckLine, Verdict
from bench.document.typography import unit_text
from bench.live_view import Check, Checklist, LiveRun, LiveView
from protocols.check.protocol import CheckParameters, allowed_range, number
from sim.channel import STOREYS, TABLE_ACCELERATION, TABLE_DISPLACEMENT

CHANNELS = (TABLE_DISPLACEMENT, TABLE_ACCELERATION, *STOREYS)


def check_view(run: LiveRun) -> LiveView:
    """The published lines, followed by the pending ones, as far as they are known in advance. No line is pending once
    the motion has failed or been refused.
    """
    lines = [point for point in run.points if isinstance(point, CheckLine)]
    known = {(line.subject, line.what) for line in lines}
    stopped = any(line.what == "motion" for line in lines)
    pending = () if stopped else expected(run.parameters, on_ground=run.configuration.laser_reference == "ground")
    return (
        Checklist(
            (
                *(_check(line) for line in lines),
                *(Check(f"{subject}, {what}", "pending") for subject, what in pending if (subject, what) not in known),
            )
        ),
    )


def expected(parameters: CheckParameters, *, on_ground: bool) -> Iterator[tuple[str, str]]:
    """Subject and quantity of the lines that do not depend on the results, in the order in which they are published."""
    for channel in CHANNELS:
        yield channel, "valid samples at rest"
        yield channel, "noise at rest"
    yield "drive", f"dead time to {TABLE_ACCELERATION}"
    for omega in sorted(parameters.omega):
        yield "drive", f"volts per m/s2 at {omega:g} rad/s"
    if on_ground:
        yield "lasers", f"scale of {STOREYS[1]} against {STOREYS[0]}"
    if parameters.delay_tolerance is not None:
        yield TABLE_ACCELERATION, f"delay against {TABLE_DISPLACEMENT}"
    if on_ground:
        for laser in STOREYS:
            yield laser, f"delay against {TABLE_DISPLACEMENT}"
        yield "lasers", f"delay of {STOREYS[1]} against {STOREYS[0]}"


def _check(line: CheckLine) -> Check:
    verdict = "passed" if line.verdict is Verdict.PASSED else "failed" if line.verdict is Verdict.FAILED else "other"
    unit = "" if line.unit == "1" else f" {unit_text(line.unit)}"
    text = "" if line.measured is None else f"{number(line.measured)}{unit}"
    if line.lowest is not None:
        text += f", allowed {allowed_range(line)}{unit}"
    return Check(f"{line.subject}, {line.what}", verdict, line.remedy or text)
