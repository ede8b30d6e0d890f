"""Fault report from a data file: journal, summary, configuration, versions and the latest data in one archive."""

import io
import json
import re
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any, cast

import numpy as np

from bench.datafile.inspection import overview
from bench.datafile.reader import DataFile, open_datafile
from bench.datafile.writer import journal_path
from bench.events import OperatorNote
from bench.inert import shown
from bench.provenance import software
from bench.results import SUMMARY
from bench.unfinished import write_new

LAST = 60.0
"""Duration of the data taken from the end of the file [s]."""
PERSONAL = frozenset({"operator", "notes", "file", "journal", "by"})
"""Keys whose values contain names of people or paths."""
NOTE = frozenset({"text", "columns"})
"""Keys of a note's journal entry that contain the note."""
REMOVED = "(removed)"
_PATH = re.compile(r"(?:[A-Za-z]:\\|\\\\|/)[^\s\"',;:*?<>|]+")

_NO_PATH = re.compile(r"\w(?:/(?:s2|s|V|Hz\^0\.5|port\d+|line\d+))+[).\]]*")
"""A unit or a digital line, from the last character before its first slash. Any other text with slashes counts as a
path, even if it does not begin with one: relative paths contain names too.
"""


def write_bundle(path: Path, target: Path, *, anonymous: bool) -> tuple[str, ...]:
    """Write the archive `target` for the data file `path`; returns the names of its parts.

    `anonymous` omits names of people, notes and paths. A part that cannot be read is replaced by the reason. Raises
    InvalidInput if `target` exists.
    """
    parts: dict[str, Callable[[], str]] = {
        "overview.json": lambda: _json(overview(path)),
        "versions.json": lambda: _json(software()),
        "configuration.json": lambda: _metadata(path, "configuration"),
        "parameters.json": lambda: _metadata(path, "parameters"),
        "journal.jsonl": lambda: journal_path(path).read_text(encoding="utf-8", errors="replace"),
        SUMMARY: lambda: path.with_name(SUMMARY).read_text(encoding="utf-8", errors="replace"),
        "last-data.csv": lambda: _last_data(path),
    }
    texts = {name: _text(part) for name, part in parts.items()}
    if anonymous:
        names = _personal_names(path)
        texts = {name: anonymised(text, names) for name, text in texts.items()}

    def write(temporary: Path) -> None:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, text in texts.items():
                archive.writestr(name, text)

    write_new(target, write)
    return tuple(texts)


def anonymised(text: str, names: Sequence[str]) -> str:
    """The text without `names`, paths, notes and values of PERSONAL keys. JSON, and lines of JSON, remain valid."""
    try:
        return json.dumps(_without(json.loads(text), names), indent=1, ensure_ascii=False) + "\n"
    except (ValueError, RecursionError):
        return "".join(_anonymised_line(line, names) for line in text.splitlines(keepends=True))


def _anonymised_line(line: str, names: Sequence[str]) -> str:
    if line.startswith("{"):
        with suppress(ValueError, RecursionError):
            return json.dumps(_without(json.loads(line), names), ensure_ascii=False) + "\n"
    return _plain(line, names)


def _without(content: Any, names: Sequence[str]) -> Any:
    """A value of JSON without personal data."""
    if isinstance(content, dict):
        members = cast(dict[str, Any], content)
        hidden = PERSONAL | NOTE if members.get("kind") == OperatorNote.__name__ else PERSONAL
        return {
            key: REMOVED if key in hidden and value not in (None, "") else _without(value, names)
            for key, value in members.items()
        }
    if isinstance(content, list):
        return [_without(each, names) for each in cast(list[Any], content)]
    if isinstance(content, str):
        absolute = PurePosixPath(content).is_absolute() or PureWindowsPath(content).is_absolute()
        return REMOVED if absolute else _plain(content, names)
    return content


def _plain(text: str, names: Sequence[str]) -> str:
    for name in names:
        text = text.replace(name, REMOVED)
    return _PATH.sub(lambda found: REMOVED if _is_path(found) else found[0], text)


def _is_path(found: re.Match[str]) -> bool:
    if _NO_PATH.fullmatch(found.string, max(found.start() - 1, 0), found.end()):
        return False
    return found[0].count("/") > 1 or "\\" in found[0]


def _text(part: Callable[[], str]) -> str:
    try:
        return part()
    except Exception as error:
        # a fault report must not fail because of a damaged part
        return f"not available: {type(error).__name__}: {shown(str(error))}\n"


def _json(content: object) -> str:
    return json.dumps(content, indent=1, default=str) + "\n"


def _metadata(path: Path, name: str) -> str:
    with open_datafile(path) as record:
        return record.metadata[name] + "\n"


def _personal_names(path: Path) -> tuple[str, ...]:
    """Home folder, operator and notes of the run, and all who answered or wrote a note during it."""
    names = [str(Path.home())]
    with suppress(OSError):
        for line in journal_path(path).read_text(encoding="utf-8", errors="replace").splitlines():
            with suppress(ValueError, AttributeError, LookupError, TypeError, RecursionError):
                names += [by] if isinstance(by := json.loads(line)["columns"].get("by"), str) and len(by) > 1 else []
    try:
        with open_datafile(path) as record:
            names += [text for key in ("operator", "notes") if len(text := record.metadata.get(key, "")) > 1]
    except Exception:
        return tuple(dict.fromkeys(names))
    return tuple(dict.fromkeys(names))


def _last_data(path: Path) -> str:
    with open_datafile(path) as record:
        return _as_csv(record)


def _as_csv(record: DataFile) -> str:
    first = max(0, record.rows - round(LAST * record.sample_rate))
    rows = slice(first, record.rows)
    columns = {"time [s]": record.time(rows), "drive [V]": record.drive(rows)}
    columns |= {f"{channel.name} [counts]": record.counts(channel.name, rows) for channel in record.channels}
    text = io.StringIO()
    text.write(",".join(columns) + "\n")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.10g", delimiter=",")
    return text.getvalue()
