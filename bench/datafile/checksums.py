"""Checksums of datasets, computed for fixed datasets when the file is created and for growing ones when it is closed.

The checksum of a dataset is the SHA-256 of its values' bytes, uncompressed and in order, in hexadecimal digits.
Checksums of attributes cover names and values as JSON, so that a later change to a conversion is detected. Checksums of
groups cover their attributes and link targets, such as the plotted data and their axes.
"""

import json
from collections import defaultdict
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field
from functools import lru_cache
from hashlib import sha256
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from bench.datafile import hdf5
from bench.datafile.fields import Field
from bench.datafile.findings_tables import FIT_VIEWS
from bench.datafile.hdf5_reading import UNREADABLE, reading, reason
from bench.datafile.rows import TABLE_CLASS
from sim.sweep import Done

GROUP = "checksums"
WIDTH = 64
ROWS_AT_ONCE = 2**18
_DATASETS, _VALUES, _ATTRIBUTES = f"{GROUP}/dataset", f"{GROUP}/values", f"{GROUP}/attributes"
_GROUPS, _CONTENTS = f"{GROUP}/group", f"{GROUP}/group_attributes"


class Checksums:
    """The checksum table of a new file, created last, when every dataset exists."""

    def __init__(
        self, entry: hdf5.Group, changing: Iterable[str], created: Mapping[str, Sequence[Field]] | None = None
    ) -> None:
        """`changing` holds the paths of the datasets that are not yet final; their checksums are empty until `seal`.

        `created` holds the fields of new, empty tables by path, whose attributes need not be read from the file.
        """
        found = _Contents({*changing}, created or {})
        found.groups["/"] = of_group(hdf5.group(entry, "/"))
        found.add(entry)
        self._entry, self._values, groups = entry, found.values, found.groups
        group = hdf5.create_group(entry, GROUP, "NXcollection")
        hdf5.write_texts(group, "dataset", self._values, description="path of each dataset other than the checksums")
        self._stored = hdf5.write_texts(
            group,
            "values",
            self._values.values(),
            description="SHA-256 of the dataset's uncompressed values; empty until closing for datasets that grow",
        )
        hdf5.write_texts(
            group, "attributes", found.attributes.values(), description="SHA-256 of the dataset's attributes as JSON"
        )
        hdf5.write_texts(
            group, "group", groups, description="path of each group other than this one and the views of fits"
        )
        hdf5.write_texts(
            group,
            "group_attributes",
            groups.values(),
            description="SHA-256 of the group's attributes and links, as JSON",
        )

    def reopen(self, entry: hdf5.Group) -> None:
        """Use the datasets of the reopened file from now on."""
        self._entry, self._stored = entry, hdf5.dataset(entry, f"{GROUP}/values")

    def seal(self, grown: Mapping[str, str]) -> None:
        """Add the missing checksums: those in `grown`, by path; those of other datasets are computed from the file."""
        for path, known in self._values.items():
            if not known:
                self._values[path] = grown.get(path) or of_values(hdf5.dataset(self._entry, path))
        hdf5.overwrite(self._stored, [text.encode() for text in self._values.values()])


def of_values(stored: hdf5.Dataset) -> str:
    """SHA-256 of the values of a dataset, read piece by piece."""
    digest = sha256()
    shape = stored.shape
    if not shape or shape[0] <= ROWS_AT_ONCE:
        digest.update(_bytes(np.asarray(hdf5.all_values(stored), dtype=stored.dtype)))
    else:
        for start in range(0, shape[0], ROWS_AT_ONCE):
            digest.update(_bytes(stored[start : start + ROWS_AT_ONCE]))
    return digest.hexdigest()


def of_attributes(stored: hdf5.Dataset) -> str:
    """SHA-256 of the attributes of a dataset as JSON: names sorted, arrays as lists."""
    return _of_json(_plain_values(hdf5.attributes(stored)))


def of_group(group: hdf5.Group, datasets: Container[str] = ()) -> str:
    """SHA-256 of a group's attributes and link targets, both by name, as JSON. `datasets` are the names of members that
    are known to be datasets, which are not opened again.
    """
    links = {name: target for name, target in hdf5.members(group, without=datasets) if isinstance(target, str)}
    return _of_contents(hdf5.attributes(group), links)


def _of_json(content: Mapping[str, Any]) -> str:
    # an attribute of a type that this software never writes may have no JSON form; its `repr` is then hashed, and the
    # checksum does not match
    return sha256(json.dumps(content, sort_keys=True, default=repr).encode()).hexdigest()


def _plain_values(attributes: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: value if isinstance(value, str | int | float) else np.asarray(value).tolist()
        for name, value in attributes.items()
    }


def _of_contents(attributes: Mapping[str, Any], links: Mapping[str, str]) -> str:
    return _of_json({"attributes": _plain_values(attributes), "links": links})


_OF_TABLE = _of_contents({"NX_class": TABLE_CLASS}, {})


@lru_cache(maxsize=1024)
def _of_field(field: Field) -> str:
    return _of_json(_plain_values(field.attributes))


class _Contents:
    """Checksums by path: `values`, which are empty for the `changing` datasets, and `attributes` of datasets, and
    `groups`.
    """

    def __init__(self, changing: Set[str], created: Mapping[str, Sequence[Field]]) -> None:
        self._changing, self._created = changing, created
        self.values, self.attributes, self.groups = dict[str, str](), dict[str, str](), dict[str, str]()

    def add(self, group: hdf5.Group) -> None:
        """Add a group and all objects below it; each object is opened only once, to save time."""
        above, links = group.name, dict[str, str]()
        # before its members, in the order of creation
        self.groups[above] = ""
        for name in hdf5.names(group):
            path = f"{above}/{name}"
            if path in self._created:
                self._add_created(path, self._created[path])
                continue
            with reading(path):
                member = hdf5.member_or_target(group, name)
            if isinstance(member, str):
                links[name] = member
            elif hdf5.is_dataset(member):
                self.values[path] = "" if path in self._changing else of_values(member)
                self.attributes[path] = of_attributes(member)
            else:
                self.add(cast(hdf5.Group, member))
        self.groups[above] = _of_contents(hdf5.attributes(group), links)

    def _add_created(self, path: str, fields: Sequence[Field]) -> None:
        self.groups[path] = _OF_TABLE
        for each in fields:
            self.values[f"{path}/{each.name}"] = ""
            self.attributes[f"{path}/{each.name}"] = _of_field(each)


