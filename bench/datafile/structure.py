# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false
"""Validation of the structure of an untrusted file before its contents are read.

Values, link targets and external storage are not accessed. Reading the structures that are rejected here could take
hours, exhaust the memory, crash the process, or open other files.
"""

from collections.abc import Sequence
from math import prod
from pathlib import Path
from typing import Any, cast

import h5py
import h5py.h5a
import h5py.h5d
import h5py.h5g
import h5py.h5s

from bench.datafile.findings_tables import FIT_VIEWS
from bench.datafile.hdf5_objects import is_hard_link, stored_member
from bench.datafile.hdf5_reading import UNREADABLE, DataFileError, File

MOST_OBJECTS = 20_000
"""Maximum number of groups and datasets; the file of a long campaign has several hundred."""
DEEPEST = 8
MOST_ATTRIBUTES = 64
LARGEST_ATTRIBUTE = 2**20
LARGEST_CHUNK = 2**25
"""Maximum size of a chunk [bytes]; a chunk is decompressed as a whole."""
LARGEST_VALUE = 2**24
"""Maximum size of one text or number [bytes]."""
UNPACKED = 200
"""Largest ratio of the size of all values to that of the file; constant columns are compressed about a hundredfold."""
SPARE = 2**26
"""Size of values [bytes] that is allowed in addition to the ratio `UNPACKED`, so that small files pass."""
FILTERS = frozenset({1, 2, 3, h5py.h5z.FILTER_LZF})
"""Compression, shuffling and checksum filters built into HDF5, and LZF, which is built into h5py and compresses the
files of format 1; HDF5 would load any other filter as a plug-in."""
KINDS = frozenset("iufSb")
"""NumPy kinds of allowed values: numbers, fixed-length strings, Booleans."""


