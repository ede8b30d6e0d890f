# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false
"""Access to members and attributes through h5py's low-level interface, in a third of the time of its dictionaries.

A file has about 200 objects and 600 attributes, which are created before a run starts and read whenever it is opened.
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
_TEXT_STORED, _TEXT_READ = h5py.h5t.py_create(_TEXT, logical=True), h5py.h5t.py_create(_TEXT)
_SWITCH, _SCALAR = h5py.h5t.py_create(np.dtype(np.int8)), h5py.h5s.create(h5py.h5s.SCALAR)


def is_hard_link(parent: Any, name: str) -> bool:
    """Whether the member `name` is an object stored in the file, not a soft or external link. Raises KeyError if there
    is no such member.
    """
    return parent.id.links.get_info(_encoded(name)).type == h5py.h5l.TYPE_HARD


def stored_member(parent: Any, name: str, *, read_only: bool = False) -> Any:
    """The member `name`, as returned by `parent[name]`, but without querying the mode of the file at every access.

    In a `read_only` file, a dataset keeps its shape in memory.
    """
    found = h5py.h5o.open(parent.id, _encoded(name))
    if isinstance(found, h5py.h5g.GroupID):
        return h5py.Group(found)
    return h5py.Dataset(found, readonly=read_only) if isinstance(found, h5py.h5d.DatasetID) else parent[name]


def attributes(owner: Any) -> dict[str, Any]:
    """All attributes by name, with the same values as in `owner.attrs`."""
    found: dict[str, Any] = {}
    for number in range(h5py.h5a.get_num_attrs(owner.id)):
        stored: Any = h5py.h5a.open(owner.id, index=number)
        name, type_, shape = stored.name.decode("utf-8", "surrogateescape"), stored.get_type(), stored.shape
        if shape == () and type_.equal(_TEXT_STORED):
            value: Any = np.empty((), _TEXT)
            stored.read(value, mtype=_TEXT_READ)
            found[name] = value[()].decode("utf-8", "surrogateescape")
        elif shape is not None and (kind := type_.dtype).kind in "iuf" and kind.metadata is None:
            value = np.empty(shape, kind)
            stored.read(value)
            found[name] = value[()]
        else:
            found[name] = owner.attrs[name]
    return found


def describe(owner: Any, **texts: str) -> None:
    """Add string attributes to a new object, as `owner.attrs` would."""
    for name, text in texts.items():
        h5py.h5a.create(owner.id, name.encode(), _TEXT_STORED, _SCALAR).write(np.array(text, dtype=_TEXT))


def describe_switch(owner: Any, name: str, *, value: bool) -> None:
    """Add a switch (0 or 1, int8) to a new object, as `owner.attrs` would."""
    h5py.h5a.create(owner.id, name.encode(), _SWITCH, _SCALAR).write(np.array(value, dtype=np.int8))


def _encoded(name: str) -> bytes:
    return name.encode("utf-8", "surrogateescape")
