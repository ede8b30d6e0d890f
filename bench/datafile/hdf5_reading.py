# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
"""Access to a file's objects through h5py. Damage raises a DataFileError that names the object."""

import re
from collections.abc import Container, Generator, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Protocol, Self, TypeGuard, cast

import h5py
import numpy as np
from numpy.typing import NDArray

from bench.datafile.hdf5_objects import all_values, attribute_value, is_hard_link, stored_member
from sim.errors import RockbenchError


class Attributes(Protocol):
    """The attributes of a group or dataset."""

    def __getitem__(self, name: str) -> Any: ...
    def __setitem__(self, name: str, value: object) -> None: ...
    def __contains__(self, name: object) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def get(self, name: str, default: object = None) -> Any: ...


class Dataset(Protocol):
    """An array in the file, or a scalar (shape ())."""

    @property
    def name(self) -> str: ...
    @property
    def attrs(self) -> Attributes: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def nbytes(self) -> int: ...
    @property
    def maxshape(self) -> tuple[int | None, ...]: ...
    @property
    def chunks(self) -> tuple[int, ...] | None: ...
    @property
    def compression(self) -> str | None: ...
    def __getitem__(self, key: object) -> Any: ...
    def __setitem__(self, key: object, value: object) -> None: ...
    def resize(self, size: tuple[int, ...]) -> None: ...
    def refresh(self) -> None: ...


class Group(Protocol):
    """A group in the file."""

    @property
    def name(self) -> str: ...
    @property
    def attrs(self) -> Attributes: ...
    def create_group(self, name: str, track_order: bool) -> "Group": ...
    def create_dataset(self, name: str, **options: Any) -> Dataset: ...
    def __getitem__(self, name: str) -> object: ...
    def __setitem__(self, name: str, value: object) -> None: ...
    def __contains__(self, name: object) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...


class File(Group, Protocol):
    """An open file."""

    @property
    def filename(self) -> str: ...
    def __enter__(self) -> Self: ...
    def __exit__(self, *error: object) -> None: ...
    def flush(self) -> None: ...
    def close(self) -> None: ...


class DataFileError(RockbenchError):
    """Error raised if a data file cannot be written or read."""

    error_code = "data_file"


UNREADABLE = (OSError, RuntimeError, KeyError, ValueError, TypeError, IndexError, OverflowError, DataFileError)
"""Exceptions caused by a damaged file: errors of HDF5, of its Python library, and of decoding."""


def reason(error: BaseException) -> str:
    """One-line text for a multi-line error of the HDF5 library: the operating system's message, if the error contains
    one, or else the first line.
    """
    text = str(error).strip()
    found = re.search(r"error message = '([^']+)'", text)
    return found.group(1) if found else text.partition("\n")[0] or type(error).__name__


@contextmanager
def reading(what: str) -> Generator[None]:
    """Context manager that converts exceptions from reading a damaged file to a DataFileError that names `what`."""
    try:
        yield
    except DataFileError:
        raise
    except UNREADABLE as error:
        raise DataFileError(f"{what} cannot be read ({reason(error)}): the file is damaged") from error


def dataset(parent: Group, path: str) -> Dataset:
    """The dataset at `path` below `parent`. Raises DataFileError if there is none."""
    return cast(Dataset, _member(parent, path, h5py.Dataset))


def group(parent: Group, path: str) -> Group:
    """The group at `path` below `parent`. Raises DataFileError if there is none."""
    return cast(Group, _member(parent, path, h5py.Group))


def members(
    parent: Group, lost: dict[str, str] | None = None, without: Container[str] = ()
) -> Iterator[tuple[str, "Dataset | Group | str"]]:
    """Members of a group, by name: datasets, groups, and target paths of soft links. Those with names in `without` are
    not opened.

    The reason for each unreadable member is added to `lost` by path; without `lost`, DataFileError is raised.
    """
    try:
        names, read_only = [name for name in parent if name not in without], _is_read_only(parent)
    except UNREADABLE as error:
        names, read_only = _record_loss(parent.name, error, lost), False
    for name in names:
        try:
            member = member_or_target(parent, name, read_only=read_only)
        except UNREADABLE as error:
            _record_loss(f"{parent.name.rstrip('/')}/{name}", error, lost)
        else:
            yield name, member


def member_or_target(parent: Group, name: str, *, read_only: bool = False) -> "Dataset | Group | str":
    """The member `name`, or the path of the target if it is a soft link. Raises KeyError for any other link without a
    target.
    """
    if is_hard_link(parent, name):
        return cast("Dataset | Group", stored_member(parent, name, read_only=read_only))
    found = cast(object, cast(h5py.Group, parent).get(name, getlink=True))
    return found.path if isinstance(found, h5py.SoftLink) else cast("Dataset | Group", parent[name])


