# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false
"""Access to members and attributes through h5py's low-level interface, in a third of the time of its
dictionary-like interface.

A file has about 200 objects and 600 attributes, which are read whenever it is opened.
"""

from typing import Any

import h5py
import h5py.h5a
import h5py.h5d
import h5py.h5g
import h5py.h5l
import h5py.h5o
import h5py.h5s
import h5py.h5t
import numpy as np

_TEXT = h5py.string_dtype()
_TEXT_HELD = h5py.h5t.py_create(_TEXT)
_NUMBERS = tuple((h5py.h5t.py_create(dtype), dtype) for dtype in map(np.dtype, ("<i1", "<f8", "<i8")))


def is_hard_link(parent: Any, name: str) -> bool:
    """Whether the member `name` is an object stored in the file, not a soft or external link. Raises KeyError if there
    is no such member.
    """
    return parent.id.links.get_info(encoded(name)).type == h5py.h5l.TYPE_HARD


def stored_member(parent: Any, name: str, *, read_only: bool = False) -> Any:
    """The member `name`, as returned by `parent[name]`, but without querying the mode of the file at every access.

    In a `read_only` file, a dataset keeps its shape in memory.
    """
    found = h5py.h5o.open(parent.id, encoded(name))
    if isinstance(found, h5py.h5g.GroupID):
        return h5py.Group(found)
    return h5py.Dataset(found, readonly=read_only) if isinstance(found, h5py.h5d.DatasetID) else parent[name]


def attributes(owner: Any) -> dict[str, Any]:
    """All attributes by name, with the same values as in `owner.attrs`."""
    found: dict[str, Any] = {}
    names: list[bytes] = []
    h5py.h5a.iterate(owner.id, names.append)
    for stored in names:
        name, value = decoded(stored), _scalar(h5py.h5a.open(owner.id, stored))
        found[name] = owner.attrs[name] if value is None else value
    return found


def attribute_value(owner: Any, name: str) -> Any:
    """The attribute `name`, with the same value as `owner.attrs[name]`. Raises KeyError if there is none."""
    value = _scalar(h5py.h5a.open(owner.id, encoded(name)))
    return owner.attrs[name] if value is None else value


def _scalar(stored: Any) -> Any:
    """The value of an attribute if it is one text or one number of a usual type; None otherwise."""
    if stored.get_space().get_simple_extent_type() != h5py.h5s.SCALAR:
        return None
    kind = stored.get_type()
    if isinstance(kind, h5py.h5t.TypeStringID):
        if not kind.is_variable_str():
            return None
        text: Any = np.empty((), _TEXT)
        stored.read(text, mtype=_TEXT_HELD)
        return text[()].decode("utf-8", "surrogateescape")
    for usual, dtype in _NUMBERS:
        if kind.equal(usual):
            number = np.empty((), dtype)
            stored.read(number, mtype=usual)
            return number[()]
    return None


def all_values(stored: Any) -> Any:
    """All values of a dataset, as returned by `stored[()]`."""
    raw = stored.id
    dtype, space = raw.dtype, raw.get_space()
    if dtype.kind not in "iufS" or space.get_simple_extent_type() == h5py.h5s.NULL:
        return stored[()]
    values: Any = np.empty(space.get_simple_extent_dims(), dtype)
    raw.read(space, space, values)
    return values if values.shape else values[()]


def encoded(name: str) -> bytes:
    """The name of an object as HDF5 stores it."""
    return name.encode("utf-8", "surrogateescape")


def decoded(name: bytes) -> str:
    """The inverse of `encoded`."""
    return name.decode("utf-8", "surrogateescape")
