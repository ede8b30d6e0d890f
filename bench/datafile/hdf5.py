# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
"""Typed interface to the part of h5py used here; h5py publishes no types.

The numeric datasets of a new file are created by `write_numbers` or `grow_numbers`, which require a unit, or as a field
of a table, which has one.
"""

import os
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any, cast

import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray

from bench.datafile.access import VERSIONS, Quiet, is_let_go, locking, open_living
from bench.datafile.access import open_to_write as open_to_write
from bench.datafile.hdf5_creation import GZIP_LEVEL, create_fixed, create_growing
from bench.datafile.hdf5_creation import append as append
from bench.datafile.hdf5_creation import copy_member as copy_member
from bench.datafile.hdf5_creation import describe as describe
from bench.datafile.hdf5_creation import memory_file as memory_file
from bench.datafile.hdf5_creation import overwrite as overwrite
from bench.datafile.hdf5_creation import text_type as text_type
from bench.datafile.hdf5_objects import all_values as all_values
from bench.datafile.hdf5_objects import attribute_value as attribute_value
from bench.datafile.hdf5_objects import attributes as attributes
from bench.datafile.hdf5_objects import is_hard_link as is_hard_link
from bench.datafile.hdf5_reading import Dataset as Dataset
from bench.datafile.hdf5_reading import File as File
from bench.datafile.hdf5_reading import Group as Group
from bench.datafile.hdf5_reading import attribute as attribute
from bench.datafile.hdf5_reading import dataset as dataset
from bench.datafile.hdf5_reading import datasets as datasets
from bench.datafile.hdf5_reading import group as group
from bench.datafile.hdf5_reading import groups as groups
from bench.datafile.hdf5_reading import grows as grows
from bench.datafile.hdf5_reading import has as has
from bench.datafile.hdf5_reading import is_dataset as is_dataset
from bench.datafile.hdf5_reading import member_or_target as member_or_target
from bench.datafile.hdf5_reading import members as members
from bench.datafile.hdf5_reading import names as names
from bench.datafile.hdf5_reading import objects as objects
from bench.datafile.hdf5_reading import place as place
from bench.datafile.hdf5_reading import places_of_chunks as places_of_chunks
from bench.datafile.hdf5_reading import read as read
from bench.datafile.hdf5_reading import read_text as read_text
from bench.datafile.hdf5_reading import read_texts as read_texts

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
PAGE = 1024
# Filters that HDF5 libraries usually include, so that MATLAB and web viewers can read the file; measured in
# docs/decisions, no. 10.
FILTERS: dict[str, Any] = {"shuffle": True, "compression": "gzip", "compression_opts": GZIP_LEVEL}


def create(path: Path) -> File:
    """Create a new file; raises FileExistsError if it exists."""
    # metadata are allocated in small pages, so that no object header crosses the border of a disk sector, where a power
    # failure could leave it half written (measured in docs/decisions, no. 10)
    return cast(File, h5py.File(path, "x", libver=VERSIONS, locking=False, fs_strategy="page", fs_page_size=PAGE))


def release(file: File) -> None:
    """Close a file that can no longer be written, keeping the flushed data on the disk.

    HDF5 tries to write its pending data. If that fails, it frees part of its state and later crashes the process, at
    the latest on exit, which is unacceptable in a program that drives a shaker. The remaining writes are therefore
    redirected to the null device.
    """
    with suppress(OSError, RuntimeError, ValueError):
        nowhere = os.open(os.devnull, os.O_RDWR)
        os.dup2(nowhere, cast(int, cast(h5py.File, file).id.get_vfd_handle()), inheritable=False)
        os.close(nowhere)
    with suppress(OSError, RuntimeError, ValueError):
        file.close()


def open_to_extend(path: Path) -> AbstractContextManager[File]:
    """Open a finished file for additions. Raises OSError if this program already has the file open."""
    return cast("AbstractContextManager[File]", h5py.File(path, "r+", libver=VERSIONS, locking=locking()))


def open_to_read(path: Path) -> File:
    """Open a finished file, one being written, or one left by a killed writer."""
    # in SWMR mode HDF5 may retry for hours to read damaged data, so only files that were not closed are opened in it
    if not is_let_go(path):
        return cast(File, open_living(path))
    return cast(File, h5py.File(path, "r", libver=VERSIONS, locking=locking()))


def open_to_judge(path: Path) -> File:
    """Open any file, even a damaged one, as if its writer had closed it and no bytes were missing."""
    return cast(File, h5py.File(Quiet(path), "r", libver=VERSIONS))


def is_hdf5(path: Path) -> bool:
    """Whether the file has the HDF5 signature at one of the offsets that the format allows."""
    # not by HDF5, which holds Python's lock while a disk stalls
    place = 0
    with suppress(OSError), path.open("rb") as file:
        while (found := file.read(len(_SIGNATURE))) and found != _SIGNATURE:
            place = file.seek(max(512, 2 * place))
        return bool(found)
    return False


