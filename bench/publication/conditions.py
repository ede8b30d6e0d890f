"""Under which limits the bench ran, what the events of the file warn of, and where everything came from."""

from collections.abc import Iterator, Mapping
from hashlib import file_digest
from typing import Any, cast

from bench.config.declared import declared
from bench.provenance import software
from bench.publication.campaign import Campaign
from bench.publication.numbers import plain
from bench.report.page.document import Column, Listing, Notice, Part, Section, Table

MOST = 40
"""Warnings that are listed; more of the same are counted."""

GRAVE = ("Warned", "LimitExceeded")
ENDINGS = ("-> aborting", "-> halted")
SHORT = 60
"""Seconds of the bench's clock to the minute."""


def limits_section(campaign: Campaign) -> Section:
    """Limits, margins, warnings, operator's hand work."""
    parts: list[Part] = []
    record = campaign.record
    if record.status not in ("completed",):
        parts.append(Notice(f"The campaign did not run to its end: {record.status}. {record.summary}".strip()))
    warnings = list(_warnings(campaign))
    if warnings:
        parts += [f"The events of the file hold {len(warnings)} warnings:", Listing(warnings[:MOST])]
        if len(warnings) > MOST:
            parts.append(f"{len(warnings) - MOST} more stand in the file.")
    else:
        parts.append("No warning was given and no limit was exceeded.")
    parts.append(
        "Limits of the model: a rigid block that neither slides nor flies free, Housner's impact, a shear frame with "
        "linear springs and dashpots, a pure sine. Limits of the measurement: the block is not measured, its motion "
        "is known from the model and from the first storey alone."
    )
    parts += list(_margins(campaign))
    if campaign.configuration is not None:
        parts.append(_limits(campaign))
    return Section("limits", "Limits and warnings", parts)


def provenance_section(campaign: Campaign) -> Section:
    """File, hash, times, versions, bench, parameters."""
    record, made = campaign.record, software()
    with campaign.path.open("rb") as file:
        digest = file_digest(file, "sha256").hexdigest()
    facts: dict[str, str] = {
        "file": campaign.path.name,
        "SHA-256 of the file": digest,
        "title": record.title,
        "protocol": campaign.protocol or "not stated",
        "begun": record.start_time,
        "ended": record.end_time or "not: the file is still written, or its writer was killed",
        "status": f"{record.status}: {record.summary}" if record.summary else record.status,
        "recorded by": record.software,
        "versions when recorded": ", ".join(
            f"{name} {record.metadata[name]}" for name in made if name in record.metadata and name != "rocking-bench"
        ),
        "reported by": ", ".join(f"{name} {version}" for name, version in made.items()),
        "samples": f"{record.rows} of each channel at {record.sample_rate:g} 1/s",
    }
    if "seed" in record.metadata:
        facts["seed of the simulation"] = record.metadata["seed"]
    if "plan_hash" in record.metadata:
        facts["plan hash of the preflight"] = record.metadata["plan_hash"]
    parts: list[Part] = [_facts("Where this report's numbers came from", facts)]
    parts.append(_facts("Parameters of the protocol (SI units)", _flat(campaign.parameters)))
    if campaign.devices:
        parts.append(_facts("The bench", _flat(campaign.devices)))
    alignments = [
        [
            str(run),
            one.sensor,
            f"{1e6 * (one.rate - 1.0):+.1f}",
            f"{1e6 * one.residual:.0f}",
            str(one.values),
            str(one.lost),
        ]
        for run, placed in record.alignments.items()
        for one in placed
    ]
    if alignments:
        columns = [
            Column("run"),
            Column("sensor", words=True),
            Column("clock", "ppm"),
            Column("residual", "µs"),
            Column("values"),
            Column("lost"),
        ]
        parts.append(Table("How sensors with clocks of their own were placed on the sample clock", columns, alignments))
    return Section("provenance", "Provenance", parts)


def _warnings(campaign: Campaign) -> Iterator[str]:
    for event in campaign.record.events:
        stopped = event.kind == "StateChanged" and any(word in event.text for word in ENDINGS)
        if event.kind in GRAVE or stopped:
            minutes, seconds = divmod(event.time, SHORT)
            yield f"{int(minutes)}:{seconds:04.1f} min  {event.text}"


def _margins(campaign: Campaign) -> Iterator[Table]:
    """What the preflight foresaw, by limited quantity."""
    table = campaign.record.tables.get("preflight", {})
    needed = ("quantity", "demand", "limit", "unit", "margin", "where")
    if not set(needed) <= table.keys():
        return
    rows = [
        [str(quantity), plain(demand), plain(limit), str(unit), f"{100.0 * margin:.0f}", str(where)]
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
        [entry.description or entry.name, plain(getattr(limits, entry.name)), entry.unit]
        for entry in (declared(type(limits)) if limits is not None else ())
        if isinstance(getattr(limits, entry.name), float)
    ]
    columns = [Column("limit", words=True), Column("value"), Column("unit", words=True)]
    return Table("Limits that the guard enforced", columns, rows)


def _facts(caption: str, facts: Mapping[str, str]) -> Table:
    rows = [[name, value] for name, value in facts.items()]
    return Table(caption, [Column("item", words=True), Column("value", words=True)], rows)


def _flat(values: Mapping[str, Any]) -> dict[str, str]:
    """Nested values as texts, names joined by dots."""
    flat: dict[str, str] = {}
    for name, value in values.items():
        if isinstance(value, dict):
            flat |= {f"{name}.{key}": text for key, text in _flat(cast(dict[str, Any], value)).items()}
        elif isinstance(value, list):
            flat[name] = ", ".join(str(item) for item in cast(list[Any], value))
        else:
            flat[name] = "–" if value is None else str(value)
    return flat
