"""What an event says in one line, for the journal of the run."""

from dataclasses import fields

from bench.events import (
    Acquired,
    Estimate,
    Event,
    LimitExceeded,
    OperatorAnswered,
    OperatorAsked,
    Progress,
    StateChanged,
    StepStarted,
    Warned,
)

NOT_JOURNALLED = (Acquired, Estimate, Progress)
"""Too many to read; samples and estimates have their own place in the file."""


def text_of(event: Event) -> str:
    """One line that a person can read."""
    match event:
        case StateChanged():
            return f"{event.before} -> {event.after}: {event.reason}"
        case StepStarted() | Warned():
            return event.text
        case LimitExceeded():
            return f"{event.quantity} reached {event.value:.6g} {event.unit}; limit {event.limit:.6g} {event.unit}"
        case OperatorAsked():
            return event.request
        case OperatorAnswered():
            return f"{event.request} (answered by {event.by})"
        case _:
            names = (field.name for field in fields(event) if field.name != "time")
            return ", ".join(f"{name} = {getattr(event, name)}" for name in names)
