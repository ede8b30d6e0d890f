"""Opening of a data file, with checks of kind, version and completeness.

In files of wording version 1 some data exist only in the sentences of the journal, from which `columns_from` extracts
them.
"""

import re
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.datafile import hdf5
from bench.datafile.access import is_let_go
from bench.datafile.declared import FORMER, part_of
from bench.datafile.hdf5_reading import UNREADABLE, DataFileError, reason
from bench.datafile.structure import check_attributes, check_structure
from bench.events import LimitExceeded, OperatorAnswered, SpecimenMounted, StateChanged, Warned
from sim.errors import CauseCode, InvalidInput


def intact_rows(stored: hdf5.Dataset, size: int) -> int:
    """Number of rows before the first chunk that is lost or that extends beyond the first `size` bytes of the file."""
    length, chunk = stored.shape[0], (stored.chunks or (1,))[0]
    places = hdf5.places_of_chunks(stored) if length else {}
    for start in range(0, length, chunk):
        place = places.get(start)
        if place is None or place[0] + place[1] > size:
            return start
    return length


def is_within(stored: hdf5.Dataset, size: int) -> bool:
    """Whether a fixed dataset is stored entirely within the first `size` bytes of the file."""
    place = hdf5.place(stored)
    return place is None or place[0] + place[1] <= size


def check_whole(entry: hdf5.Group, counted: Mapping[str, int], size: int) -> None:
    """Read all metadata, and check that the rows counted as complete are within the file.

    Raises HDF5's exceptions for damage, and DataFileError for rows beyond `size` bytes.
    """
    for stored in hdf5.objects(entry):
        hdf5.attributes(stored)
        if not hdf5.is_dataset(stored):
            continue
        if hdf5.grows(stored):
            whole = intact_rows(stored, size) >= min(counted[part_of(stored.name, counted)], stored.shape[0])
        else:
            whole = is_within(stored, size)
        if not whole:
            raise DataFileError(f"{stored.name} extends beyond the end of the file: the file is truncated")


FORMAT, FORMAT_VERSION = "rocking-bench record", 2
"""Name and version of the format of a campaign file."""

WORDING = 12
"""Version of the sentences in journal and results. Replay compares these sentences only with those of a file of the
same version.
"""

INTERVALS = 13
"""Version of the evaluation of uncertainties, of the least and mean peak of an unsteady motion, and of the predicted
intervals of its peaks. Replay compares them only with those of a file of the same version.
"""

ANALYSIS, ANALYSIS_VERSION = "rocking-bench analysis", 1
"""Name and version of the format of a re-analysis file."""

_VERSIONS = {FORMAT: FORMAT_VERSION, ANALYSIS: ANALYSIS_VERSION}
_ATTEMPTS, _PAUSE = 3, 0.1
"""Number of attempts to open a file, and the pause between them [s]: a read may coincide with a write."""

_HINT = "`rockbench file recover` restores the readable part"


def open_file(
    path: Path, *, judging: bool | None = False, kinds: tuple[str, ...] = (FORMAT,), only: Sequence[str] = ()
) -> hdf5.File:
    """Open a file of one of the `kinds`; see `bench.datafile.reader.open_datafile`. With `judging` None, a file that
    its writer has not closed is opened to be judged. `only` names the members of /entry that the caller reads, so that
    only these are checked; by default, all are.
    """
    if path.is_dir():
        raise InvalidInput("record", str(path), "it is a directory; specify a file in it")
    if not path.is_file():
        raise InvalidInput("record", str(path), "there is no such file")
    file = _opened(path, judging)
    try:
        _check_format(path, file, kinds)
        check_structure(file, path, only)
    except BaseException:
        file.close()
        raise
    return file


def _opened(path: Path, judging: bool | None) -> hdf5.File:
    try:
        if judging or (judging is None and not is_let_go(path)):
            return hdf5.open_to_judge(path)
        if not is_let_go(path):
            _rehearse(path)
        return hdf5.open_to_read(path)
    except PermissionError as error:
        raise InvalidInput("record", str(path), f"it cannot be opened ({error.strerror})") from error
    except UNREADABLE as error:
        if not hdf5.is_hdf5(path):
            raise InvalidInput("record", str(path), "this is not an HDF5 file") from error
        message = f"{path} cannot be read ({reason(error)}): another program has locked it, or it is damaged; {_HINT}"
        raise DataFileError(message) from error


