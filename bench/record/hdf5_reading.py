# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
"""Finds and reads what is in a file through h5py; what is damaged becomes a RecordError that names it."""

from collections.abc import Iterator
from contextlib import suppress
from typing import Any, TypeGuard, cast

import h5py
from numpy.typing import NDArray

from bench.record.errors import UNREADABLE, RecordError, reading, reason
from bench.record.hdf5_types import Dataset, Group


def dataset(parent: Group, path: str) -> Dataset:
    """The dataset at `path` below `parent`. Raises RecordError when there is none."""
    return cast(Dataset, _member(parent, path, h5py.Dataset))


def group(parent: Group, path: str) -> Group:
    """The group at `path` below `parent`. Raises RecordError when there is none."""
    return cast(Group, _member(parent, path, h5py.Group))


def members(parent: Group, lost: dict[str, str] | None = None) -> Iterator[tuple[str, "Dataset | Group | str"]]:
    """What is in a group, by name: datasets, groups, and for a soft link the path that it leads to.

    What cannot be read is added to `lost`, why by path. Raises RecordError for it when that is not given.
    """
    try:
        names = list(parent)
    except UNREADABLE as error:
        names = _give_up(parent.name, error, lost)
    for name in names:
        try:
            found = cast(object, cast(h5py.Group, parent).get(name, getlink=True))
            member = found.path if isinstance(found, h5py.SoftLink) else cast("Dataset | Group", parent[name])
        except UNREADABLE as error:
            _give_up(f"{parent.name.rstrip('/')}/{name}", error, lost)
        else:
            yield name, member


def datasets(parent: Group, lost: dict[str, str] | None = None) -> Iterator[Dataset]:
    """Every dataset below `parent`, in the order in which they were made; what links lead to comes once, views not.

    What cannot be read is treated as by `members`.
    """
    for _, member in members(parent, lost):
        if isinstance(member, h5py.Dataset):
            if not cast(bool, member.is_virtual):
                yield cast(Dataset, member)
        elif not isinstance(member, str):
            yield from datasets(cast(Group, member), lost)


def groups(parent: Group) -> Iterator[Group]:
    """A group and every group below it, in the order in which they were made."""
    yield parent
    for name, member in members(parent):
        if not isinstance(member, str | h5py.Dataset):
            yield from groups(group(parent, name))


def names(parent: Group) -> list[str]:
    """The names of the members of a group. Raises RecordError when they cannot be read."""
    with reading(parent.name):
        return list(parent)


def has(parent: Group, path: str) -> bool:
    """Whether there is something at `path` below `parent`. Raises RecordError when that cannot be told."""
    with reading(f"{parent.name.rstrip('/')}/{path}"):
        return path in parent


def is_dataset(member: object) -> TypeGuard[Dataset]:
    """Whether a member of a group is a dataset."""
    return isinstance(member, h5py.Dataset)


def grows(stored: Dataset) -> bool:
    """Whether rows can be appended to a dataset."""
    return stored.maxshape == (None,)


def place(stored: Dataset) -> tuple[int, int] | None:
    """First byte in the file and number of bytes of a dataset that does not grow; None if it lies with its header."""
    raw = cast(h5py.Dataset, stored).id
    begin = cast("int | None", raw.get_offset())
    return None if begin is None else (begin, cast(int, raw.get_storage_size()))


def places_of_chunks(stored: Dataset) -> dict[int, tuple[int, int]]:
    """First byte in the file and number of bytes of every written chunk, by its first row, as far as their index can
    be read. All at once: HDF5 goes through the chunks from the first one for each that is looked up on its own.
    """
    found: dict[int, tuple[int, int]] = {}

    def note(chunk: Any) -> None:
        found[chunk.chunk_offset[0]] = (chunk.byte_offset, chunk.size)

    with suppress(*UNREADABLE):
        cast(Any, cast(h5py.Dataset, stored).id).chunk_iter(note)
    return found


def read(stored: Dataset, key: object = ()) -> Any:
    """Values of a dataset, all of a scalar without `key`. Raises RecordError when they cannot be read."""
    with reading(stored.name):
        return stored[key]


def attribute(owner: Group | Dataset, name: str) -> Any:
    """An attribute. Raises RecordError when there is none, or it cannot be read."""
    with reading(f"the attribute {name} of {owner.name}"):
        return owner.attrs[name]


def read_text(parent: Group, path: str) -> str:
    """A scalar text."""
    stored = dataset(parent, path)
    with reading(stored.name):
        return bytes(stored[()]).decode()


def read_texts(stored: NDArray[Any]) -> list[str]:
    """Texts of fixed length as read from a dataset."""
    return [bytes(text).decode() for text in stored]


def _give_up(path: str, error: BaseException, lost: dict[str, str] | None) -> list[str]:
    told = f"{path} cannot be read ({reason(error)})"
    if lost is None:
        raise RecordError(f"{told}: the file is damaged") from error
    lost[path] = told
    return []


def _member(parent: Group, path: str, kind: type) -> object:
    name = f"{parent.name.rstrip('/')}/{path.lstrip('/')}"
    with reading(name):
        there = path in parent
        found = parent[path] if there else None
    if not isinstance(found, kind):
        raise RecordError(f"the file has no {kind.__name__.lower()} {name}: it is damaged")
    return found
