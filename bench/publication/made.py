"""When a report was made and with what."""

from datetime import UTC, datetime

from bench.provenance import revision, software
from bench.publication.provenance import NAME, program
from bench.publication.typography import moment

SHORT = 10
"""Digits of the git hash under the title; the provenance has all."""


def made_line() -> str:
    """One sentence for under the title."""
    made = program(software()[NAME], revision(), SHORT)
    units = "α₂ is the peak drift of the coupled frame over that of the bare one, α₁ the same of u₁ (Eq. 10)."
    return f"Report made on {moment(datetime.now(UTC).isoformat())} by {made}. {units}"
