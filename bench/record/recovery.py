"""A clean file from one whose writer was killed, whose disk was full, that was cut short, or of an old version.

The original is only read. The copy holds what was whole, in today's layout, with its checksums.
"""

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.progress import Progress, counting, silent
from bench.record import diary, fits, hdf5
from bench.record.aftermath import NOTE, Recovery, write_ends, write_note
from bench.record.checksums import GROUP as CHECKSUMS
from bench.record.checksums import Checksums
from bench.record.copying import Copying
from bench.record.cutting import cut
from bench.record.declared import part_of
from bench.record.disk import Platter
from bench.record.errors import UNREADABLE, RecordError, reason
from bench.record.integrity import Integrity
from bench.record.lost_events import add_lost_events
from bench.record.mending import drop_channels, renew_drive, renew_tables
from bench.record.opening import FORMAT, FORMAT_VERSION
from bench.record.plot import create_plot
from bench.record.reader import Record, open_record
from bench.record.samples import chunk_of, read_channels
from bench.record.timeline import Timeline
from bench.unfinished import unfinished
from sim.errors import InvalidInput

_MADE_ANEW = frozenset(
    f"/entry/{name}" for name in ("complete", "status", "summary", "end_time", "data", CHECKSUMS, fits.VIEWS, NOTE)
)
_ROWS_TOGETHER = 2**18


def recover(path: Path, target: Path, progress: Progress = silent) -> Recovery:
    """Write to `target` what `path` holds.

    Raises InvalidInput when `target` exists or `path` is no record, RecordError when it is too damaged.
    """
    with open_record(path, judging=True) as record:
        temporary = target.with_name(f"{target.name}.part")
        for taken in (target, temporary):
            if taken.exists():
                raise InvalidInput("recovered file", str(taken), "the file exists and is never overwritten")
        try:
            with unfinished(temporary):
                result = _rebuild(record, path, temporary, target, progress)
                os.rename(temporary, target)
        except UNREADABLE as error:
            raise RecordError(f"{path} could not be recovered into {target} ({reason(error)})") from error
    return result


def _rebuild(record: Record, path: Path, temporary: Path, target: Path, progress: Progress) -> Recovery:
    judged = record.integrity(None, counting(progress, "comparing the file with its checksums"))
    progress("copying what is whole")
    file = hdf5.create(temporary)
    try:
        copying = Copying(_counted(record, judged), path.stat().st_size, _MADE_ANEW)
        copying.copy(hdf5.group(record.file, "/"), hdf5.group(file, "/"))
        file.attrs["format"], file.attrs["format_version"] = FORMAT, FORMAT_VERSION
        entry = hdf5.group(file, "entry")
        drop_channels(entry, copying.lost)
        _require_channels(entry)
        renew_drive(entry)
        renew_tables(entry, copying.lost)
        cut(entry, copying.counted)
        gone = {at: told for at, told in copying.lost.items() if not _is_made_anew(at)}
        damage = gone | {at: told for at, told in judged.failing.items() if not _is_made_anew(at)}
        events = points = 0
        try:
            events, points = add_lost_events(entry, list(diary.read(diary.beside(path))))
        except RecordError as error:
            damage["journal"] = str(error)
        grown = {each.name: each.shape[0] for each in hdf5.datasets(entry) if hdf5.grows(each)}
        lengths = {part_of(at): rows for at, rows in grown.items()}
        lost = {part: left for part, rows in copying.counted.items() if (left := rows - lengths.get(part, 0)) > 0}
        # a dataset that was cut is not what was written, and that is told already
        damage = {at: told for at, told in damage.items() if at not in grown or part_of(at) not in lost}
        _fill_plot(entry, lengths["samples"])
        result = Recovery(target, lengths["samples"], events, points, lost, tuple(damage.values()))
        write_ends(record, path, entry, lengths, "; ".join(filter(None, (result.loss, *gone.values()))))
        write_note(record, path, entry, result)
        progress("computing the checksums of the new file")
        fits.add_views(entry, fits.whole(entry))
        Checksums(entry, ())
    finally:
        file.close()
    platter = Platter(temporary)
    platter.sync()
    platter.close()
    return result


def _require_channels(entry: hdf5.Group) -> None:
    if not read_channels(hdf5.group(entry, "instrument")):
        raise RecordError("no channel can be read")


def _is_made_anew(path: str) -> bool:
    return any(path == each or path.startswith(f"{each}/") for each in _MADE_ANEW)


def _counted(record: Record, judged: Integrity) -> Mapping[str, int]:
    """The rows that were brought to the disk; if that is not known any more, the length of the datasets."""
    if "/entry/complete" not in judged.failing:
        return record.counted
    lengths = dict.fromkeys(record.counted, 0)
    for stored in hdf5.datasets(hdf5.group(record.file, "entry"), {}):
        if hdf5.grows(stored):
            lengths[part_of(stored.name)] = max(lengths[part_of(stored.name)], stored.shape[0])
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
