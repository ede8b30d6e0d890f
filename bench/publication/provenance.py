"""Provenance of a report's numbers: file, people, software, parameters, bench, clocks."""

from collections.abc import Mapping
from datetime import UTC, datetime
from hashlib import file_digest

from bench.provenance import revision, software
from bench.publication.campaign import Campaign
from bench.publication.facts import facts_table, flat, parameters_table
from bench.publication.typography import moment, typeset
from bench.report.page.document import Column, Part, Section, Table

NAME = "rocking-bench"

SHORT = 10
"""Digits of the git hash below the title; the provenance has all."""

UNKNOWN = "unknown"

_DEVICES = {"backend": "kind of bench", "seed": "seed of every random number"}
"""What entries of a bench are called, where it is not by the device's name."""


def provenance_section(campaign: Campaign) -> Section:
    """File, hash, times, people, versions, bench, parameters."""
    parts: list[Part] = [
        facts_table("Where this report's numbers came from", {**_file(campaign), **_made_with(campaign)}),
        parameters_table("Parameters of the protocol", campaign.asked, campaign.parameters),
    ]
    if campaign.devices:
        devices = {_DEVICES.get(name, name.replace("_", " ")): typeset(text) for name, text in _bench(campaign).items()}
        parts.append(facts_table("The bench", devices))
    parts += _clocks(campaign)
    return Section("provenance", "Provenance", parts)


def provenance_line() -> str:
    """Line below the title: date and program of the report, definition of its gains."""
    maker = program(software()[NAME], revision(), SHORT)
    units = "α₂ is the peak drift of the coupled frame over that of the bare one, α₁ the same of u₁ (Eq. 10)."
    return f"Report made on {moment(datetime.now(UTC).isoformat())} by {maker}. {units}"


def program(version: str, git: str, digits: int = 40) -> str:
    """A version of this program with `digits` of its git hash; "+" says that files had changed since."""
    changed = ", files changed since" if git.endswith("+") else ""
    return f"{NAME} {version}, git {git.removesuffix('+')[:digits]}{changed}"


def libraries(versions: Mapping[str, str]) -> str:
    """Versions of what numbers depend on besides this program."""
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
        "begun": moment(record.start_time),
        "ended": moment(record.end_time) or "not: the file is still written, or its writer was killed",
        "status": typeset(": ".join(filter(None, (record.status, record.summary)))),
        "samples": f"{record.rows} of each channel at {record.sample_rate:g} samples/s",
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
    return (
        [Table("How sensors with clocks of their own were placed on the sample clock", columns, rows)] if rows else []
    )
