"""What a recovered file says of itself: how it ended, what was lost, what was damaged before."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from bench.record import hdf5
from bench.record.declared import COUNTED
from bench.record.errors import RecordError
from bench.record.layout import STATUS_WIDTH, SUMMARY_WIDTH, TIME_WIDTH, Status, create_ends, now
from bench.record.reader import Record

NOTE = "recovery"


@dataclass(frozen=True)
class Recovery:
    """What came of it: the new file, its rows of samples, and how many events and points the journal gave back.

    `lost` are the rows, by part, that were counted in the original and are not in the copy. `damage` names what is
    gone, or differs from its checksum and was copied as it is.
    """

    target: Path
    rows: int
    from_journal: int
    points_from_journal: int
    lost: Mapping[str, int]
    damage: tuple[str, ...] = ()

    @property
    def unreadable(self) -> int:
        """Samples of each channel that were lost."""
        return self.lost.get("samples", 0)

    @property
    def loss(self) -> str:
        """What was lost, in words; empty when nothing was."""
        return ", ".join(f"{count} rows of {part}" for part, count in self.lost.items())


def write_ends(record: Record, path: Path, entry: hdf5.Group, lengths: Mapping[str, int], loss: str) -> None:
    """What is replaced at the end of a run: as it was, or why it is not what the run ended with.

    `lengths` are the rows of every part, `loss` says what is missing.
    """
    complete, status, summary, end_time = create_ends(entry)
    complete[...] = [lengths.get(name, 0) for name in COUNTED]
    was, told, end = (_text(record, name) for name in ("status", "summary", "end_time"))
    if was not in [each.value for each in Status] or was == Status.RUNNING:
        # the last moment at which the dead writer is known to have lived
        end = datetime.fromtimestamp(path.stat().st_mtime).astimezone().isoformat(timespec="milliseconds")
        was, told = Status.INTERRUPTED, "the recording ended without being closed; recovered from what was on the disk"
        told += f", without {loss}" if loss else ""
    elif loss:
        told = f"part of the file was lost: {loss}; the campaign had ended as {was}" + (f": {told}" if told else "")
        was = Status.INTERRUPTED
    for stored, text, width in zip(
        (status, summary, end_time), (was, told, end), (STATUS_WIDTH, SUMMARY_WIDTH, TIME_WIDTH), strict=True
    ):
        hdf5.replace_text(stored, text, width)


def write_note(record: Record, path: Path, entry: hdf5.Group, result: Recovery) -> None:
    """One more line on how the file was rebuilt, and one for everything that was damaged before."""
    told = (
        f"from {path.name} of format {record.format_version}: {result.rows} samples per channel kept,"
        f" {result.loss or 'no rows'} lost, {result.from_journal} events and {result.points_from_journal} points from"
        " the journal"
    )
    before = [f"damaged before: {each}" for each in result.damage]
    note = hdf5.create_group(entry, NOTE, "NXnote")
    hdf5.write_text(note, "date", now())
    hdf5.write_text(note, "description", "\n".join([*record.recoveries, told, *before]))


def _text(record: Record, path: str) -> str:
    try:
        return hdf5.read_text(hdf5.group(record.file, "entry"), path)
    except RecordError:
        return ""
