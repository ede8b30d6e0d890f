"""Opens a file: one of ours, of a version that is known, and whole enough to be read."""

import time
from collections.abc import Mapping
from pathlib import Path

from bench.record import hdf5
from bench.record.declared import COUNTED
from bench.record.errors import UNREADABLE, RecordError, reason
from bench.record.extent import check_whole
from bench.record.superblock import is_let_go
from sim.errors import InvalidInput

FORMAT, FORMAT_VERSION = "rocking-bench record", 2
"""The file of a campaign."""

ANALYSIS, ANALYSIS_VERSION = "rocking-bench analysis", 1
"""The file of a re-analysis, beside that of its campaign."""

_VERSIONS = {FORMAT: FORMAT_VERSION, ANALYSIS: ANALYSIS_VERSION}
_ATTEMPTS, _PAUSE = 3, 0.1
"""A file that is being written can be seen with a write on its way; not so many times [s]."""

_HINT = "`rockbench file recover` keeps what it can"


def open_file(path: Path, *, judging: bool = False, kinds: tuple[str, ...] = (FORMAT,)) -> hdf5.File:
    """Open a file of one of these kinds, see `bench.record.reader.open_record`."""
    if path.is_dir():
        raise InvalidInput("record", str(path), "it is a directory; name the file in it")
    if not path.is_file():
        raise InvalidInput("record", str(path), "there is no such file")
    file = _opened(path, judging)
    try:
        _check_format(path, file, kinds)
    except BaseException:
        file.close()
        raise
    return file


def _opened(path: Path, judging: bool) -> hdf5.File:
    try:
        if judging:
            return hdf5.open_to_judge(path)
        if not is_let_go(path):
            _rehearse(path)
        return hdf5.open_to_read(path)
    except PermissionError as error:
        raise InvalidInput("record", str(path), f"it cannot be opened ({error.strerror})") from error
    except UNREADABLE as error:
        if not hdf5.is_hdf5(path):
            raise InvalidInput("record", str(path), "it is not an HDF5 file") from error
        told = f"{path} cannot be read ({reason(error)}): another program holds it, or it is damaged; {_HINT}"
        raise RecordError(told) from error


def _rehearse(path: Path) -> None:
    """Raise what is raised for a damaged file. In single-writer mode HDF5 would try for hours to read it."""
    for left in reversed(range(_ATTEMPTS)):
        try:
            with hdf5.open_to_judge(path) as file:
                if hdf5.attribute(file, "format") == FORMAT:
                    entry = hdf5.group(file, "entry")
                    counted = counts(entry)
                    check_whole(entry, counted, path.stat().st_size)
                return
        except UNREADABLE:
            if not left:
                raise
        time.sleep(_PAUSE)


def counts(entry: hdf5.Group) -> Mapping[str, int]:
    """How many rows of every part are whole; older files have fewer parts, newer ones may have more."""
    stored = [max(0, count) for count in hdf5.read(hdf5.dataset(entry, "complete"), slice(None)).tolist()]
    return dict(zip(COUNTED, [*stored, *[0] * (len(COUNTED) - len(stored))], strict=False))


def _check_format(path: Path, file: hdf5.File, kinds: tuple[str, ...]) -> None:
    try:
        found = {name: file.attrs[name] for name in ("format", "format_version") if name in file.attrs}
    except UNREADABLE as error:
        told = f"{path} is damaged: the attributes of / cannot be read ({reason(error)}); {_HINT}"
        raise RecordError(told) from error
    kind = str(found.get("format"))
    if kind not in _VERSIONS or "format_version" not in found:
        raise InvalidInput("record", str(path), "it is an HDF5 file but no record of rocking-bench")
    try:
        version = int(found["format_version"])
    except (TypeError, ValueError):
        version = 0
    if version < 1:
        told = f"its format {found['format_version']!r} is no version: the file is damaged"
        raise InvalidInput("record", str(path), told)
    if version > _VERSIONS[kind]:
        raise InvalidInput("record", str(path), f"its format {version} is newer than this software reads: update it")
    if kind not in kinds:
        of = hdf5.read_text(file, "entry/original/file")
        raise InvalidInput("record", str(path), f"it is a re-analysis of {of}; name the file of the campaign")
