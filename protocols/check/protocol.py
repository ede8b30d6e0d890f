"""Protocol of the loop check: its parameters, and the text of its lines."""

from typing import Annotated

from pydantic import Field, field_validator

from bench.analysis.check_line import CheckLine, Verdict
from bench.protocol import Protocol, RunView, deferred
from sim.parameters import Parameters, each_once, quantity

Frequency = Annotated[float, Field(gt=0, le=60)]


class CheckParameters(Parameters):
    """Loop check: at rest, then with sines of equal velocity amplitude and the frame locked to the table."""

    omega: tuple[Frequency, ...] = quantity(
        (8.0, 12.0, 18.0, 27.0, 40.0), "rad/s", "circular frequencies of the sines", min_length=4
    )

    _each_once = field_validator("omega")(each_once)

    velocity: float = quantity(
        0.06, "m/s", "amplitude of the table's velocity, the same at every frequency", gt=0, le=0.5
    )
    cycles: int = quantity(8, "1", "number of cycles measured at each frequency", ge=4, le=200)
    rest: float = quantity(2.0, "s", "time at rest in which noise and valid samples are evaluated", ge=0.5, le=60)
    displacement_noise: float = quantity(
        1e-4, "m", "largest allowed standard deviation of the table's displacement at rest", gt=0
    )
    acceleration_noise: float = quantity(
        0.02, "m/s2", "largest allowed standard deviation of the table's acceleration at rest", gt=0
    )
    scale_tolerance: float = quantity(
        0.02, "1", "largest allowed relative difference between the scales of two sensors", gt=0, lt=0.5
    )
    drive_tolerance: float = quantity(
        0.25, "1", "largest allowed relative difference between measured and expected drive", gt=0, lt=1
    )
    latency: float = quantity(0.02, "s", "longest allowed dead time from drive to sample", gt=0, le=1)
    delay_tolerance: float | None = quantity(
        2e-4,
        "s",
        "largest allowed difference between the delays of the table's two sensors; the accelerometer may lag by half a "
        "sample more, since the output is held between samples; if absent, the delays are not compared",
        gt=0,
        le=0.1,
    )
    u1_error: float = quantity(
        0.01, "1", "largest allowed relative error of the first storey's drift due to a laser's delay", gt=0, lt=0.5
    )
    highest_omega: float = quantity(
        20.0, "rad/s", "highest circular frequency of later tests, where a delay has the largest effect", gt=0, le=60
    )


MARKS = {Verdict.PASSED: "passed", Verdict.FAILED: "FAILED", Verdict.STATED: "stated", Verdict.UNTESTED: "untested"}


def log_line(line: CheckLine) -> str:
    """Log entry for a check line."""
    text = f"{MARKS[line.verdict]}: {line.subject}, {line.what}"
    if line.measured is not None:
        unit = "" if line.unit == "1" else f" {line.unit}"
        text += f": {line.measured:.4g}{unit}"
        text += f", allowed {allowed_range(line)}{unit}" if line.lowest is not None else ""
    return text + (f" ({line.remedy})" if line.remedy else "")


def allowed_range(line: CheckLine) -> str:
    """Allowed range as text; "-" without limits."""
    if line.lowest is None:
        return "-"
    if line.highest is None:
        return f"{number(line.lowest, 3)} .."
    if line.lowest == line.highest:
        return number(line.lowest)
    return f"{number(line.lowest, 3)} .. {number(line.highest, 3)}"


def number(value: float | None, digits: int = 4) -> str:
    """A value to the given number of significant digits; "-" if absent."""
    return "-" if value is None else f"{value:.{digits}g}"


PROTOCOL = Protocol(
    name="check",
    summary="Check the loop of the configured bench at low amplitude, and give a remedy for each check that fails.",
    details=(
        "Records every channel at rest, then drives sines of equal velocity with the frame locked to the "
        "table, and checks the drive and the polarity, scale and delay of the table's sensors and of lasers on the "
        "ground. The exit code is 1 if a check fails."
    ),
    example="--config bench.toml",
    parameters=CheckParameters,
    point=CheckLine,
    prepare=deferred("protocols.check.experiment:LoopCheck"),
    figures=("margins.png",),
    log_line=log_line,
    view=RunView(headline="measured", live=deferred("protocols.check.live:check_view")),
)
