"""Whether a file is what was written: complete, of the declared layout, everything with its checksum."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from bench.record import hdf5, reanalysis
from bench.record.checksums import GROUP
from bench.record.declared import part_of
from bench.record.errors import UNREADABLE, RecordError, reason
from bench.record.extent import intact_rows, is_within
from bench.record.integrity import added, integrity
from bench.record.layout import Status
from bench.record.opening import ANALYSIS, FORMAT, open_file
from bench.record.plot import GROUP as PLOT
from bench.record.reader import Record
from bench.record.superblock import is_let_go
from sim.sweep import Done


@dataclass(frozen=True)
class Verdict:
    """How many datasets there are, of how many the values were held against a checksum, and every problem found."""

    datasets: int
    compared: int
    problems: tuple[str, ...]


def verify(path: Path, done: Done = lambda _done, _all: None) -> Verdict:
    """Read the whole file, of a campaign or a re-analysis, and hold it against itself piece by piece: memory stays
    bounded. `done` counts the datasets.

    Raises InvalidInput for what is no record of ours, RecordError for one that cannot be opened.
    """
    judging = path.is_file() and not is_let_go(path)
    with open_file(path, judging=judging, kinds=(FORMAT, ANALYSIS)) as file:
        try:
            if hdf5.attribute(file, "format") == ANALYSIS:
                return _verdict(hdf5.group(file, "entry"), reanalysis.problems(file, path), done)
            record = Record(file)
            return _verdict(hdf5.group(file, "entry"), _of_record(record, path.stat().st_size), done)
        except RecordError as error:
            return Verdict(0, 0, (str(error),))
        except UNREADABLE as error:
            return Verdict(0, 0, (f"the file is damaged ({reason(error)})",))


def _verdict(entry: hdf5.Group, problems: Iterator[str], done: Done) -> Verdict:
    found = [*problems]
    has = hdf5.has(entry, GROUP)
    judged = integrity(entry, None, done)
    found += [*(added(entry) if has else ()), *judged.failing.values()]
    stored = [each for each in hdf5.datasets(entry) if not each.name.startswith(f"/entry/{GROUP}/")]
    return Verdict(len(stored), judged.compared if has else 0, tuple(found))


def _of_record(record: Record, size: int) -> Iterator[str]:
    closed = record.status != Status.RUNNING
    if not closed:
        yield "it was not closed: it is being written, or its writer died; `rockbench file recover` makes a clean file"
    if not record.channels:
        yield "it has no channel"
    entry = hdf5.group(record.file, "entry")
    if record.format_version > 1 and GROUP not in entry:
        yield "its checksums are missing"
    for stored in hdf5.datasets(entry):
        yield from _of_layout(stored, record.counted, size, closed=closed)
    plot = hdf5.group(entry, PLOT)
    named = [plot.attrs.get("signal"), *plot.attrs.get("axes", ())]
    yield from (
        f"the default plot names {name!r}, which is not there" for name in named if name not in plot and name != "."
    )


def _of_layout(stored: hdf5.Dataset, counted: Mapping[str, int], size: int, *, closed: bool) -> Iterator[str]:
    """What every reader relies upon: units, lengths, and values that are in the file."""
    path = stored.name
    if stored.dtype.kind in "iuf" and not stored.attrs.get("units"):
        yield f"{path} has no units"
    if not hdf5.grows(stored):
        if not is_within(stored, size):
            yield f"{path} lies beyond the end of the file: it is truncated"
        return
    length, rows = stored.shape[0], counted[part_of(path)]
    # in a file that was not closed more rows are rows on their way
    if length < rows or (closed and length > rows):
        yield f"{path} has {length} rows, {rows} were written"
    if (there := intact_rows(stored, size)) < min(length, rows):
        yield f"{path} has only {there} of {rows} rows in the file: it is truncated or damaged"
