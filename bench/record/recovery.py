"""A clean file from one whose writer was killed, whose disk was full, or that an older version wrote.

The original is only read. The copy holds what was whole, in today's layout, with its checksums.
"""

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.record import diary, hdf5
from bench.record.checksums import GROUP as CHECKSUMS
from bench.record.checksums import Checksums
from bench.record.copying import copy_attributes, copy_group
from bench.record.declared import COUNTED, part_of
from bench.record.disk import Platter
from bench.record.errors import RecordError, reason
from bench.record.layout import FORMAT_VERSION, STATUS_WIDTH, SUMMARY_WIDTH, TIME_WIDTH, Status, create_ends, now
from bench.record.lost_events import add_lost_events
from bench.record.plot import create_plot
from bench.record.reader import Record, open_record
from bench.record.samples import chunk_of
from bench.record.timeline import Timeline
from bench.record.verification import damage
from sim.errors import InvalidInput

_NOTE = "recovery"
_MADE_ANEW = frozenset(
    f"/entry/{name}" for name in ("complete", "status", "summary", "end_time", "data", CHECKSUMS, _NOTE)
)
_ROWS_TOGETHER = 2**18


@dataclass(frozen=True)
class Recovery:
    """What came of it: the new file, its rows of samples, the rows that were counted but cannot be read, and how many
    events were taken from the journal beside the file. `damage` names what differs from its checksum or is gone: it was
    copied as it is, or not at all."""

    target: Path
    rows: int
    unreadable: int
    from_journal: int
    damage: tuple[str, ...] = ()


def recover(path: Path, target: Path) -> Recovery:
    """Write to `target` what `path` holds.

    Raises InvalidInput when `target` exists or `path` is no record, RecordError when it is too damaged.
    """
    with open_record(path, judging=True) as record:
        unfinished = target.with_name(f"{target.name}.part")
        for taken in (target, unfinished):
            if taken.exists():
                raise InvalidInput("recovered file", str(taken), "the file exists and is never overwritten")
        try:
            result = _rebuild(record, path, unfinished, target)
            os.rename(unfinished, target)
        except (OSError, RuntimeError, KeyError, ValueError, IndexError) as error:
            raise RecordError(f"{path} could not be recovered into {target} ({reason(error)})") from error
        finally:
            with suppress(OSError):
                # where nothing can be written nothing was left behind
                unfinished.unlink(missing_ok=True)
    return result


def _rebuild(record: Record, path: Path, unfinished: Path, target: Path) -> Recovery:
    file = hdf5.create(unfinished)
    try:
        copy_attributes(record.file, file)
        file.attrs["format_version"] = FORMAT_VERSION
        source, entry = hdf5.group(record.file, "entry"), file.create_group("entry", track_order=True)
        counted = record.counted
        copy_group(source, entry, lambda at: counted[part_of(at)], _MADE_ANEW)
        rows = _cut(entry, counted)
        _fill_plot(record, entry, rows)
        from_journal = add_lost_events(entry, list(diary.read(diary.beside(path))))
        result = Recovery(target, rows, counted["samples"] - rows, from_journal, damage(record))
        _write_ends(record, path, entry)
        _write_note(record, path, entry, result)
        Checksums(entry, ())
    finally:
        file.close()
    platter = Platter(unfinished)
    platter.sync()
    platter.close()
    return result


def _cut(entry: hdf5.Group, counted: Mapping[str, int]) -> int:
    """Cut the datasets of each part to the shortest of them, and blocks to those with samples; returns the rows."""
    parts: dict[str, list[hdf5.Dataset]] = {name: [] for name in counted}
    for stored in hdf5.datasets(entry):
        if hdf5.grows(stored):
            parts[part_of(stored.name)].append(stored)
    shortest = {name: min((each.shape[0] for each in stored), default=0) for name, stored in parts.items()}
    begins = hdf5.dataset(entry, "instrument/blocks/row")[: shortest["blocks"]]
    shortest["blocks"] = int(np.searchsorted(begins, shortest["samples"]))
    for name, stored in parts.items():
        for each in stored:
            each.resize((shortest[name],))
    return shortest["samples"]


def _fill_plot(record: Record, entry: hdf5.Group, rows: int) -> None:
    time = create_plot(entry, record.channels, chunk_of(record.sample_rate))
    columns = [hdf5.dataset(entry, f"instrument/blocks/{name}")[:] for name in ("time", "run", "first", "row")]
    timeline, ends = Timeline(record.sample_rate), np.append(columns[-1][1:], rows)[: len(columns[-1])]
    waiting: list[NDArray[np.float64]] = []
    for read, run, first, begin, end in zip(*columns, ends, strict=True):
        waiting.append(timeline.seconds(float(read), int(run), int(first), int(end - begin)))
        if end - time.shape[0] >= _ROWS_TOGETHER or end == rows:
            hdf5.append(time, np.concatenate(waiting))
            waiting.clear()


def _write_ends(record: Record, path: Path, entry: hdf5.Group) -> None:
    """What is replaced at the end of a run: as it was, or how it is when nobody was left to write it."""
    complete, status, summary, end_time = create_ends(entry)
    lengths = {part_of(each.name): each.shape[0] for each in hdf5.datasets(entry) if hdf5.grows(each)}
    complete[...] = [lengths.get(name, 0) for name in COUNTED]
    ends = (record.status, record.summary, record.end_time)
    if record.status == Status.RUNNING:
        # the last moment at which the dead writer is known to have lived
        last = datetime.fromtimestamp(path.stat().st_mtime).astimezone().isoformat(timespec="milliseconds")
        ends = (Status.FAILED, "the recording ended without being closed; recovered from what was on the disk", last)
    for stored, text, width in zip(
        (status, summary, end_time), ends, (STATUS_WIDTH, SUMMARY_WIDTH, TIME_WIDTH), strict=True
    ):
        hdf5.replace_text(stored, text, width)


def _write_note(record: Record, path: Path, entry: hdf5.Group, result: Recovery) -> None:
    told = (
        f"from {path.name} of format {record.format_version}: {result.rows} rows kept, {result.unreadable} unreadable,"
        f" {result.from_journal} events from the journal"
    )
    told = "\n".join([told, *(f"damaged before: {each}" for each in result.damage)])
    note = hdf5.create_group(entry, _NOTE, "NXnote")
    hdf5.write_text(note, "date", now())
    hdf5.write_text(note, "description", "\n".join([*record.recoveries, told]))
