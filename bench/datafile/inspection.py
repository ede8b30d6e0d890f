"""Verification and overview of the file of a campaign or re-analysis."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.datafile import hdf5
from bench.datafile.checksums import GROUP, added, integrity
from bench.datafile.declared import part_of
from bench.datafile.fields import decode
from bench.datafile.hdf5_reading import UNREADABLE, DataFileError, reason
from bench.datafile.layout import Status
from bench.datafile.opening import ANALYSIS, FORMAT, intact_rows, is_within, open_file
from bench.datafile.reader import DataFile
from bench.datafile.samples import PLOT as PLOT
from bench.datafile.writer import journal_path
from sim.sweep import Done


def file_hash(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def analysis_overview(file: hdf5.File, path: Path) -> dict[str, Any]:
    """Overview of a re-analysis file as JSON content."""
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


def analysis_problems(file: hdf5.File, path: Path) -> Iterator[str]:
    """Problems of a re-analysis file other than wrong checksums: missing checksums, or a changed campaign file."""
    entry = hdf5.group(file, "entry")
    if GROUP not in entry:
        yield "the file has no checksums, like files of older versions; repeat the analysis to write a new file"
    source = hdf5.group(entry, "original")
    if _original(source, path) == "changed":
        yield f"the campaign file {hdf5.read_text(source, 'file')} is not the file that was analysed"


def _original(source: hdf5.Group, path: Path) -> str:
    """State of the analysed campaign file in the same folder: "unchanged", "changed" or "not in the same folder"."""
    beside = path.with_name(Path(hdf5.read_text(source, "file")).name)
    if not beside.is_file():
        return "not in the same folder"
    return "unchanged" if file_hash(beside) == hdf5.read_text(source, "sha256") else "changed"


def overview(path: Path) -> dict[str, Any]:
    """Overview of a campaign or re-analysis file as JSON content; sample values are not included.

    Raises InvalidInput for a file of another kind, and DataFileError for a file that cannot be read.
    """
    with open_file(path, kinds=(FORMAT, ANALYSIS)) as file:
        try:
            heading = {"file": str(path), "bytes": path.stat().st_size, "kind": hdf5.attribute(file, "format")}
            if heading["kind"] == ANALYSIS:
                return heading | analysis_overview(file, path)
            return heading | _content(DataFile(file)) | {"journal": _journal(path)}
        except UNREADABLE as error:
            raise DataFileError(
                f"{path} is damaged ({reason(error)}): `rockbench file recover` restores the readable part"
            ) from error


def _content(record: DataFile) -> dict[str, object]:
    metadata, rows, judged = record.metadata, record.rows, record.integrity()
    given = {name: metadata.get(name) for name in ("protocol", "operator", "notes", "seed", "git", "plan_hash")}
    return {
        "format_version": record.format_version,
        "title": record.title,
        "software": record.software,
        "status": record.status,
        "summary": record.summary,
        "start_time": record.start_time,
        "end_time": record.end_time or None,
        **given,
        "devices": json.loads(metadata.get("devices", "{}")),
        "sample_rate": record.sample_rate,
        "samples": rows,
        "duration": rows / record.sample_rate,
        "channels": [
            {"name": each.name, "quantity": each.quantity, "unit": each.unit, "device": each.device}
            for each in record.channels
        ],
        "runs": [{"number": run.number, "samples": len(run.rows)} for run in record.runs],
        "points": len(record.points),
        "events": record.counted["events"],
        "tables": {name: len(next(iter(table.values())).values) for name, table in record.tables.items() if table},
        "checksums": len(record.checksums),
        "failing": list(judged.failing.values()),
        "unchecked": len(judged.unchecked),
        "recovered": record.recoveries,
    }


def _journal(path: Path) -> str | None:
    beside = journal_path(path)
    return str(beside) if beside.is_file() else None


@dataclass(frozen=True)
class Verdict:
    """Result of a verification: the number of datasets, how many of them match their checksum, and a message for every
    problem.
    """

    datasets: int
    compared: int
    problems: tuple[str, ...]


def verify(path: Path, done: Done = lambda _done, _all: None) -> Verdict:
    """Verify the whole file of a campaign or re-analysis, piece by piece in bounded memory. `done` receives the number
    of datasets processed and the total.

    Raises InvalidInput for a file of another kind, and DataFileError for a file that cannot be opened.
    """
    with open_file(path, judging=None, kinds=(FORMAT, ANALYSIS)) as file:
        try:
            entry = hdf5.group(file, "entry")
            stored = [*hdf5.datasets(entry)]
            if hdf5.attribute(file, "format") == ANALYSIS:
                return _verdict(entry, stored, analysis_problems(file, path), done)
            return _verdict(entry, stored, _of_record(DataFile(file), stored, path.stat().st_size), done)
        except DataFileError as error:
            return Verdict(0, 0, (str(error),))
        except UNREADABLE as error:
            return Verdict(0, 0, (f"the file is damaged ({reason(error)})",))


def _verdict(entry: hdf5.Group, stored: Sequence[hdf5.Dataset], problems: Iterator[str], done: Done) -> Verdict:
    found = [*problems]
    has = hdf5.has(entry, GROUP)
    judged = integrity(entry, None, done)
    found += [*(added(entry, stored) if has else ()), *judged.failing.values()]
    count = sum(not each.name.startswith(f"/entry/{GROUP}/") for each in stored)
    return Verdict(count, judged.compared if has else 0, tuple(found))


def _of_record(record: DataFile, stored: Sequence[hdf5.Dataset], size: int) -> Iterator[str]:
    closed = record.status != Status.RUNNING
    if not closed:
        yield (
            "the file was not closed: it is being written, or its writer crashed; `rockbench file recover` "
            "writes a clean file"
        )
    if not record.channels:
        yield "the file contains no channels"
    entry = hdf5.group(record.file, "entry")
    if record.format_version > 1 and GROUP not in entry:
        yield "the checksums are missing"
    for each in stored:
        yield from _of_layout(each, record.counted, size, closed=closed)
    plot = hdf5.group(entry, PLOT)
    named = [plot.attrs.get("signal"), *plot.attrs.get("axes", ())]
    yield from (
        f"the default plot refers to {name!r}, which does not exist"
        for name in named
        if name not in plot and name != "."
    )


def _of_layout(stored: hdf5.Dataset, counted: Mapping[str, int], size: int, *, closed: bool) -> Iterator[str]:
    """Messages about violations of the layout: missing units, wrong lengths and missing values."""
    path = stored.name
    if stored.dtype.kind in "iuf" and not stored.attrs.get("units"):
        yield f"{path} has no units"
    if not hdf5.grows(stored):
        if not is_within(stored, size):
            yield f"{path} extends beyond the end of the file: it is truncated"
        return
    length, rows = stored.shape[0], counted[part_of(path, counted)]
    # in a file that was not closed, rows beyond the count may be incomplete
    if length < rows or (closed and length > rows):
        yield f"number of rows of {path}: {length}; number counted as complete: {rows}"
    if (there := intact_rows(stored, size)) < min(length, rows):
        yield f"the file has only {there} of the {rows} rows of {path}: it is truncated or damaged"
