"""The specimen file: what has been identified of a specimen, kept for later predictions and campaigns."""

from datetime import datetime
from pathlib import Path
from typing import Any, cast

from bench.config.kept_file import KeptFile
from bench.config.validation import dotted, validated
from sim.errors import InvalidInput
from sim.identified import Identified, unit

FILE = KeptFile(item="specimen file", format="rocking-bench specimen", version=1, remedy="see docs/specimen.md")


def write_specimen(path: Path, identified: Identified) -> None:
    """Write a new file: JSON, SI units. Raises InvalidInput when `path` exists or cannot be written."""
    plain = identified.model_dump(mode="json")
    findings = [_with_unit(finding) for finding in plain["findings"]]
    FILE.write(path, {"findings": findings, "correlations": plain["correlations"]})


def read_specimen(path: Path) -> Identified:
    """What a file says is identified. Raises InvalidInput naming file and key."""
    return validated(Identified, _content(path, FILE.read(path)), lambda where: f"{path.name}: {dotted(where)}")


def _content(path: Path, content: dict[str, Any]) -> dict[str, Any]:
    """Findings and correlations, the units checked and taken off."""
    unknown = set(content) - {"findings", "correlations"}
    if unknown:
        raise InvalidInput(f"{path.name}: {min(unknown)}", content[min(unknown)], "there is no such key")
    findings = content.get("findings")
    if isinstance(findings, list):
        findings = [_without_unit(path, place, finding) for place, finding in enumerate(cast(list[Any], findings))]
    return {"findings": findings, "correlations": content.get("correlations", [])}


def _with_unit(finding: dict[str, Any]) -> dict[str, Any]:
    """A finding as the file holds it: its unit after its numbers."""
    name, value, uncertainty, *others = finding.items()
    return dict([name, value, uncertainty, ("unit", unit(finding["name"])), *others])


def _without_unit(path: Path, place: int, finding: Any) -> Any:
    """A finding without its unit, which must be that of its quantity. Whatever else is wrong is left as it is."""
    if not isinstance(finding, dict):
        return finding
    entry = dict(cast(dict[str, Any], finding))
    said, name = entry.pop("unit", None), entry.get("name")
    try:
        wanted = unit(name) if isinstance(name, str) else said
    except InvalidInput:
        return entry
    if said != wanted:
        allowed = f'the unit of {name} is "{wanted}": convert value and uncertainty'
        raise InvalidInput(f"{path.name}: findings[{place}].unit", said, allowed)
    if isinstance(date := entry.get("date"), str) and not _has_zone(date):
        allowed = 'it must be ISO 8601 with time zone, such as "2026-11-20T09:30:00Z"'
        raise InvalidInput(f"{path.name}: findings[{place}].date", date, allowed)
    return entry


def _has_zone(date: str) -> bool:
    try:
        return datetime.fromisoformat(date).tzinfo is not None
    except ValueError:
        return False
