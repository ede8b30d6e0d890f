"""What an event says in one line, for the journal of the run."""

from dataclasses import fields

from bench.events import (
    Acquired,
    Estimate,
    Event,
    LimitExceeded,
    OperatorAnswered,
    OperatorAsked,
    PassFinished,
    Progress,
    RunningGain,
    SensorsAligned,
    StateChanged,
    StepStarted,
    TableIdentified,
    Warned,
)
from drivers.rig import Alignment

NOT_JOURNALLED = (Acquired, Estimate, Progress, RunningGain)
"""Too many to read; samples, estimates and running gains have their own place in the file."""


def text_of(event: Event) -> str:
    """One line that a person can read."""
    match event:
        case StateChanged():
            return f"{event.before} -> {event.after}: {event.reason}"
        case StepStarted() | Warned() | TableIdentified():
            return event.text
        case PassFinished():
            return f"{event.motion}: {event.text}"
        case LimitExceeded():
            return f"{event.quantity} reached {event.value:.6g} {event.unit}; limit {event.limit:.6g} {event.unit}"
        case OperatorAsked():
            return event.request
        case OperatorAnswered():
            return f"{event.request} (answered by {event.by})"
        case SensorsAligned():
            return "; ".join(_placed(one) for one in event.alignments)
        case _:
            names = (field.name for field in fields(event) if field.name != "time")
            return ", ".join(f"{name} = {getattr(event, name)}" for name in names)


def _placed(one: Alignment) -> str:
    rate, residual = 1e6 * (one.rate - 1.0), 1e6 * one.residual
    given = f"{one.values} values, {one.lost} lost"
    return f"{one.sensor}: clock {rate:+.1f} ppm, readings within {residual:.0f} us, {given}"