def datasets(parent: Group, lost: dict[str, str] | None = None) -> Iterator[Dataset]:
    """Every dataset below `parent`, in order of creation, excluding views; link targets occur once. Unreadable members
    are handled as in `members`.
    """
    for _, member in members(parent, lost):
        if isinstance(member, h5py.Dataset):
            if not cast(bool, member.is_virtual):
                yield cast(Dataset, member)
        elif not isinstance(member, str):
            yield from datasets(cast(Group, member), lost)


def groups(parent: Group) -> Iterator[Group]:
    """A group and every group below it, in the order of creation."""
    return (cast(Group, each) for each in objects(parent) if not is_dataset(each))


def objects(parent: Group) -> Iterator["Group | Dataset"]:
    """A group and every group and dataset below it, in the order of creation, excluding views."""
    yield parent
    for name, member in members(parent):
        if isinstance(member, h5py.Group):
            yield from objects(cast(Group, member))
        elif isinstance(member, h5py.Dataset):
            if not cast(bool, member.is_virtual):
                yield cast(Dataset, member)
        elif not isinstance(member, str):
            # raises the error that names it
            group(parent, name)


def names(parent: Group) -> list[str]:
    """The names of the members of a group. Raises DataFileError if they cannot be read."""
    with reading(parent.name):
        return list(parent)


def has(parent: Group, path: str) -> bool:
    """Whether `path` exists below `parent`. Raises DataFileError if this cannot be determined because of damage."""
    with reading(f"{parent.name.rstrip('/')}/{path}"):
        return path in parent


def is_dataset(member: object) -> TypeGuard[Dataset]:
    """Whether a member of a group is a dataset."""
    return isinstance(member, h5py.Dataset)


def grows(stored: Dataset) -> bool:
    """Whether rows can be appended to a dataset."""
    return stored.maxshape == (None,)


def place(stored: Dataset) -> tuple[int, int] | None:
    """Offset and size in the file [bytes] of a fixed dataset; None if it is stored in its header."""
    raw = cast(h5py.Dataset, stored).id
    begin = cast("int | None", raw.get_offset())
    return None if begin is None else (begin, cast(int, raw.get_storage_size()))


def places_of_chunks(stored: Dataset) -> dict[int, tuple[int, int]]:
    """Offset and size in the file [bytes] of every written chunk, by the chunk's first row, as far as the index is
    readable. The index is read in one pass, since HDF5 searches from the first chunk for every single lookup.
    """
    found: dict[int, tuple[int, int]] = {}

    def note(chunk: Any) -> None:
        found[chunk.chunk_offset[0]] = (chunk.byte_offset, chunk.size)

    with suppress(*UNREADABLE):
        cast(Any, cast(h5py.Dataset, stored).id).chunk_iter(note)
    return found


def read(stored: Dataset, key: object = ()) -> Any:
    """Values of a dataset, or the value of a scalar. Raises DataFileError if they cannot be read."""
    with reading(stored.name):
        if key not in ((), slice(None)):
            return stored[key]
        values = all_values(stored)
        # a scalar has no rows
        return values if key == () or np.ndim(values) else stored[key]


def attribute(owner: Group | Dataset, name: str) -> Any:
    """The attribute `name` of `owner`. Raises DataFileError if there is no such attribute or it cannot be read."""
    with reading(f"the attribute {name} of {owner.name}"):
        return attribute_value(owner, name)


def read_text(parent: Group, path: str) -> str:
    """Read a scalar string."""
    stored = dataset(parent, path)
    with reading(stored.name):
        return bytes(all_values(stored)).decode()


def read_texts(stored: NDArray[Any]) -> list[str]:
    """Decode the fixed-length strings of a dataset."""
    return [bytes(text).decode() for text in stored]


def _is_read_only(parent: Group) -> bool:
    return cast(h5py.Group, parent).file.mode == "r"


def _record_loss(path: str, error: BaseException, lost: dict[str, str] | None) -> list[str]:
    message = f"{path} cannot be read ({reason(error)})"
    if lost is None:
        raise DataFileError(f"{message}: the file is damaged") from error
    lost[path] = message
    return []


def _member(parent: Group, path: str, kind: type) -> object:
    name = f"{parent.name.rstrip('/')}/{path.lstrip('/')}"
    with reading(name):
        try:
            found = stored_member(parent, path)
        except KeyError:
            if path in parent:
                raise
            found = None
    if not isinstance(found, kind):
        raise DataFileError(f"the file has no {kind.__name__.lower()} {name}: it is damaged")
    return found
