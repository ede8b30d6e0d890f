"""Section of a report on the limits: warnings, margins and values of the limits."""

from collections.abc import Iterator

from bench.config.declared import declared
from bench.document.campaign import Campaign
from bench.document.document import Column, Listing, Notice, Part, Section, Table
from bench.document.typography import (
    ABSENT,
    counted,
    first_words,
    plain,
    typeset,
    unit_text,
)

MOST_LISTED = 40
"""Maximum number of listed damaged datasets, and of listed warnings; further ones are only counted."""

GRAVE = ("Warned", "LimitExceeded")
ENDINGS = ("-> aborting", "-> halted")
MINUTE = 60
"""Number of seconds per minute."""


def limits_section(campaign: Campaign) -> Section:
    """Report section on damage, warnings, limits of model and measurement, and margins."""
    record, damaged = campaign.record, campaign.integrity.failing
    parts: list[Part] = []
    if damaged:
        parts += [
            "Datasets that were damaged or changed since the file was written:",
            Listing(list(damaged.values())[:MOST_LISTED]),
        ]
        if len(damaged) > MOST_LISTED:
            parts.append(f"Number of further damaged datasets: {len(damaged) - MOST_LISTED}.")
    if record.status not in ("completed",):
        parts.append(Notice(f"The campaign was not completed: {record.status}. {typeset(record.summary)}".strip()))
    warnings = list(_warnings(campaign))
    if warnings:
        parts += [
            f"The journal of the file contains {counted(len(warnings), 'warning')}:",
            Listing(warnings[:MOST_LISTED]),
        ]
        if len(warnings) > MOST_LISTED:
            parts.append(f"Number of further warnings: {len(warnings) - MOST_LISTED}.")
    else:
        parts.append("No warning was issued and no limit was exceeded.")
    parts.append(
        "Limits of the model: a rigid block that neither slides nor leaves the table, Housner's impact law, "
        "a shear frame with linear springs and "
        f"dashpots{', a pure sine' if campaign.harmonic_points else ''}. Limits of the measurement: while no laser "
        "points at the block, its motion is known only from the model and from the first storey."
    )
    parts += list(_margins(campaign))
    if campaign.configuration is not None:
        parts.append(_limits(campaign))
    return Section("limits", "Limits and warnings", parts)


def _margins(campaign: Campaign) -> Iterator[Table]:
    """Table of the predicted demand on every limited quantity, and its margin; none if the file has no such data."""
    table = campaign.record.tables.get("preflight", {})
    needed = ("quantity", "demand", "limit", "unit", "margin", "where")
    if not set(needed) <= table.keys():
        return
    rows = [
        [
            str(quantity),
            plain(demand),
            plain(limit),
            unit_text(str(unit)),
            ABSENT if margin != margin else f"{100.0 * margin:.0f}",
            typeset(str(where)),
        ]
        for quantity, demand, limit, unit, margin, where in zip(
            *(table[name].values.tolist() for name in needed), strict=True
        )
    ]
    columns = [
        Column("quantity", words=True),
        Column("demand"),
        Column("limit"),
        Column("unit", words=True),
        Column("margin", "%"),
        Column("where", words=True),
    ]
    yield Table("Largest demand on every limited quantity, predicted by the preflight", columns, rows)


def _limits(campaign: Campaign) -> Table:
    limits = campaign.configuration.limits if campaign.configuration else None
    rows = [
        [first_words(entry.description) or entry.name, plain(getattr(limits, entry.name)), unit_text(entry.unit)]
        for entry in (declared(type(limits)) if limits is not None else ())
        if isinstance(getattr(limits, entry.name), float)
    ]
    columns = [Column("limit", words=True), Column("value"), Column("unit", words=True)]
    return Table("Limits enforced by the guard", columns, rows)


def _warnings(campaign: Campaign) -> Iterator[str]:
    for event in campaign.record.events:
        stopped = event.kind == "StateChanged" and any(word in event.text for word in ENDINGS)
        if event.kind in GRAVE or stopped:
            minutes, seconds = divmod(event.time, MINUTE)
            yield f"{int(minutes)}:{seconds:04.1f} min  {typeset(event.text)}"
