"""Provenance of a report's numbers: data file, operator, software, parameters, bench and sensor clocks."""

from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from hashlib import file_digest
from typing import Any, cast

from bench.config.declared import declared, flag
from bench.document.campaign import Campaign
from bench.document.document import Column, Part, Section, Table
from bench.document.typography import ABSENT, first_words, moment, plain, typeset, unit_text
from bench.provenance import revision, software
from sim.parameters import Parameters

NAME = "rocking-bench"

SHORT = 10
"""Number of digits of the git hash in the line below the title; the section on provenance gives the full hash."""

UNKNOWN = "unknown"

EXACT = 10
"""Number of significant digits of a printed parameter, enough to reproduce the number as it was typed."""

_DEVICES = {"backend": "kind of bench"}
"""Labels of those entries of a bench description that are not devices."""


def provenance_section(campaign: Campaign, positional: str | None = None) -> Section:
    """Report section on the data file, its hash, operator, software versions, parameters, bench and sensor clocks.

    `positional` is the parameter that the command line accepts as arguments without a flag.
    """
    parts: list[Part] = [
        facts_table("Provenance of the numbers in this report", {**_file(campaign), **_made_with(campaign)}),
        parameters_table("Parameters of the protocol", campaign.parameters_type, campaign.parameters, positional),
    ]
    if campaign.devices:
        devices = {_DEVICES.get(name, name.replace("_", " ")): typeset(text) for name, text in _bench(campaign).items()}
        parts.append(facts_table("The bench", devices))
    parts += _clocks(campaign)
    return Section("provenance", "Provenance", parts)


def provenance_line() -> str:
    """Line below the title: date of the report, program that created it, and definitions of the gains α₂ and α₁."""
    maker = program(software()[NAME], revision(), SHORT)
    units = (
        "α₂ is the ratio of the peak drift of the coupled frame to that of the bare frame, α₁ the same ratio of the "
        "peaks of u₁ (Eq. 10 of the paper)."
    )
    return f"Report created on {moment(datetime.now(UTC).isoformat())} by {maker}. {units}"


def program(version: str, git: str, digits: int = 40) -> str:
    """Name and version of the program with the first `digits` digits of the git hash. A "+" at the end of `git` means
    that files were changed since that commit.
    """
    changed = ", files changed since" if git.endswith("+") else ""
    return f"{NAME} {version}, git {git.removesuffix('+')[:digits]}{changed}"


def libraries(versions: Mapping[str, str]) -> str:
    """Names and versions of the libraries that affect the results."""
    return ", ".join(f"{name} {version}" for name, version in versions.items() if name != NAME)


def _file(campaign: Campaign) -> dict[str, str]:
    record, metadata = campaign.record, campaign.record.metadata
    with campaign.path.open("rb") as file:
        digest = file_digest(file, "sha256").hexdigest()
    facts = {
        "file": campaign.path.name,
        "SHA-256 of the file": digest,
        "title": record.title,
        "protocol": campaign.protocol or "not stated",
        "operator": metadata.get("operator") or "not stated",
        "notes": metadata.get("notes") or "none",
        "started": moment(record.start_time),
        "ended": moment(record.end_time) or "not stated: the file is still being written, or its writer was killed",
        "status": typeset(": ".join(filter(None, (record.status, record.summary)))),
        "samples": f"{record.rows} per channel at {record.sample_rate:g} samples/s",
    }
    if record.recoveries:
        facts["recovered"] = "; ".join(record.recoveries)
    return facts


def _made_with(campaign: Campaign) -> dict[str, str]:
    metadata, made = campaign.record.metadata, software()
    facts = {
        "recorded by": program(campaign.record.software.removeprefix(f"{NAME} "), metadata.get("git", UNKNOWN)),
        "libraries when recorded": libraries({name: metadata[name] for name in made if name in metadata}),
        "reported by": program(made[NAME], revision()),
        "libraries of the report": libraries(made),
    }
    if "seed" in metadata:
        facts["seed of the simulation"] = metadata["seed"]
    if "plan_hash" in metadata:
        facts["plan hash of the preflight"] = metadata["plan_hash"]
    return facts


def _bench(campaign: Campaign) -> dict[str, str]:
    return flat({name: text for name, text in campaign.devices.items() if name != "seed"})


def _clocks(campaign: Campaign) -> list[Part]:
    rows = [
        [
            str(run),
            one.sensor.replace("_", " "),
            f"{1e6 * (one.rate - 1.0):+.1f}",
            f"{1e6 * one.residual:.0f}",
            str(one.values),
            str(one.lost),
        ]
        for run, placed in campaign.record.alignments.items()
        for one in placed
    ]
    columns = [
        Column("run"),
        Column("sensor", words=True),
        Column("clock", "ppm"),
        Column("residual", "µs"),
        Column("values"),
        Column("lost"),
    ]
    return [Table("Sensors with their own clocks: alignment to the sample clock", columns, rows)] if rows else []


def facts_table(caption: str, facts: Mapping[str, str]) -> Table:
    """Table with a row for each fact: item and value."""
    rows = [[name, value] for name, value in facts.items()]
    return Table(caption, [Column("item", words=True), Column("value", words=True)], rows)


def parameters_table(
    caption: str, kind: type[Parameters] | None, values: Mapping[str, Any], positional: str | None = None
) -> Table:
    """Table of parameters with description, option of the command line, value and unit. Parameters that this version
    does not declare come last, with option and value only.
    """
    rows = list(_declared_rows(kind, values, "")) if kind is not None else []
    known = {row[1] for row in rows}
    rows += [[ABSENT, flag(name), text, ""] for name, text in flat(values).items() if flag(name) not in known]
    if positional is not None:
        rows = [[text, "FILE" if option == flag(positional) else option, *rest] for text, option, *rest in rows]
    columns = [
        Column("parameter", words=True),
        Column("option", words=True),
        Column("value", words=True),
        Column("unit", words=True),
    ]
    return Table(caption, columns, rows)


def flat(values: Mapping[str, Any]) -> dict[str, str]:
    """Nested values as a flat mapping of strings; the names of the levels are joined by dots."""
    found: dict[str, str] = {}
    for name, value in values.items():
        if isinstance(value, dict):
            found |= {f"{name}.{key}": text for key, text in flat(cast(dict[str, Any], value)).items()}
        else:
            found[name] = _text(value)
    return found


def _declared_rows(kind: type[Parameters], values: Mapping[str, Any], prefix: str) -> Iterator[list[str]]:
    for entry in declared(kind):
        value = values.get(entry.name)
        if entry.name not in values:
            continue
        if entry.group is not None and isinstance(value, dict):
            yield from _declared_rows(entry.group, cast(dict[str, Any], value), f"{prefix}{entry.name}.")
            continue
        unit = unit_text(entry.unit) if value is not None else ""
        yield [first_words(entry.description) or ABSENT, flag(f"{prefix}{entry.name}"), _text(value), unit]


def _text(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(_text(item) for item in cast(list[Any], value)) or ABSENT
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return plain(value, EXACT)
    return ABSENT if value is None else str(value)
