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
import h5py.h5
import h5py.h5a
import h5py.h5o
import h5py.h5p
import h5py.h5s
from h5py.h5d import DatasetID
from h5py.h5g import GroupID
from h5py.h5l import TYPE_HARD
from h5py.h5t import IEEE_F32LE, IEEE_F64LE, TypeFloatID, TypeIntegerID, TypeStringID

from bench.datafile.findings_tables import FIT_VIEWS
from bench.datafile.hdf5_objects import decoded, encoded
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
_FLOATS = IEEE_F64LE, IEEE_F32LE


class _Judge:
    """Check of the objects of a file of `size` bytes, which also counts them and their values.

    Objects are represented by h5py's low-level identifiers, since every opening of a file visits all its objects.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._objects = 0
        self._values = 0
        self._seen: set[int] = set()

    def root(self, root: Any) -> None:
        """Check the root group and all objects below it."""
        self._group(root, h5py.h5o.get_info(root).addr, "/", 0)

    def members(self, root: Any, names: Sequence[str]) -> None:
        """Check the named members of /entry and the objects below them. Raises KeyError for an absent member."""
        if root.links.get_info(b"entry").type != TYPE_HARD:
            raise DataFileError("/entry is a link, which this program never writes")
        entry = h5py.h5o.open(root, b"entry")
        for name in map(encoded, names):
            link = entry.links.get_info(name)
            self._member(entry, name, link.u if link.type == TYPE_HARD else None, "/entry", 1)

    def _group(self, group: Any, place: int, path: str, depth: int) -> None:
        """Check a group, whose header is at `place` in the file, and all objects below it."""
        self._note(group, place, path)
        if depth > DEEPEST:
            raise DataFileError(f"{path} is nested deeper than {DEEPEST} groups")
        if (members := group.get_num_objs()) > MOST_OBJECTS:
            raise DataFileError(f"{path} has {members} members; at most {MOST_OBJECTS} are allowed")
        for name, member in _links(group):
            try:
                self._member(group, name, member, path, depth)
            except DataFileError:
                raise
            except UNREADABLE:
                # damage is handled where the object is read
                continue

    def _member(self, group: Any, name: bytes, place: int | None, above: str, depth: int) -> None:
        """Check the member `name` of the group at the path `above`; `place` is None for soft and external links."""
        path = f"{above.rstrip('/')}/{decoded(name)}"
        if place is None:
            link = h5py.Group(group).get(decoded(name), getlink=True)
            if not isinstance(link, h5py.SoftLink):
                raise DataFileError(f"{path} is a link to another file; such links are never followed")
            if not link.path.startswith("/entry/") or "/data/" in link.path:
                raise DataFileError(f"{path} is a link to {link.path!a:.80}, which is not a dataset of the campaign")
            return
        member = h5py.h5o.open(group, name)
        if isinstance(member, DatasetID):
            self._note(member, place, path)
            self._dataset(member, path)
        elif isinstance(member, GroupID):
            self._group(member, place, path, depth + 1)
        else:
            raise DataFileError(f"{path} is neither a group nor a dataset")

    def _note(self, member: Any, place: int, path: str) -> None:
        """Count an object. Raises DataFileError if it is linked twice, which could be a cycle."""
        if place in self._seen:
            raise DataFileError(f"{path} is linked twice, which this program never does")
        self._seen.add(place)
        self._objects += 1
        if self._objects > MOST_OBJECTS:
            raise DataFileError(f"the file has more than {MOST_OBJECTS} objects")
        _check_attributes(member, path)

    def _dataset(self, stored: Any, path: str) -> None:
        made, space = stored.get_create_plist(), stored.get_space()
        size = _value_size(stored.get_type(), path)
        if space.get_simple_extent_type() == h5py.h5s.NULL:
            raise DataFileError(f"{path} has no values, not even an empty array")
        shape = space.get_simple_extent_dims()
        if len(shape) > 2:
            raise DataFileError(f"{path} has the shape {shape}; at most two dimensions are allowed")
        if (layout := made.get_layout()) == h5py.h5d.VIRTUAL:
            self._view(made, path)
            return
        if made.get_external_count():
            raise DataFileError(f"{path} has its values in another file; other files are never read")
        for number in range(made.get_nfilters()):
            if made.get_filter(number)[0] not in FILTERS:
                raise DataFileError(f"{path} is compressed by a filter that this program does not use")
        if layout == h5py.h5d.CHUNKED:
            chunk = size * prod(made.get_chunk())
            if chunk > LARGEST_CHUNK:
                raise DataFileError(f"{path} has chunks of {chunk} bytes; at most {LARGEST_CHUNK} are allowed")
        self._values += size * prod(shape)
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


def _links(group: Any) -> list[tuple[bytes, int | None]]:
    """Name of each member of a group and place of its header in the file, which is None for soft and external links, in
    the order of creation if it is known.
    """
    found: list[tuple[bytes, int | None]] = []

    def note(name: bytes, link: Any) -> None:
        found.append((name, link.u if link.type == TYPE_HARD else None))

    tracked = group.get_create_plist().get_link_creation_order() & h5py.h5p.CRT_ORDER_TRACKED
    group.links.iterate(note, idx_type=h5py.h5.INDEX_CRT_ORDER if tracked else h5py.h5.INDEX_NAME, info=True)
    return found


def _value_size(kind: Any, path: str) -> int:
    """Size of a value of the HDF5 type `kind` [bytes]. Raises DataFileError if the type is not allowed."""
    if isinstance(kind, TypeIntegerID):
        if (size := kind.get_size()) <= 8 and size & (size - 1) == 0:
            return size
    elif isinstance(kind, TypeFloatID):
        if any(kind.equal(usual) for usual in _FLOATS):
            return kind.get_size()
    elif isinstance(kind, TypeStringID) and not kind.is_variable_str() and kind.get_size() <= LARGEST_VALUE:
        return kind.get_size()
    dtype = kind.dtype
    # other programs may add strings of any length
    known = dtype.kind in KINDS or h5py.check_string_dtype(dtype) is not None
    if not known or dtype.itemsize > LARGEST_VALUE or dtype.subdtype is not None:
        raise DataFileError(f"{path} has values of type {dtype!s:.40}, which this program never writes")
    return dtype.itemsize


def check_attributes(owner: Any, path: str) -> None:
    """Raise DataFileError if there are more or larger attributes than are allowed."""
    _check_attributes(owner.id, path)


def _check_attributes(owner: Any, path: str) -> None:
    if (count := h5py.h5a.get_num_attrs(owner)) > MOST_ATTRIBUTES:
        raise DataFileError(f"{path} has {count} attributes; at most {MOST_ATTRIBUTES} are allowed")
    sizes: dict[bytes, int] = {}

    def note(name: bytes, info: Any) -> None:
        sizes[name] = info.data_size

    if count:
        h5py.h5a.iterate(owner, note, info=True)
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
            judge.members(root.id, only)
        else:
            judge.root(root.id)
    except DataFileError as error:
        raise DataFileError(f"{path} is not accepted: {error}") from None
    except UNREADABLE:
        return