def _rehearse(path: Path) -> None:
    """Raise an exception if the file is damaged; in single-writer mode HDF5 would try for hours to read it."""
    for left in reversed(range(_ATTEMPTS)):
        try:
            with hdf5.open_to_judge(path) as file:
                check_attributes(file, "/")
                if hdf5.attribute(file, "format") == FORMAT:
                    check_structure(file, path)
                    entry = hdf5.group(file, "entry")
                    counted = counts(entry)
                    check_whole(entry, counted, path.stat().st_size)
                return
        except UNREADABLE:
            if not left:
                raise
        time.sleep(_PAUSE)


def counts(entry: hdf5.Group) -> Mapping[str, int]:
    """Number of complete rows of every part; older files do not name the parts and may have fewer."""
    complete = hdf5.dataset(entry, "complete")
    stored = [max(0, count) for count in hdf5.read(complete, slice(None)).tolist()]
    names = str(complete.attrs["parts"]).split() if "parts" in complete.attrs else FORMER
    return dict.fromkeys(FORMER, 0) | dict(zip(names, stored, strict=False))


def _check_format(path: Path, file: hdf5.File, kinds: tuple[str, ...]) -> None:
    try:
        check_attributes(file, "/")
        found = {name: file.attrs[name] for name in ("format", "format_version") if name in file.attrs}
    except UNREADABLE as error:
        message = f"{path} is damaged: the attributes of / cannot be read ({reason(error)}); {_HINT}"
        raise DataFileError(message) from error
    kind = str(found.get("format"))
    if kind not in _VERSIONS or "format_version" not in found:
        raise InvalidInput("record", str(path), "this is an HDF5 file, but not a data file of rocking-bench")
    try:
        version = int(found["format_version"])
    except (TypeError, ValueError):
        version = 0
    if version < 1:
        message = f"its format version {found['format_version']!r} is invalid: the file is damaged"
        raise InvalidInput("record", str(path), message)
    if version > _VERSIONS[kind]:
        raise InvalidInput("record", str(path), f"its format version {version} is newer: update this software")
    if kind not in kinds:
        of = hdf5.read_text(file, "entry/original/file")
        raise InvalidInput("record", str(path), f"this is a re-analysis of {of}; specify the campaign file")


Columns = dict[str, Any]

_STATE = re.compile(r"^(?P<before>[^:]+) -> (?P<after>[^:]+): (?P<reason>.*)$", re.DOTALL)
_REQUESTED = re.compile(r"^(stop|abort|halt) was asked for")
_OPENED = re.compile(r"^(.+?) opened(?:;|$)")
_ANSWER = re.compile(r"\(answered by (.+)\)$")
_SPRING = re.compile(r"beta = (\S+)$")
_TIMING = ("delay of a block of samples", "difference of the clocks")
_TWIN_BEHIND = "the twin did not keep up, and is off until the rig is armed again"


def columns_from(kind: str, text: str) -> Columns:
    """The columns of a journal entry that replay needs, under the names used in later files."""
    read = _READERS.get(kind)
    return {} if read is None else read(text)


def _state_changed(text: str) -> Columns:
    found = _STATE.search(text)
    if found is None:
        return {}
    columns: Columns = found.groupdict()
    if requested := _REQUESTED.search(columns["reason"]):
        return columns | {"code": CauseCode.REQUEST, "subject": requested.group(1)}
    if columns["after"] == "halted" and (opened := _OPENED.search(columns["reason"])):
        return columns | {"code": CauseCode.SAFETY_INPUT, "subject": opened.group(1)}
    return columns


def _answered(text: str) -> Columns:
    found = _ANSWER.search(text)
    return {"by": found.group(1) if found else "operator"}


def _mounted(text: str) -> Columns:
    found = _SPRING.search(text)
    return {"beta": float(found[1]) if found else None}


_READERS: dict[str, Callable[[str], Columns]] = {
    StateChanged.__name__: _state_changed,
    OperatorAnswered.__name__: _answered,
    LimitExceeded.__name__: lambda text: {"timing": text.startswith(_TIMING)},
    SpecimenMounted.__name__: _mounted,
    Warned.__name__: lambda text: {"realtime": text.startswith(_TWIN_BEHIND)},
}
