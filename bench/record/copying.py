"""Copies the groups and datasets of a file into another, as far as they are whole and readable."""

from collections.abc import Callable

from bench.record import hdf5
from bench.record.hdf5 import Dataset, Group

ROWS_AT_ONCE = 2**18


def copy_group(source: Group, target: Group, rows_of: Callable[[str], int], leave: frozenset[str]) -> None:
    """Copy attributes and members, but for those whose paths `leave` names, into an empty group.

    Of a dataset that grows as many rows are copied as `rows_of` says for its path, or as many as can be read.
    """
    copy_attributes(source, target)
    for name, member in hdf5.members(source):
        path = f"{source.name.rstrip('/')}/{name}"
        if path in leave:
            continue
        if isinstance(member, str):
            hdf5.link(target, name, member)
        elif hdf5.is_dataset(member):
            copied = _copy_grown(member, target, name, rows_of(path)) if hdf5.grows(member) else _copy(member, target)
            copy_attributes(member, copied)
        else:
            copy_group(hdf5.group(source, name), target.create_group(name, track_order=True), rows_of, leave)


def copy_attributes(source: Group | Dataset, target: Group | Dataset) -> None:
    """Every attribute, as it is."""
    for name in source.attrs:
        target.attrs[name] = source.attrs[name]


def _copy(stored: Dataset, target: Group) -> Dataset:
    return target.create_dataset(stored.name.rpartition("/")[2], data=stored[()], dtype=stored.dtype)


def _copy_grown(stored: Dataset, target: Group, name: str, rows: int) -> Dataset:
    filters = {} if stored.compression is None else hdf5.FILTERS
    copied = target.create_dataset(
        name, shape=(0,), maxshape=(None,), dtype=stored.dtype, chunks=stored.chunks, **filters
    )
    done, step = 0, max(1, ROWS_AT_ONCE)
    while done < min(rows, stored.shape[0]):
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
