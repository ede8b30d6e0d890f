"""Whether a file is what was written: complete, of the declared layout, every dataset with its checksum."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from bench.record import hdf5
from bench.record.checksums import GROUP, of_attributes, of_values
from bench.record.declared import part_of
from bench.record.errors import RecordError, reason
from bench.record.layout import Status
from bench.record.plot import GROUP as PLOT
from bench.record.reader import Record, open_record
from bench.record.superblock import is_let_go

_UNREADABLE = (OSError, RuntimeError, KeyError, ValueError, UnicodeDecodeError)


@dataclass(frozen=True)
class Verdict:
    """How many datasets there are, of how many the values were held against a checksum, and every problem found."""

    datasets: int
    compared: int
    problems: tuple[str, ...]


def verify(path: Path) -> Verdict:
    """Read the whole file and hold it against itself, piece by piece: memory stays bounded.

    Raises InvalidInput for what is no record of ours, RecordError for one that cannot be opened.
    """
    with open_record(path, judging=path.is_file() and not is_let_go(path)) as record:
        try:
            return _judge(record)
        except RecordError as error:
            return Verdict(0, 0, (str(error),))
        except _UNREADABLE as error:
            return Verdict(0, 0, (f"the file is damaged ({reason(error)})",))


def _judge(record: Record) -> Verdict:
    entry = hdf5.group(record.file, "entry")
    stored = {each.name: each for each in hdf5.datasets(entry) if not each.name.startswith(f"/entry/{GROUP}/")}
    problems = list(_ending(record))
    problems += _layout(record, stored)
    known = record.checksums
    if record.format_version > 1:
        problems += [f"{path} is missing" for path in known if path not in stored]
        problems += [f"{path} has no checksum: it was added later" for path in stored if path not in known]
    problems += _changed(record, stored)
    compared = sum(bool(values) for path, (values, _) in known.items() if path in stored)
    return Verdict(len(stored), compared, tuple(problems))


def damage(record: Record) -> tuple[str, ...]:
    """What has a checksum and is no longer there, or no longer as it was when that was made."""
    entry = hdf5.group(record.file, "entry")
    stored = {each.name: each for each in hdf5.datasets(entry)}
    return (*(f"{path} is missing" for path in record.checksums if path not in stored), *_changed(record, stored))


def _changed(record: Record, stored: dict[str, hdf5.Dataset]) -> Iterator[str]:
    for path, (values, attributes) in record.checksums.items():
        if path in stored:
            yield from _compared(stored[path], values, attributes)


def _ending(record: Record) -> Iterator[str]:
    if record.status == Status.RUNNING:
        yield "it was not closed: it is being written, or its writer died; `rockbench file recover` makes a clean file"


def _layout(record: Record, stored: dict[str, hdf5.Dataset]) -> Iterator[str]:
    """What every reader relies upon: the channels, units, lengths, and a default plot that leads somewhere."""
    if not record.channels:
        yield "it has no channel"
    counted, closed = record.counted, record.status != Status.RUNNING
    for path, each in stored.items():
        if each.dtype.kind in "iuf" and not each.attrs.get("units"):
            yield f"{path} has no units"
        rows = counted[part_of(path)] if hdf5.grows(each) else 0
        # in a file that was not closed more rows are rows on their way
        if hdf5.grows(each) and (each.shape[0] < rows or (closed and each.shape[0] > rows)):
            yield f"{path} has {each.shape[0]} rows, {rows} were written"
    plot = hdf5.group(hdf5.group(record.file, "entry"), PLOT)
    named = [plot.attrs.get("signal"), *plot.attrs.get("axes", ())]
    yield from (
        f"the default plot names {name!r}, which is not there" for name in named if name not in plot and name != "."
    )


def _compared(stored: hdf5.Dataset, values: str, attributes: str) -> Iterator[str]:
    try:
        if of_attributes(stored) != attributes:
            yield f"the attributes of {stored.name} are not those that were written"
        if values and of_values(stored) != values:
            yield f"{stored.name} is not what was written: its checksum is wrong"
    except _UNREADABLE as error:
        yield f"{stored.name} cannot be read ({reason(error)})"
