"""Copies the groups and datasets of a file into another, as far as they are whole and readable."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from bench.record import hdf5
from bench.record.declared import part_of
from bench.record.errors import UNREADABLE, reason
from bench.record.extent import intact_rows, is_within
from bench.record.fields import Kind
from bench.record.hdf5 import Dataset, Group

BYTES_AT_ONCE = 2**22


@dataclass
class Copying:
    """What there is to copy: `counted` rows of every part, in a file of `size` bytes, but for the paths in `leave`.

    `lost` becomes what could not be read, why by path; of what grows as many rows are copied as can be read.
    """

    counted: Mapping[str, int]
    size: int
    leave: frozenset[str]
    lost: dict[str, str] = field(default_factory=dict[str, str])

    def copy(self, source: Group, target: Group) -> None:
        """Copy attributes and members into an empty group."""
        copy_attributes(source, target, self.lost)
        for name, member in hdf5.members(source, self.lost):
            path = f"{source.name.rstrip('/')}/{name}"
            if path in self.leave:
                continue
            if isinstance(member, str):
                hdf5.link(target, name, member)
            elif hdf5.is_dataset(member):
                self._copy_dataset(member, target, name)
            else:
                self.copy(hdf5.group(source, name), target.create_group(name, track_order=True))

    def _copy_dataset(self, stored: Dataset, target: Group, name: str) -> None:
        try:
            attributes = {each: stored.attrs[each] for each in stored.attrs}
            if "kind" in attributes:
                Kind(attributes["kind"])
            if hdf5.grows(stored):
                copied = self._copy_grown(stored, target, name)
            elif is_within(stored, self.size):
                copied = target.create_dataset(name, data=stored[()], dtype=stored.dtype)
            else:
                self.lost[stored.name] = f"{stored.name} lies beyond the end of the file"
                return
        except UNREADABLE as error:
            # without its attributes nobody could say what the numbers are
            self.lost[stored.name] = f"{stored.name} cannot be read ({reason(error)})"
            return
        for each, value in attributes.items():
            copied.attrs[each] = value

    def _copy_grown(self, stored: Dataset, target: Group, name: str) -> Dataset:
        filters = {} if stored.compression is None else hdf5.FILTERS
        copied = target.create_dataset(
            name, shape=(0,), maxshape=(None,), dtype=stored.dtype, chunks=stored.chunks, **filters
        )
        rows = min(self.counted[part_of(stored.name)], intact_rows(stored, self.size))
        done, step = 0, max(1, BYTES_AT_ONCE // stored.dtype.itemsize)
        while done < rows:
            count = min(step, rows - done)
            try:
                values = stored[done : done + count]
            except (OSError, RuntimeError):
                # a part that cannot be read is narrowed down to its first row
                if count == 1:
                    break
                step = count // 2
                continue
            hdf5.append(copied, values)
            done += len(values)
        return copied


def copy_attributes(source: Group, target: Group, lost: dict[str, str]) -> None:
    """Every attribute of a group that can be read, as it is."""
    try:
        for name in source.attrs:
            target.attrs[name] = source.attrs[name]
    except UNREADABLE as error:
        lost[f"{source.name} attributes"] = f"attributes of {source.name} cannot be read ({reason(error)})"