class _Judge:
    """Check of the objects of a file of `size` bytes, which also counts them and their values."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._objects = 0
        self._values = 0
        self._seen: set[Any] = set()

    def group(self, group: Any, depth: int = 0) -> None:
        """Check a group and all objects below it."""
        path = group.name or "/"
        self._note(group, path)
        if depth > DEEPEST:
            raise DataFileError(f"{path} is nested deeper than {DEEPEST} groups")
        if (members := group.id.get_num_objs()) > MOST_OBJECTS:
            raise DataFileError(f"{path} has {members} members; at most {MOST_OBJECTS} are allowed")
        for name in group:
            try:
                self._member(group, name, f"{path.rstrip('/')}/{name}", depth)
            except DataFileError:
                raise
            except UNREADABLE:
                # damage is handled where the object is read
                continue

    def members(self, root: Any, names: Sequence[str]) -> None:
        """Check the named members of /entry and the objects below them. Raises KeyError for an absent member."""
        if not is_hard_link(root, "entry"):
            raise DataFileError("/entry is a link, which this program never writes")
        entry = stored_member(root, "entry")
        for name in names:
            self._member(entry, name, f"/entry/{name}", 1)

    def _member(self, group: Any, name: str, path: str, depth: int) -> None:
        if not is_hard_link(group, name):
            link = group.get(name, getlink=True)
            if not isinstance(link, h5py.SoftLink):
                raise DataFileError(f"{path} is a link to another file; such links are never followed")
            if not link.path.startswith("/entry/") or "/data/" in link.path:
                raise DataFileError(f"{path} is a link to {link.path!a:.80}, which is not a dataset of the campaign")
            return
        member = stored_member(group, name)
        if isinstance(member, h5py.Group):
            self.group(member, depth + 1)
        elif isinstance(member, h5py.Dataset):
            self._note(member, path)
            self._dataset(member, path)
        else:
            raise DataFileError(f"{path} is neither a group nor a dataset")

    def _note(self, member: Any, path: str) -> None:
        """Count an object. Raises DataFileError if it is linked twice, which could be a cycle."""
        place = h5py.h5g.get_objinfo(member.id).objno
        if place in self._seen:
            raise DataFileError(f"{path} is linked twice, which this program never does")
        self._seen.add(place)
        self._objects += 1
        if self._objects > MOST_OBJECTS:
            raise DataFileError(f"the file has more than {MOST_OBJECTS} objects")
        check_attributes(member, path)

    def _dataset(self, stored: Any, path: str) -> None:
        made, dtype, space = stored.id.get_create_plist(), stored.dtype, stored.id.get_space()
        # other programs may add strings of any length
        known = dtype.kind in KINDS or h5py.check_string_dtype(dtype) is not None
        if not known or dtype.itemsize > LARGEST_VALUE or dtype.subdtype is not None:
            raise DataFileError(f"{path} has values of type {dtype!s:.40}, which this program never writes")
        if space.get_simple_extent_type() == h5py.h5s.NULL:
            raise DataFileError(f"{path} has no values, not even an empty array")
        if len(space.shape) > 2:
            raise DataFileError(f"{path} has the shape {stored.shape}; at most two dimensions are allowed")
        if (layout := made.get_layout()) == h5py.h5d.VIRTUAL:
            self._view(made, path)
            return
        if made.get_external_count():
            raise DataFileError(f"{path} has its values in another file; other files are never read")
        for number in range(made.get_nfilters()):
            if made.get_filter(number)[0] not in FILTERS:
                raise DataFileError(f"{path} is compressed by a filter that this program does not use")
        if layout == h5py.h5d.CHUNKED:
            chunk = dtype.itemsize * prod(made.get_chunk())
            if chunk > LARGEST_CHUNK:
                raise DataFileError(f"{path} has chunks of {chunk} bytes; at most {LARGEST_CHUNK} are allowed")
        self._values += dtype.itemsize * prod(space.shape)
        if self._values > UNPACKED * self._size + SPARE:
            claim = f"the datasets up to {path} declare {self._values} bytes of values in a file of {self._size} bytes"
            raise DataFileError(f"{claim}: the file is truncated or invalid")

    def _view(self, made: Any, path: str) -> None:
        """Raise DataFileError unless a virtual dataset refers only to this file and is in the group of fit views."""
        if not path.startswith(f"/entry/{FIT_VIEWS}/"):
            raise DataFileError(f"{path} is a virtual dataset; only views of fits may be virtual")
        for number in range(made.get_virtual_count()):
            if made.get_virtual_filename(number) != ".":
                raise DataFileError(f"{path} shows values of another file; other files are never read")


def check_attributes(owner: Any, path: str) -> None:
    """Raise DataFileError if there are more or larger attributes than are allowed."""
    if (count := h5py.h5a.get_num_attrs(owner.id)) > MOST_ATTRIBUTES:
        raise DataFileError(f"{path} has {count} attributes; at most {MOST_ATTRIBUTES} are allowed")
    sizes: dict[bytes, int] = {}

    def note(name: bytes, info: Any) -> None:
        sizes[name] = info.data_size

    h5py.h5a.iterate(owner.id, note, info=True)
    for name, size in sizes.items():
        if size > LARGEST_ATTRIBUTE:
            raise DataFileError(
                f"the attribute {name.decode(errors='replace')} of {path} has {size} bytes; at most"
                f" {LARGEST_ATTRIBUTE} are allowed"
            )


def check_structure(file: File, path: Path, only: Sequence[str] = ()) -> None:
    """Raise DataFileError, naming the object, for a structure that this program never writes. If `only` is given, only
    these members of /entry and the objects below them are checked.

    Unreadable members are left to the readers and to recovery.
    """
    root, judge = cast(Any, file), _Judge(path.stat().st_size)
    try:
        if only:
            judge.members(root, only)
        else:
            judge.group(root)
    except DataFileError as error:
        raise DataFileError(f"{path} is not accepted: {error}") from None
    except UNREADABLE:
        return
