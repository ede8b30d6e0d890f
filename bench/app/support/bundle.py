"""Fault report from a data file: journal, summary, configuration, versions and the latest data in one archive."""

import io
import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bench.datafile.inspection import overview
from bench.datafile.reader import DataFile, open_datafile
from bench.datafile.writer import journal_path
from bench.inert import shown
from bench.provenance import software
from bench.results import SUMMARY
from bench.unfinished import write_new

LAST = 60.0
"""Duration of the data taken from the end of the file [s]."""
PERSONAL = ("operator", "notes", "file", "journal")
"""Keys whose values may contain names of people or paths."""
REMOVED = "(removed)"
_PATH = re.compile(r"(?:[A-Za-z]:\\|\\\\|/)[^\s\"',;:*?<>|]+")


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


def anonymised(text: str, names: tuple[str, ...]) -> str:
    """The text without `names`, paths and the values of PERSONAL keys."""
    for key in PERSONAL:
        text = re.sub(rf'("{key}":\s*)"(?:[^"\\]|\\.)*"', rf'\1"{REMOVED}"', text)
    for name in names:
        text = text.replace(name, REMOVED)
    return _PATH.sub(lambda found: found[0] if found[0].count("/") < 2 and "\\" not in found[0] else REMOVED, text)


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
    names = [str(Path.home())]
    try:
        with open_datafile(path) as record:
            names += [text for key in ("operator", "notes") if len(text := record.metadata.get(key, "")) > 1]
    except Exception:
        return tuple(names)
    return tuple(names)


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
