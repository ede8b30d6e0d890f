"""Recovery of a valid file from one that has an old format or was truncated, or whose writer was killed or ran out of
disk space.

The original is not changed. The copy contains the intact data in the current layout, with checksums.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.datafile import hdf5
from bench.datafile.checksums import GROUP as CHECKSUMS
from bench.datafile.checksums import Checksums, Integrity
from bench.datafile.copying import Copying, cut, drop_channels, renew_drive, renew_tables
from bench.datafile.declared import ENTRY_PATHS, part_of
from bench.datafile.fields import field_of
from bench.datafile.findings_tables import FIT_VIEWS, add_fit_views, whole_fits
from bench.datafile.hdf5_reading import UNREADABLE, DataFileError, reason
from bench.datafile.held import FileSync
from bench.datafile.layout import STATUS_WIDTH, SUMMARY_WIDTH, TIME_WIDTH, Status, create_ends, now
from bench.datafile.opening import FORMAT, FORMAT_VERSION
from bench.datafile.reader import DataFile, open_datafile
from bench.datafile.samples import Timeline, chunk_of, create_plot, read_channels
from bench.datafile.writer import journal_path, read_journal
from bench.progress import Progress, counting, silent
from bench.unfinished import finish, unfinished
from sim.errors import InvalidInput

Row = Mapping[str, Any]


def add_lost_events(entry: hdf5.Group, lines: Sequence[Row]) -> tuple[int, int]:
    """Append the rows that only the journal contains to the tables of events, of points and of individual event types.
    Returns the numbers of added events and points.

    Points are checked separately, because a point can be missing although its event is present. Raises DataFileError,
    without appending, if the journal is damaged or differs from the stored rows, as that of another file would.
    """
    points = [line["point"] for line in lines if "point" in line]
    events = _beyond(hdf5.group(entry, "events"), lines, ("time", "kind"))
    results = _beyond(hdf5.group(entry, "points"), points)
    columns: list[tuple[hdf5.Dataset, NDArray[Any]]] = []
    rows = defaultdict[str, list[Row]](list)
    for line in lines:
        if "columns" in line and (path := line.get("table", ENTRY_PATHS.get(line["kind"]))) is not None:
            rows[path].append(line["columns"])
    for path, values in rows.items():
        if hdf5.has(entry, path):
            columns += _beyond(hdf5.group(entry, path), values)
    for stored, values in (*events, *results, *columns):
        hdf5.append(stored, values)
    return max((len(values) for _, values in events), default=0), max((len(values) for _, values in results), default=0)


def _beyond(
    table: hdf5.Group, rows: Sequence[Row], compared: Sequence[str] | None = None
) -> list[tuple[hdf5.Dataset, NDArray[Any]]]:
    """Each dataset of a table with the journal's values to append to it. Raises DataFileError unless the earlier rows
    of the journal equal those of the table in the `compared` datasets (by default all).
    """
    new: list[tuple[hdf5.Dataset, NDArray[Any]]] = []
    for name in table:
        stored = hdf5.dataset(table, name)
        known, field = hdf5.read(stored, slice(None)), field_of(name, stored)
        try:
            values = np.array([field.encode(row.get(name)) for row in rows], dtype=field.dtype)
        except UNREADABLE as error:
            raise DataFileError(f"the journal is damaged: it has no valid {name} for {table.name}") from error
        if compared is None or name in compared:
            early = values[: len(known)]
            # JSON has no NaN or infinity: a number missing from the journal therefore counts as equal
            same = (early == known[: len(early)]) | ((early != early) if early.dtype.kind == "f" else False)
            if not np.all(same):
                raise DataFileError(
                    f"journal and file differ in {stored.name}: the journal may be that of another file"
                )
        new.append((stored, values[len(known) :]))
    return new


NOTE = "recovery"


@dataclass(frozen=True)
class Recovery:
    """Result of a recovery: the new file, its number of rows of samples, and the numbers of events and points added
    from the journal.

    `lost` is the number of rows of each part of the file that were written to the original but are missing from the
    copy. `damage` describes objects that are missing, or that were copied although they do not match their checksum.
    """

    target: Path
    rows: int
    from_journal: int
    points_from_journal: int
    lost: Mapping[str, int]
    damage: tuple[str, ...] = ()

    @property
    def unreadable(self) -> int:
        """Number of lost samples per channel."""
        return self.lost.get("samples", 0)

    @property
    def loss(self) -> str:
        """Description of the losses; empty if there are none."""
        return ", ".join(f"{count} {'row' if count == 1 else 'rows'} of {part}" for part, count in self.lost.items())


def write_ends(record: DataFile, path: Path, entry: hdf5.Group, lengths: Mapping[str, int], loss: str) -> None:
    """Write the row counts `lengths` by part, and status, summary and end time: those of the original or, if it was not
    closed or lost data, values that state this.

    `loss` describes the missing data.
    """
    complete, status, summary, end_time = create_ends(entry, tuple(record.counted))
    hdf5.overwrite(complete, [lengths.get(name, 0) for name in record.counted])
    was, why, end = (_text(record, name) for name in ("status", "summary", "end_time"))
    if was not in [each.value for each in Status] or was == Status.RUNNING:
        # the last modification, as the end of the crashed writer's activity
        end = datetime.fromtimestamp(path.stat().st_mtime).astimezone().isoformat(timespec="milliseconds")
        was, why = Status.INTERRUPTED, "the recording ended without being closed; recovered from the data on the disk"
        why += f", without {loss}" if loss else ""
    elif loss:
        why = f"part of the file was lost: {loss}; the campaign ended with status {was}" + (f": {why}" if why else "")
        was = Status.INTERRUPTED
    for stored, text, width in zip(
        (status, summary, end_time), (was, why, end), (STATUS_WIDTH, SUMMARY_WIDTH, TIME_WIDTH), strict=True
    ):
        hdf5.replace_text(stored, text, width)


def write_note(record: DataFile, path: Path, entry: hdf5.Group, result: Recovery) -> None:
    """Add a note: the lines of earlier recoveries, a line about this recovery, and a line for each damaged object."""
    recovered = (
        f"from {path.name} of format {record.format_version}: {result.rows} samples per channel kept,"
        f" {result.loss or 'no rows'} lost; rows from the journal: {result.from_journal} of events,"
        f" {result.points_from_journal} of points"
    )
    before = [f"damaged before: {each}" for each in result.damage]
    note = hdf5.create_group(entry, NOTE, "NXnote")
    hdf5.write_text(note, "date", now())
    hdf5.write_text(note, "description", "\n".join([*record.recoveries, recovered, *before]))


def _text(record: DataFile, path: str) -> str:
    try:
        return hdf5.read_text(hdf5.group(record.file, "entry"), path)
    except DataFileError:
        return ""


_RENEWED = frozenset(
    f"/entry/{name}" for name in ("complete", "status", "summary", "end_time", "data", CHECKSUMS, FIT_VIEWS, NOTE)
)
_ROWS_TOGETHER = 2**18


def recover(path: Path, target: Path, progress: Progress = silent) -> Recovery:
    """Recover the contents of `path` into the new file `target`.

    Raises InvalidInput if `target` exists or `path` is not a data file, and DataFileError if the file is too damaged.
    """
    with open_datafile(path, judging=True) as record:
        temporary = target.with_name(f"{target.name}.part")
        for taken in (target, temporary):
            if taken.exists():
                raise InvalidInput(
                    "recovered file", str(taken), "the file exists and is never overwritten; choose another name"
                )
        try:
            with unfinished(temporary):
                result = _rebuild(record, path, temporary, target, progress)
                finish(temporary, target)
        except UNREADABLE as error:
            raise DataFileError(f"{path} could not be recovered into {target} ({reason(error)})") from error
    return result


def _rebuild(record: DataFile, path: Path, temporary: Path, target: Path, progress: Progress) -> Recovery:
    judged = record.integrity(None, counting(progress, "verifying the checksums"))
    progress("copying the intact data")
    file = hdf5.create(temporary)
    try:
        copying = Copying(_counted(record, judged), path.stat().st_size, _RENEWED)
        copying.copy(hdf5.group(record.file, "/"), hdf5.group(file, "/"))
        file.attrs["format"], file.attrs["format_version"] = FORMAT, FORMAT_VERSION
        entry = hdf5.group(file, "entry")
        drop_channels(entry, copying.lost)
        _require_channels(entry)
        renew_drive(entry)
        lines = list(read_journal(journal_path(path)))
        renew_tables(entry, copying.lost, record.own_tables, lines)
        growing = [each for each in hdf5.datasets(entry) if hdf5.grows(each)]
        cut(entry, growing, copying.counted)
        gone = {at: damaged for at, damaged in copying.lost.items() if not _is_renewed(at)}
        damage = gone | {at: damaged for at, damaged in judged.failing.items() if not _is_renewed(at)}
        events = points = 0
        try:
            events, points = add_lost_events(entry, lines)
        except DataFileError as error:
            damage["journal"] = str(error)
        grown = {each.name: each.shape[0] for each in growing}
        parts = {at: part_of(at, copying.counted) for at in grown}
        lengths = {parts[at]: rows for at, rows in grown.items()}
        lost = {part: left for part, rows in copying.counted.items() if (left := rows - lengths.get(part, 0)) > 0}
        # a truncated dataset differs from its checksum, but its loss has already been reported
        damage = {at: damaged for at, damaged in damage.items() if at not in grown or parts[at] not in lost}
        _fill_plot(entry, lengths["samples"])
        result = Recovery(target, lengths["samples"], events, points, lost, tuple(damage.values()))
        write_ends(record, path, entry, lengths, "; ".join(filter(None, (result.loss, *gone.values()))))
        write_note(record, path, entry, result)
        progress("computing the checksums of the new file")
        add_fit_views(entry, whole_fits(entry))
        Checksums(entry, ())
    finally:
        file.close()
    file_sync = FileSync(temporary)
    file_sync.sync()
    file_sync.close()
    return result


def _require_channels(entry: hdf5.Group) -> None:
    if not read_channels(hdf5.group(entry, "instrument")):
        raise DataFileError("no channel can be read")


def _is_renewed(path: str) -> bool:
    return any(path == each or path.startswith(f"{each}/") for each in _RENEWED)


def _counted(record: DataFile, judged: Integrity) -> Mapping[str, int]:
    """Number of complete rows of each part or, if the stored numbers are damaged, the length of its longest dataset."""
    if "/entry/complete" not in judged.failing:
        return record.counted
    lengths = dict.fromkeys(record.counted, 0)
    for stored in hdf5.datasets(hdf5.group(record.file, "entry"), {}):
        if hdf5.grows(stored):
            part = part_of(stored.name, lengths)
            lengths[part] = max(lengths[part], stored.shape[0])
    return lengths


def _fill_plot(entry: hdf5.Group, rows: int) -> None:
    instrument = hdf5.group(entry, "instrument")
    rate, channels = float(hdf5.read(hdf5.dataset(instrument, "sample_rate"))), read_channels(instrument)
    time = create_plot(entry, channels, chunk_of(rate))
    columns = [hdf5.dataset(instrument, f"blocks/{name}")[:] for name in ("time", "run", "first", "row")]
    timeline, ends = Timeline(rate), np.append(columns[-1][1:], rows)[: len(columns[-1])]
    waiting: list[NDArray[np.float64]] = []
    for read, run, first, begin, end in zip(*columns, ends, strict=True):
        waiting.append(timeline.seconds(float(read), int(run), int(first), int(end - begin)))
        if end - time.shape[0] >= _ROWS_TOGETHER or end == rows:
            hdf5.append(time, np.concatenate(waiting))
            waiting.clear()
