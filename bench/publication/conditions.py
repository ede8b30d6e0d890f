"""Under which limits the bench ran, and what the file and its events warn of."""

from collections.abc import Iterator

from bench.config.declared import declared
from bench.publication.campaign import Campaign
from bench.publication.facts import words_of
from bench.publication.numbers import ABSENT, plain
from bench.publication.typography import counted, typeset, unit_text
from bench.report.page.document import Column, Listing, Notice, Part, Section, Table

MOST = 40
"""Warnings that are listed; more of the same are counted."""

GRAVE = ("Warned", "LimitExceeded")
ENDINGS = ("-> aborting", "-> halted")
SHORT = 60
"""Seconds of the bench's clock to the minute."""


def limits_section(campaign: Campaign) -> Section:
    """What is not whole, warnings, limits of model and measurement, margins."""
    record, damaged = campaign.record, campaign.integrity.failing
    parts: list[Part] = []
    if damaged:
        parts += ["What is not as it was written:", Listing(list(damaged.values())[:MOST])]
    if record.status not in ("completed",):
        parts.append(Notice(f"The campaign did not run to its end: {record.status}. {typeset(record.summary)}".strip()))
    warnings = list(_warnings(campaign))
    if warnings:
        parts += [f"The journal of the file holds {counted(len(warnings), 'warning')}:", Listing(warnings[:MOST])]
        if len(warnings) > MOST:
            parts.append(f"The file has {len(warnings) - MOST} more.")
    else:
        parts.append("No warning was given and no limit was exceeded.")
    parts.append(
        "Limits of the model: a rigid block that neither slides nor flies free, Housner's impact, a shear frame with "
        f"linear springs and dashpots{', a pure sine' if campaign.harmonic_points else ''}. Limits of the measurement: "
        "the block is not measured, its motion is known from the model and from the first storey alone."
    )
    parts += list(_margins(campaign))
    if campaign.configuration is not None:
        parts.append(_limits(campaign))
    return Section("limits", "Limits and warnings", parts)


def damage_notice(campaign: Campaign) -> list[Notice]:
    """What a reader must know before anything else: what failed its checksum, or that none tell."""
    found = campaign.integrity
    if found.failing:
        what = counted(len(found.failing), "dataset")
        text = (
            f"DAMAGED OR CHANGED since it was written: {what} of the file do not agree with the checksums, which the "
            "section Limits and warnings names. Nothing in this report that comes from them can be relied upon."
        )
        return [Notice(text)]
    if found.unchecked:
        return [Notice(f"{counted(len(found.unchecked), 'dataset')} of the file have no checksum to be held against.")]
    return []


def _warnings(campaign: Campaign) -> Iterator[str]:
    for event in campaign.record.events:
        stopped = event.kind == "StateChanged" and any(word in event.text for word in ENDINGS)
        if event.kind in GRAVE or stopped:
            minutes, seconds = divmod(event.time, SHORT)
            yield f"{int(minutes)}:{seconds:04.1f} min  {typeset(event.text)}"


def _margins(campaign: Campaign) -> Iterator[Table]:
    """What the preflight foresaw, by limited quantity."""
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
        Column("foreseen"),
        Column("limit"),
        Column("unit", words=True),
        Column("margin", "%"),
        Column("where", words=True),
    ]
    yield Table("The most that the preflight foresaw of every limited quantity", columns, rows)


def _limits(campaign: Campaign) -> Table:
    limits = campaign.configuration.limits if campaign.configuration else None
    rows = [
        [words_of(entry.description) or entry.name, plain(getattr(limits, entry.name)), unit_text(entry.unit)]
        for entry in (declared(type(limits)) if limits is not None else ())
        if isinstance(getattr(limits, entry.name), float)
    ]
    columns = [Column("limit", words=True), Column("value"), Column("unit", words=True)]
    return Table("Limits that the guard enforced", columns, rows)
