"""Results that are no gains, such as those of an identification or of a loop check: every field as it was stored."""

from typing import Any

import numpy as np

from bench.publication.campaign import Campaign
from bench.publication.facts import words_of
from bench.publication.numbers import ABSENT, plain
from bench.publication.typography import typeset, unit_text
from bench.record.tables import Column as Stored
from bench.report.page.document import Column, Listing, Part, Section, Table

MOST = 60
"""Rows that are listed; the file has the others."""


def points_section(campaign: Campaign) -> Section | None:
    """One row for each result; None where the results are gains, or there is none."""
    results = campaign.record.results
    if "alpha_2" in results or not campaign.points:
        return None
    columns = [
        Column(_title(name), unit_text(each.unit), each.values.dtype.kind in "SU") for name, each in results.items()
    ]
    rows = [[_cell(each, row) for each in results.values()] for row in range(min(len(campaign.points), MOST))]
    parts: list[Part] = [Table(f"Results of the protocol {campaign.protocol}", columns, rows)]
    if len(campaign.points) > MOST:
        parts.append(f"The file has {len(campaign.points) - MOST} more.")
    meanings = [f"{_title(name)}: {words_of(each.description)}" for name, each in results.items()]
    return Section("points", "Results", [*parts, Listing(meanings)])


def _title(name: str) -> str:
    return typeset(name.replace("_", " "))


def _cell(stored: Stored, row: int) -> str:
    value: Any = stored.values[row]
    if isinstance(value, str | bytes):
        text = value.decode() if isinstance(value, bytes) else value
        return typeset(text) or ABSENT
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return plain(float(value))
