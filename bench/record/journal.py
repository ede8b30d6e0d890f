"""What an event says in one line, for the journal of the run."""

from dataclasses import fields

from bench.events import (
    Acquired,
    Estimate,
    Event,
    FitFinished,
    LimitExceeded,
    OperatorAnswered,
    OperatorAsked,
    PassFinished,
    Progress,
    RunningGain,
    SensorsAligned,
    SpecimenIdentified,
    SpecimenMounted,
    StateChanged,
    StepStarted,
    TableIdentified,
    TwinEstimate,
    Warned,
)
from drivers.rig import Alignment

NOT_JOURNALLED = (Acquired, Estimate, Progress, RunningGain, TwinEstimate)
"""Too many to read; samples and estimates have their own places in the file."""


def text_of(event: Event) -> str:
    """One line that a person can read."""
    match event:
        case StateChanged():
            return f"{event.before} -> {event.after}: {event.reason}"
        case StepStarted() | Warned() | TableIdentified():
            return event.text
        case FitFinished():
            return f"{event.name}: {event.text}"
        case SpecimenIdentified():
            return "; ".join(
                f"{each.name} = {each.value:.7g} +- {each.standard_uncertainty:.2g} (k = 1)"
                for each in event.identified.findings
            )
        case PassFinished():
            return f"{event.motion}: {event.text}"
        case LimitExceeded():
            return f"{event.quantity} reached {event.value:.6g} {event.unit}; limit {event.limit:.6g} {event.unit}"
        case OperatorAsked():
            return event.request
        case OperatorAnswered():
            return f"{event.request} (answered by {event.by})"
        case SpecimenMounted():
            amount = "" if event.amount is None else f" {event.amount:g}"
            label = event.specimen.label
            return f"{event.work}{amount}: {'bare frame' if label is None else f'beta = {label:g}'}"
        case SensorsAligned():
            return "; ".join(_placed(one) for one in event.alignments)
        case _:
            names = (field.name for field in fields(event) if field.name != "time")
            return ", ".join(f"{name} = {getattr(event, name)}" for name in names)


def _placed(one: Alignment) -> str:
    rate, residual = 1e6 * (one.rate - 1.0), 1e6 * one.residual
    given = f"{one.values} values, {one.lost} lost"
    return f"{one.sensor}: clock {rate:+.1f} ppm, readings within {residual:.0f} us, {given}"