def create_group(parent: Group, name: str, nx_class: str) -> Group:
    """Create a group of a NeXus class; its members keep their order of creation."""
    made = parent.create_group(name, track_order=True)
    describe(made, NX_class=nx_class)
    return made


def delete(parent: Group, name: str) -> None:
    """Remove a member from a group."""
    del cast(h5py.Group, parent)[name]


def link(parent: Group, name: str, target: str) -> None:
    """Create a soft link to an absolute path."""
    parent[name] = h5py.SoftLink(target)


def view(parent: Group, name: str, source: Dataset, part: slice) -> Dataset:
    """Create a virtual dataset that shows part of another dataset in the same file."""
    layout = h5py.VirtualLayout(shape=(part.stop - part.start,), dtype=source.dtype)
    layout[:] = h5py.VirtualSource(".", source.name, shape=source.shape, dtype=source.dtype)[part]
    return cast(Dataset, cast(h5py.Group, parent).create_virtual_dataset(name, layout))


def write_numbers(parent: Group, name: str, values: object, *, unit: str, description: str) -> Dataset:
    """Create a dataset of the numbers `values`; a scalar dataset if `values` is a scalar."""
    made = cast(Dataset, create_fixed(parent, name, np.asarray(values)))
    describe(made, units=unit, description=description)
    return made


def grow_numbers(
    parent: Group, name: str, dtype: DTypeLike, *, unit: str, description: str, chunk: int, compress: bool
) -> Dataset:
    """Create an empty, growing dataset of numbers."""
    attributes = {"units": unit, "description": description}
    return grow(parent, name, np.dtype(dtype), chunk, compress=compress, attributes=attributes)


def grow(
    parent: Group,
    name: str,
    dtype: np.dtype[Any],
    chunk: int,
    *,
    compress: bool,
    attributes: Mapping[str, Any] | None = None,
) -> Dataset:
    """Create an empty, growing dataset of numbers, whose `attributes` include the unit, or of strings (`text_type`)."""
    made = cast(Dataset, create_growing(parent, name, dtype, chunk, compress=compress))
    describe(made, **(attributes or {}))
    return made


def write_text(parent: Group, name: str, text: str, *, width: int = 0, description: str = "") -> Dataset:
    """Create a scalar string as long as `text`, or of `width` bytes if it is to be replaced later."""
    stored = text.encode()
    kind = text_type(max(width, len(stored), 1))
    made = cast(Dataset, create_fixed(parent, name, np.array(stored, dtype=kind)))
    if description:
        describe(made, description=description)
    return made


MANY = 50_000
"""Maximum number of strings of an array that are written at once."""


def write_texts(parent: Group, name: str, texts: Iterable[str], *, description: str) -> Dataset:
    """Create a dataset of the strings `texts`."""
    stored = [text.encode() for text in texts]
    kind = text_type(max([1, *map(len, stored)]))
    made = cast(Dataset, create_fixed(parent, name, np.array(stored, dtype=kind)))
    describe(made, description=description)
    return made


def write_text_array(parent: Group, name: str, texts: NDArray[np.str_], *, description: str) -> Dataset:
    """Write an array of strings like `write_texts`, but in parts, because string objects need far more memory than an
    array.
    """
    if len(texts) <= MANY:
        return write_texts(parent, name, texts.tolist(), description=description)
    parts = [slice(first, first + MANY) for first in range(0, len(texts), MANY)]
    kind = text_type(max(1, *(_encoded(texts[part]).dtype.itemsize for part in parts)))
    made = parent.create_dataset(name, shape=texts.shape, dtype=kind)
    for part in parts:
        made[part] = _encoded(texts[part]).astype(kind)
    describe(made, description=description)
    return made


def _encoded(texts: NDArray[np.str_]) -> NDArray[np.bytes_]:
    """The strings as UTF-8, as wide as the longest of them."""
    try:
        # several times as fast for ASCII
        return texts.astype(f"S{max(1, int(np.strings.str_len(texts).max()))}")
    except UnicodeEncodeError:
        return np.char.encode(texts, "utf-8")


def clip_text(text: str, width: int) -> bytes:
    """The text as UTF-8 of at most `width` bytes; a longer text is cut off between two characters and ends with an
    ellipsis.
    """
    stored = text.encode()
    if len(stored) <= width:
        return stored
    return stored[: width - 3].decode(errors="ignore").encode() + "…".encode()


def replace_text(target: Dataset, text: str, width: int) -> None:
    """Replace the string in a scalar of `width` bytes; a longer `text` is truncated."""
    overwrite(target, np.array(clip_text(text, width), dtype=text_type(width)))


def append_chunks(target: Dataset, packed: Iterable[bytes], count: int, rows: int) -> None:
    """Append `count` complete chunks of `rows` rows each, which have already been filtered."""
    raw, start = cast(h5py.Dataset, target).id, target.shape[0]
    target.resize((start + count * rows,))
    for number, data in enumerate(packed):
        raw.write_direct_chunk((start + number * rows,), data)
