"""The runs of a folder: their data files, and a row of texts for each. Independent of Qt."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import isfinite
from pathlib import Path
from time import time
from typing import Any, cast

from bench.app.catalogue import load_protocol
from bench.app.display import texts
from bench.app.display.point_table import Measured, rows_of, summary_of
from bench.app.display.typography import in_screen_unit, typeset
from bench.app.display.verdict import columns_of
from bench.app.formatting import number
from bench.app.ipc.sessions import running_sessions
from bench.bounded import read_bounded, require_shallow
from bench.datafile.hdf5_reading import UNREADABLE
from bench.datafile.heading import Heading, read_heading
from bench.datafile.layout import Status
from bench.datafile.reader import open_datafile
from bench.document.typography import moment, unit_text
from bench.protocol import Protocol
from bench.results import SUMMARY
from sim.errors import InvalidInput, RockbenchError

DEPTH = 2
"""Number of levels of subfolders that are searched for files."""
MOST = 10_000
"""Largest number of listed files."""
RECENT = 60.0
"""Time since the last change [s] up to which an unclosed file is regarded as being written, because a writer on another
computer is not among the sessions of this one.
"""
UNUSABLE = (RockbenchError, *UNREADABLE)


@dataclass(frozen=True)
class Found:
    """A data file. `changed` is the time of its last change [s since 1970]; `stamp` differs after a change of the file
    and after a summary or a picture was added to its folder; `figures` are the pictures in the folder.
    """

    path: Path
    changed: float
    stamp: tuple[int, ...]
    figures: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Listing:
    """The data files of a folder; `real` is its path with symbolic links resolved."""

    real: Path
    found: tuple[Found, ...]


@dataclass(frozen=True)
class RunRow:
    """Texts of a run. `cells` has one text for each of `texts.RUN_TITLES` after the first, `tips` their tooltips,
    `began` is the start [s since 1970], `usable` is False for a file that cannot be opened, and `figure` is the picture
    of the run, if it has one.
    """

    found: Found
    cells: tuple[str, ...]
    tips: tuple[str, ...]
    began: float
    usable: bool = True
    figure: Path | None = None

    @property
    def stale(self) -> bool:
        """Whether the row states that its run is in progress although the file has not changed recently: the program
        that wrote it may have been killed.
        """
        return self.cells[1] == texts.RUN_GOING and time() - self.found.changed >= RECENT

    @property
    def searched(self) -> str:
        """All texts of the row, in lower case, for a search."""
        return "\n".join((*self.cells, *self.tips)).lower()


def find_runs(folder: Path) -> tuple[Found, ...]:
    """At most `MOST` data files in `folder` and in `DEPTH` levels of subfolders, the most recently changed one first.
    Raises OSError if the folder cannot be read.
    """
    found = list[Found]()
    _find(folder, DEPTH, found)
    return tuple(sorted(found, key=lambda each: each.changed, reverse=True))


def list_runs(folder: Path) -> Listing:
    """The data files as found by `find_runs`. Raises OSError if the folder cannot be read."""
    return Listing(folder.resolve(), find_runs(folder))


def _find(folder: Path, depth: int, found: list[Found]) -> None:
    files, figures, below, summary = list[os.DirEntry[str]](), list[Path](), list[Path](), 0
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith("."):
                continue
            if entry.name.endswith(".h5"):
                files.append(entry)
            elif entry.name.endswith(".png"):
                figures.append(Path(entry.path))
            elif entry.name == SUMMARY:
                summary = 1
            elif depth and entry.is_dir(follow_symlinks=False):
                below.append(Path(entry.path))
    figures.sort()
    for entry in files[: MOST - len(found)]:
        try:
            stat = entry.stat()
        except OSError:
            # the file has been removed since
            continue
        stamp = (stat.st_mtime_ns, stat.st_size, summary, len(figures))
        found.append(Found(Path(entry.path), stat.st_mtime, stamp, tuple(figures)))
    for each in below:
        try:
            _find(each, depth - 1, found)
        except OSError:
            continue


def read_row(found: Found) -> RunRow:
    """The row of a data file. If the file is damaged or does not contain a run, the row states the reason."""
    try:
        heading = read_heading(found.path)
    except InvalidInput as error:
        return _unusable(found, texts.RUN_FOREIGN, error.allowed)
    except UNUSABLE as error:
        return _unusable(found, texts.RUN_DAMAGED, str(error).replace(str(found.path), texts.RUN_FILE))
    metadata = heading.metadata
    status, why = _status(found, heading)
    result, sentence = _result(found, heading)
    specimen = _specimen(metadata)
    cells = (
        metadata.get("protocol", ""),
        status,
        result or typeset(why),
        specimen,
        metadata.get("operator", ""),
        _local(heading.start_time),
        found.path.parent.name or found.path.name,
    )
    tips = (
        cells[0],
        typeset(f"{status}: {why}" if why else status),
        "\n".join(part for part in (sentence or cells[2], metadata.get("notes", "")) if part),
        cells[3],
        cells[4],
        moment(heading.start_time),
        str(found.path),
    )
    return RunRow(found, cells, tips, _seconds(heading.start_time, found.changed), figure=_figure(found, metadata))


def _unusable(found: Found, status: str, why: str) -> RunRow:
    text, name = typeset(why), found.path.parent.name or found.path.name
    changed = _local(datetime.fromtimestamp(found.changed).isoformat())
    cells = ("", status, text, "", "", changed, f"{name}/{found.path.name}")
    return RunRow(found, cells, ("", status, text, "", "", changed, str(found.path)), found.changed, usable=False)


def _status(found: Found, heading: Heading) -> tuple[str, str]:
    if heading.status != Status.RUNNING:
        return heading.status, heading.summary
    folder = found.path.parent.resolve()
    if time() - found.changed < RECENT or any(Path(each.out).resolve() == folder for each in running_sessions()):
        return texts.RUN_GOING, texts.RUN_GOING_WHY
    return texts.RUN_CUT, texts.RUN_CUT_WHY


def _result(found: Found, heading: Heading) -> tuple[str, str]:
    """The main result as a short text and as a sentence; empty without a result."""
    try:
        protocol = load_protocol(heading.metadata.get("protocol", ""))
    except RockbenchError:
        return "", ""
    # results that another program or a newer version has written may be invalid; the row then has no result
    try:
        summary = _summary(found.path.with_name(SUMMARY))
        if (passed := summary.get("passed")) is not None:
            return (texts.RUN_PASSED if passed else texts.RUN_NOT_PASSED), ""
        points = summary["points"] if "points" in summary else _points(found.path)
        columns = columns_of(protocol.point)
        whole = [dict.fromkeys(columns) | dict(point) for point in points]
        return short_result(protocol, rows_of(columns, whole, protocol.view.labels))
    except UNUSABLE:
        return "", ""


def short_result(protocol: Protocol[Any], rows: Sequence[Measured]) -> tuple[str, str]:
    """The main result and the number of results that agree, as a short text, and the verdict from `summary_of`."""
    measured = [row for row in rows if isfinite(row.value)]
    if not measured:
        return "", ""
    wanted = [row for row in measured if row.field == protocol.view.headline] or [
        row for row in measured if row.field == measured[0].field and row.quantity == measured[0].quantity
    ]
    judged = [row for row in rows if row.agrees is not None]
    first = wanted[0]
    if len(wanted) == 1:
        text = f"{first.cells[1]} {first.cells[2]}"
        verdict = "" if first.agrees is None else texts.AGREES if first.agrees else texts.DISAGREES
        return " · ".join(part for part in (text, verdict, first.point) if part), summary_of(rows)
    factor, unit = in_screen_unit(first.unit)
    values = [factor * row.value for row in wanted]
    text = texts.RUN_RANGE.format(
        name=first.quantity,
        low=number(min(values)),
        high=number(max(values)),
        unit="" if unit in ("", "1") else f" {unit_text(unit)}",
        n=len(wanted),
    )
    agree = sum(bool(row.agrees) for row in judged)
    agreeing = texts.RUN_AGREEING.format(agree=agree, judged=len(judged)) if judged else ""
    return " · ".join(part for part in (text, agreeing) if part), summary_of(rows)


def _summary(path: Path) -> Mapping[str, Any]:
    """The summary of a run; empty before it has been written."""
    try:
        found: object = json.loads(read_bounded(path).decode())
        require_shallow(found)
    except FileNotFoundError:
        return {}
    return cast("Mapping[str, Any]", found) if isinstance(found, dict) else {}


def _points(path: Path) -> list[dict[str, Any]]:
    with open_datafile(path, judging=True) as record:
        return record.points


def _figure(found: Found, metadata: Mapping[str, str]) -> Path | None:
    """The first figure in the protocol's list that the run has, else the first picture in its folder, else None."""
    try:
        names = load_protocol(metadata.get("protocol", "")).figures
    except RockbenchError:
        names = ()
    own = (each for name in names for each in found.figures if each.name == name)
    return next(own, found.figures[0] if found.figures else None)


def _specimen(metadata: Mapping[str, str]) -> str:
    """Text with the size of the block, the stiffness of the first storey, and whether they were identified; empty if
    unknown.
    """
    try:
        specimen = json.loads(metadata.get("specimen", "{}"))
        identified = json.loads(metadata.get("configuration", "{}")).get("identified")
        block, frame = specimen["block"], specimen["frame"]
        return texts.RUN_SPECIMEN.format(
            b=2e3 * block["b"],
            h=2e3 * block["h_b"],
            k=frame["k1"],
            how=texts.RUN_IDENTIFIED if identified else texts.RUN_ASSUMED,
        )
    except (*UNREADABLE, AttributeError):
        return ""


def _local(iso: str) -> str:
    """Date and time in the local time zone; `iso` itself if it is not in ISO 8601."""
    try:
        return f"{datetime.fromisoformat(iso).astimezone():%Y-%m-%d %H:%M}"
    except ValueError:
        return iso


def _seconds(iso: str, otherwise: float) -> float:
    try:
        return datetime.fromisoformat(iso).timestamp()
    except ValueError:
        return otherwise