def covered_groups(entry: hdf5.Group) -> Iterator[hdf5.Group]:
    """The groups that have a checksum: the root, the entry and the entry's contents, except the checksums and the
    views, which are created later.
    """
    yield hdf5.group(entry, "/")
    yield from (each for each in hdf5.groups(entry) if each.name.split("/")[2:3] not in ([GROUP], [FIT_VIEWS]))


def read_groups(entry: hdf5.Group) -> dict[str, str]:
    """The checksums of the groups by path; older files have none."""
    if _GROUPS not in entry:
        return {}
    return dict(zip(*(hdf5.read_texts(hdf5.dataset(entry, path)[:]) for path in (_GROUPS, _CONTENTS)), strict=True))


def read(entry: hdf5.Group) -> dict[str, tuple[str, str]]:
    """The stored checksums of values and attributes, by path. The checksums of growing values are empty if the file was
    not closed.
    """
    columns = [hdf5.read_texts(hdf5.dataset(entry, path)[:]) for path in (_DATASETS, _VALUES, _ATTRIBUTES)]
    return {path: (values, attributes) for path, values, attributes in zip(*columns, strict=True)}


def _bytes(values: NDArray[Any]) -> bytes:
    return values.tobytes()


SMALL = 2**20
"""Largest size [bytes] of a dataset whose values are checked by default."""


@dataclass(frozen=True)
class Integrity:
    """`compared` is the number of datasets that match their checksum. `failing` holds a message for each dataset or
    group that was changed, is missing or cannot be read, by path.

    `unchecked` holds the paths of the datasets whose values were not compared: those too large for the requested check,
    those whose checksum is empty because the file was not closed and, in a file without checksums, all datasets.
    Datasets added to a file with checksums are not included; see `added`.
    """

    compared: int
    failing: dict[str, str] = field(default_factory=dict[str, str])
    unchecked: tuple[str, ...] = ()

    def __str__(self) -> str:
        """One-line summary."""
        if self.failing:
            return "damaged or changed since it was written: " + "; ".join(self.failing.values())
        left = f"; {len(self.unchecked)} not checked" if self.unchecked else ""
        return f"unchanged datasets: {self.compared}{left}"


def integrity(entry: hdf5.Group, largest: int | None = SMALL, done: Done = lambda _done, _all: None) -> Integrity:
    """Compare all attributes and links, and all datasets of at most `largest` bytes (None for no limit), with their
    checksums.

    `done` receives the number of datasets processed and the total.
    """
    if not hdf5.has(entry, GROUP):
        lost: dict[str, str] = {}
        return Integrity(0, lost, tuple(each.name for each in hdf5.datasets(entry, lost)))
    try:
        known, groups = read(entry), read_groups(entry)
    except UNREADABLE as error:
        return Integrity(0, {f"/entry/{GROUP}": f"the checksums cannot be read ({reason(error)})"})
    failing: dict[str, str] = {}
    unchecked: list[str] = []
    opened = defaultdict[str, set[str]](set)
    for number, (path, (values, attributes)) in enumerate(known.items()):
        done(number, len(known))
        try:
            stored = hdf5.dataset(entry, path)
            # a link in place of a dataset may lead to equal values
            if hdf5.is_hard_link(entry, path):
                folder, _, name = path.rpartition("/")
                opened[folder].add(name)
            looked = bool(values) and (largest is None or stored.nbytes <= largest)
            if changes := _compared(stored, values if looked else "", attributes):
                failing[path] = changes
            elif not looked:
                unchecked.append(path)
        except UNREADABLE as error:
            failing[path] = _lost(entry, path, error)
    for path, attributes in groups.items():
        try:
            if of_group(hdf5.group(entry, path), opened[path]) != attributes:
                failing[path] = f"the attributes or links of {path} were changed"
        except UNREADABLE as error:
            failing[path] = _lost(entry, path, error)
    return Integrity(sum(path not in failing for path in known) - len(unchecked), failing, tuple(unchecked))


def added(entry: hdf5.Group, stored: Iterable[hdf5.Dataset]) -> Iterator[str]:
    """Problem messages for the objects added to the file after its checksums; `stored` are all its datasets."""
    known, groups = read(entry), read_groups(entry)
    for each in stored:
        if each.name not in known and not each.name.startswith(f"/entry/{GROUP}/"):
            yield f"{each.name} has no checksum: it was added later"
    for each in covered_groups(entry) if groups else ():
        if each.name not in groups:
            yield f"{each.name} has no checksum: it was added later"


def _compared(stored: hdf5.Dataset, values: str, attributes: str) -> str:
    found: list[str] = []
    if of_attributes(stored) != attributes:
        found.append(f"the attributes of {stored.name} were changed")
    if values and of_values(stored) != values:
        found.append(f"{stored.name} was changed: its checksum does not match")
    return "; ".join(found)


def _lost(entry: hdf5.Group, path: str, error: BaseException) -> str:
    try:
        there = path in entry
    except UNREADABLE:
        there = True
    return f"{path} cannot be read ({reason(error)})" if there else f"{path} is missing"
