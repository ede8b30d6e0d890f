"""The file of a re-analysis, as far as it can be looked into: `bench.replaying.beside` writes it."""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bench.record import hdf5
from bench.record.checksums import GROUP
from bench.record.fields import decode
from bench.record.integrity import integrity


def file_hash(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def overview(file: hdf5.File, path: Path) -> dict[str, Any]:
    """What it holds, ready for JSON."""
    entry = hdf5.group(file, "entry")
    source, process = hdf5.group(entry, "original"), hdf5.group(entry, "process")
    points = hdf5.group(entry, "points")
    judged = integrity(entry)
    return {
        "format_version": int(hdf5.attribute(file, "format_version")),
        "title": hdf5.read_text(entry, "title"),
        "software": f"{hdf5.read_text(process, 'program')} {hdf5.read_text(process, 'version')}",
        "date": hdf5.read_text(process, "date"),
        "settings": json.loads(hdf5.read_text(process, "settings")),
        "points": max((len(decode(hdf5.dataset(points, name))) for name in points), default=0),
        "original": {name: hdf5.read_text(source, name) for name in source},
        "original_is": _original(source, path),
        "checksums": judged.compared + len(judged.failing),
        "failing": list(judged.failing.values()),
    }


def problems(file: hdf5.File, path: Path) -> Iterator[str]:
    """What its checksums do not say: that it has none, or that the campaign's file is no longer the one it is of."""
    entry = hdf5.group(file, "entry")
    if GROUP not in entry:
        yield "it has no checksums: it was written before re-analyses had them; make it anew"
    source = hdf5.group(entry, "original")
    if _original(source, path) == "changed":
        yield f"the file of its campaign, {hdf5.read_text(source, 'file')}, is not the one that was analysed"


def _original(source: hdf5.Group, path: Path) -> str:
    """Whether the file of the campaign beside it is the one that was analysed."""
    beside = path.with_name(Path(hdf5.read_text(source, "file")).name)
    if not beside.is_file():
        return "not beside it"
    return "unchanged" if file_hash(beside) == hdf5.read_text(source, "sha256") else "changed"
