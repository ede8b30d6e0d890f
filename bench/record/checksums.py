"""The checksum of every dataset: of what is known before the run at its beginning, of all that grows at its end.

A checksum is SHA-256 of the values' bytes as they are stored, uncompressed and in order, in hexadecimal digits.
Those of attributes are of their names and values as JSON: a conversion that was changed later is found as well. Groups
have one of their attributes and of where their links lead: what is plotted, and against what.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5
from bench.record.fits import VIEWS

GROUP = "checksums"
WIDTH = 64
ROWS_AT_ONCE = 2**18
_DATASETS, _VALUES, _ATTRIBUTES = f"{GROUP}/dataset", f"{GROUP}/values", f"{GROUP}/attributes"
_GROUPS, _CONTENTS = f"{GROUP}/group", f"{GROUP}/group_attributes"


class Checksums:
    """The table of a new file; made last, when every dataset exists."""

    def __init__(self, entry: hdf5.Group, changing: Iterable[str]) -> None:
        """`changing` are the paths of what is not yet as it will be: its checksums stay empty until `seal`."""
        stored, groups = list[hdf5.Dataset](), {"/": of_group(hdf5.group(entry, "/"))}
        _walk(entry, stored, groups)
        later = {*changing}
        self._entry, self._paths = entry, [each.name for each in stored]
        self._values = {each.name: "" if each.name in later else of_values(each) for each in stored}
        attributes = [of_attributes(each) for each in stored]
        group = hdf5.create_group(entry, GROUP, "NXcollection")
        hdf5.write_texts(group, "dataset", self._paths, description="path of each dataset but these")
        self._stored = hdf5.write_texts(
            group,
            "values",
            self._values.values(),
            description="SHA-256 of its uncompressed values; empty until the file is closed where they change",
        )
        hdf5.write_texts(group, "attributes", attributes, description="SHA-256 of its attributes as JSON")
        hdf5.write_texts(group, "group", groups, description="path of each group but this and views of fits")
        hdf5.write_texts(
            group, "group_attributes", groups.values(), description="SHA-256 of its attributes and links as JSON"
        )

    def seal(self, grown: Mapping[str, str]) -> None:
        """Put in what was missing: `grown` by path, and of the rest what the file holds now."""
        for path, known in self._values.items():
            if not known:
                self._values[path] = grown.get(path) or of_values(hdf5.dataset(self._entry, path))
        self._stored[...] = np.array([text.encode() for text in self._values.values()], dtype=hdf5.text_type(WIDTH))


def of_values(stored: hdf5.Dataset) -> str:
    """SHA-256 of the values of a dataset, read piece by piece."""
    digest = sha256()
    if not stored.shape:
        digest.update(_bytes(np.asarray(stored[()], dtype=stored.dtype)))
    else:
        for start in range(0, stored.shape[0], ROWS_AT_ONCE):
            digest.update(_bytes(stored[start : start + ROWS_AT_ONCE]))
    return digest.hexdigest()


def of_attributes(stored: hdf5.Dataset) -> str:
    """SHA-256 of the attributes of a dataset as JSON: names in order, arrays as lists."""
    return _of_json(_attributes(stored))


def of_group(group: hdf5.Group) -> str:
    """SHA-256 of a group's attributes and of the paths that its links lead to, both by name, as JSON."""
    return _of_contents(group, {name: target for name, target in hdf5.members(group) if isinstance(target, str)})


def _of_contents(group: hdf5.Group, links: Mapping[str, str]) -> str:
    return _of_json({"attributes": _attributes(group), "links": links})


def _walk(group: hdf5.Group, stored: list[hdf5.Dataset], groups: dict[str, str]) -> None:
    """Gather every dataset and the checksum of every group: opening an object is what takes the time, so once each."""
    links = dict[str, str]()
    groups[group.name] = ""
    for name, member in hdf5.members(group):
        if isinstance(member, str):
            links[name] = member
        elif hdf5.is_dataset(member):
            stored.append(member)
        else:
            _walk(cast(hdf5.Group, member), stored, groups)
    groups[group.name] = _of_contents(group, links)


def covered_groups(entry: hdf5.Group) -> Iterator[hdf5.Group]:
    """The root, the entry and what is below it, but for the checksums and for views, which are made after them."""
    yield hdf5.group(entry, "/")
    yield from (each for each in hdf5.groups(entry) if each.name.split("/")[2:3] not in ([GROUP], [VIEWS]))


def read_groups(entry: hdf5.Group) -> dict[str, str]:
    """The checksums of the groups by path; none in files of before."""
    if _GROUPS not in entry:
        return {}
    return dict(zip(*(hdf5.read_texts(hdf5.dataset(entry, path)[:]) for path in (_GROUPS, _CONTENTS)), strict=True))


def read(entry: hdf5.Group) -> dict[str, tuple[str, str]]:
    """The checksums of values and attributes by path; those of values are empty where the file was not closed."""
    columns = [hdf5.read_texts(hdf5.dataset(entry, path)[:]) for path in (_DATASETS, _VALUES, _ATTRIBUTES)]
    return {path: (values, attributes) for path, values, attributes in zip(*columns, strict=True)}


def _bytes(values: NDArray[Any]) -> bytes:
    return values.tobytes()


def _of_json(content: Mapping[str, Any]) -> str:
    # what this software never writes has no form in JSON, but a checksum that is wrong
    return sha256(json.dumps(content, sort_keys=True, default=repr).encode()).hexdigest()


def _attributes(owner: hdf5.Group | hdf5.Dataset) -> dict[str, Any]:
    return {name: _plain(owner.attrs[name]) for name in owner.attrs}


def _plain(value: Any) -> Any:
    return value if isinstance(value, str | int | float) else np.asarray(value).tolist()
