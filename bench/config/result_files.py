"""Result files for later runs: identified specimen and laser calibration as versioned JSON."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, cast

from bench.analysis.laser_calibration import LaserCalibration
from bench.bounded import read_bounded, require_shallow
from bench.config.validation import dotted, validated
from bench.provenance import software
from bench.unfinished import write_new
from sim.errors import InvalidInput
from sim.identified import Identified, unit

_HEAD = ("format", "format_version", "software")


@dataclass(frozen=True)
class KeptFile:
    """Kind of result file: `item` is its name in error messages, `remedy` states how to obtain one."""

    item: str
    format: str
    version: int
    remedy: str

    def write(self, path: Path, content: Mapping[str, Any]) -> None:
        """Write header and `content` to a new JSON file. Raises InvalidInput if `path` exists, and RockbenchError if it
        cannot be written; it does not exist then.
        """
        head = dict(zip(_HEAD, (self.format, self.version, software()["rocking-bench"]), strict=True))
        text = json.dumps({**head, **content}, indent=1, ensure_ascii=False, allow_nan=False)
        if path.exists():
            raise InvalidInput(self.item, str(path), "the file exists and is never overwritten")

        def write(unfinished: Path) -> None:
            unfinished.write_text(text + "\n", encoding="utf-8", newline="\n")

        write_new(path, write)

    def read(self, path: Path) -> dict[str, Any]:
        """Contents of a file without its header. Raises InvalidInput if the file cannot be read, or if its format or
        version is not the expected one.
        """
        try:
            data: Any = json.loads(read_bounded(path).decode("utf-8-sig"))
            require_shallow(data)
        except FileNotFoundError:
            raise InvalidInput(self.item, str(path), "there is no such file") from None
        except OSError as error:
            raise InvalidInput(
                self.item, str(path), f"the file cannot be read ({error.strerror}); check its path and permissions"
            ) from None
        except (ValueError, RecursionError) as error:
            raise InvalidInput(self.item, str(path), f"it cannot be read as JSON: {error}") from None
        content = cast(dict[str, Any], data) if isinstance(data, dict) else {}
        if content.get("format") != self.format:
            allowed = f'it is not a {self.item}: its "format" is not "{self.format}"; {self.remedy}'
            raise InvalidInput(self.item, str(path), allowed)
        if (said := content.get("format_version")) != self.version:
            allowed = f"the program reads format version {self.version}, but the file has {said!r}: update this program"
            raise InvalidInput(self.item, str(path), allowed)
        return {key: value for key, value in content.items() if key not in _HEAD}


SPECIMEN_FILE = KeptFile(
    item="specimen file", format="rocking-bench specimen", version=1, remedy="see docs/specimen.md"
)


def write_specimen(path: Path, identified: Identified) -> None:
    """Write a new specimen file in SI units. Raises InvalidInput if `path` exists or cannot be written."""
    plain = identified.model_dump(mode="json")
    findings = [_with_unit(finding) for finding in plain["findings"]]
    SPECIMEN_FILE.write(path, {"findings": findings, "correlations": plain["correlations"]})


def read_specimen(path: Path) -> Identified:
    """The identified properties in a file. Raises InvalidInput naming file and key."""
    return validated(
        Identified, _content(path, SPECIMEN_FILE.read(path)), lambda where: f"{path.name}: {dotted(where)}"
    )


def _content(path: Path, content: dict[str, Any]) -> dict[str, Any]:
    """Findings and correlations of a specimen file, with the units checked and removed."""
    unknown = set(content) - {"findings", "correlations"}
    if unknown:
        raise InvalidInput(f"{path.name}: {min(unknown)}", content[min(unknown)], "there is no such key")
    findings = content.get("findings")
    if isinstance(findings, list):
        findings = [_without_unit(path, place, finding) for place, finding in enumerate(cast(list[Any], findings))]
    return {"findings": findings, "correlations": content.get("correlations", [])}


def _with_unit(finding: dict[str, Any]) -> dict[str, Any]:
    """A finding in the file's format, with its unit after value and uncertainty."""
    name, value, uncertainty, *others = finding.items()
    return dict([name, value, uncertainty, ("unit", unit(finding["name"])), *others])


def _without_unit(path: Path, place: int, finding: Any) -> Any:
    """A finding without its unit. Raises InvalidInput if the unit is not that of the quantity, or if the date has no
    time zone; validation reports other errors.
    """
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
        allowed = 'it must be an ISO 8601 time with a time zone, such as "2026-11-20T09:30:00Z"'
        raise InvalidInput(f"{path.name}: findings[{place}].date", date, allowed)
    return entry


def _has_zone(date: str) -> bool:
    try:
        return datetime.fromisoformat(date).tzinfo is not None
    except ValueError:
        return False


CALIBRATION_FILE = KeptFile(
    item="laser calibration",
    format="rocking-bench laser calibration",
    version=1,
    remedy="`rockbench run laser-calibration` writes one",
)


def write_calibration(path: Path, calibration: LaserCalibration) -> None:
    """Write a new calibration file in SI units. Raises InvalidInput if `path` exists or cannot be written."""
    CALIBRATION_FILE.write(path, calibration.model_dump(mode="json"))


def read_calibration(path: Path) -> LaserCalibration:
    """The calibration in a file. Raises InvalidInput naming file and key."""
    return validated(LaserCalibration, CALIBRATION_FILE.read(path), lambda where: f"{path.name}: {dotted(where)}")
