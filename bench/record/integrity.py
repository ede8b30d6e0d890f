"""What a file holds held against its checksums: all of it, or cheaply what is small."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from bench.record import checksums, hdf5
from bench.record.errors import UNREADABLE, reason
from sim.sweep import Done

SMALL = 2**20
"""Bytes of a dataset that are hashed in a few milliseconds."""


@dataclass(frozen=True)
class Integrity:
    """`failing` says by path what is not as it was written, `compared` how many datasets were held against a checksum.

    `unchecked` are datasets that were not: without a checksum, as in a file that was not closed, or too large for the
    look that was asked for.
    """

    compared: int
    failing: dict[str, str] = field(default_factory=dict[str, str])
    unchecked: tuple[str, ...] = ()

    def __str__(self) -> str:
        """One line for a reader."""
        if self.failing:
            return "damaged or changed since it was written: " + "; ".join(self.failing.values())
        left = f"; {len(self.unchecked)} were not looked at" if self.unchecked else ""
        return f"{self.compared} datasets are as they were written{left}"


def integrity(entry: hdf5.Group, largest: int | None = SMALL, done: Done = lambda _done, _all: None) -> Integrity:
    """Hold the datasets of at most `largest` bytes, or all, and the attributes of everything against the checksums.

    `done` counts the datasets.
    """
    if not hdf5.has(entry, checksums.GROUP):
        lost: dict[str, str] = {}
        return Integrity(0, lost, tuple(each.name for each in hdf5.datasets(entry, lost)))
    try:
        known, groups = checksums.read(entry), checksums.read_groups(entry)
    except UNREADABLE as error:
        return Integrity(0, {f"/entry/{checksums.GROUP}": f"the checksums cannot be read ({reason(error)})"})
    failing: dict[str, str] = {}
    unchecked: list[str] = []
    for number, (path, (values, attributes)) in enumerate(known.items()):
        done(number, len(known))
        try:
            stored = hdf5.dataset(entry, path)
            looked = bool(values) and (largest is None or stored.nbytes <= largest)
            if told := _compared(stored, values if looked else "", attributes):
                failing[path] = told
            elif not looked:
                unchecked.append(path)
        except UNREADABLE as error:
            failing[path] = _lost(entry, path, error)
    for path, attributes in groups.items():
        try:
            if checksums.of_group(hdf5.group(entry, path)) != attributes:
                failing[path] = f"the attributes or links of {path} are not those that were written"
        except UNREADABLE as error:
            failing[path] = _lost(entry, path, error)
    return Integrity(sum(path not in failing for path in known) - len(unchecked), failing, tuple(unchecked))


def added(entry: hdf5.Group) -> Iterator[str]:
    """What is in the file and was not when its checksums were made."""
    known, groups = checksums.read(entry), checksums.read_groups(entry)
    for each in hdf5.datasets(entry):
        if each.name not in known and not each.name.startswith(f"/entry/{checksums.GROUP}/"):
            yield f"{each.name} has no checksum: it was added later"
    for each in checksums.covered_groups(entry) if groups else ():
        if each.name not in groups:
            yield f"{each.name} has no checksum: it was added later"


def _compared(stored: hdf5.Dataset, values: str, attributes: str) -> str:
    told: list[str] = []
    if checksums.of_attributes(stored) != attributes:
        told.append(f"the attributes of {stored.name} are not those that were written")
    if values and checksums.of_values(stored) != values:
        told.append(f"{stored.name} is not what was written: its checksum is wrong")
    return "; ".join(told)


def _lost(entry: hdf5.Group, path: str, error: BaseException) -> str:
    try:
        there = path in entry
    except UNREADABLE:
        there = True
    return f"{path} cannot be read ({reason(error)})" if there else f"{path} is missing"
