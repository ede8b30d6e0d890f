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
import h5py.h5t
import numpy as np

_TEXT = h5py.string_dtype()
_TEXT_HELD = h5py.h5t.py_create(_TEXT)
_NUMBERS = h5py.h5t.TypeIntegerID, h5py.h5t.TypeFloatID


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
    for number in range(h5py.h5a.get_num_attrs(owner.id)):
        stored: Any = h5py.h5a.open(owner.id, index=number)
        name, kind = stored.name.decode("utf-8", "surrogateescape"), stored.get_type()
        text = isinstance(kind, h5py.h5t.TypeStringID) and kind.is_variable_str()
        if stored.shape != () or not (text or isinstance(kind, _NUMBERS)):
            found[name] = owner.attrs[name]
            continue
        value: Any = np.empty((), _TEXT if text else kind.dtype)
        stored.read(value, mtype=_TEXT_HELD if text else None)
        found[name] = value[()].decode("utf-8", "surrogateescape") if text else value[()]
    return found


def encoded(name: str) -> bytes:
    """The name of an object as HDF5 stores it."""
    return name.encode("utf-8", "surrogateescape")


def decoded(name: bytes) -> str:
    """The inverse of `encoded`."""
    return name.decode("utf-8", "surrogateescape")
