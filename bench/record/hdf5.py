# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
"""The part of h5py that is used here, with types: h5py has none of its own.

Every numeric dataset is made by `write_numbers` or `grow_numbers`, which ask for its unit, so none can lack it.
"""

import os
from collections.abc import Iterable
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any, cast

import h5py
import numpy as np
from numpy.typing import DTypeLike, NDArray

from bench.record.hdf5_reading import attribute as attribute
from bench.record.hdf5_reading import dataset as dataset
from bench.record.hdf5_reading import datasets as datasets
from bench.record.hdf5_reading import group as group
from bench.record.hdf5_reading import groups as groups
from bench.record.hdf5_reading import grows as grows
from bench.record.hdf5_reading import has as has
from bench.record.hdf5_reading import is_dataset as is_dataset
from bench.record.hdf5_reading import members as members
from bench.record.hdf5_reading import names as names
from bench.record.hdf5_reading import place as place
from bench.record.hdf5_reading import places_of_chunks as places_of_chunks
from bench.record.hdf5_reading import read as read
from bench.record.hdf5_reading import read_text as read_text
from bench.record.hdf5_reading import read_texts as read_texts
from bench.record.hdf5_types import Dataset as Dataset
from bench.record.hdf5_types import File as File
from bench.record.hdf5_types import Group as Group
from bench.record.superblock import Quiet, is_let_go

# The oldest format that can be read while it is written; it is also fixed, so older tools keep up with newer writers.
VERSIONS = ("v110", "v110")
# Shares in a laboratory may not offer locks; mode "x" and the single-writer mode protect the file without them.
LOCKING = "best-effort"
PAGE = 1024
# Filters that every HDF5 library has, so that MATLAB and web viewers read the file; measured in decision 10.
FILTERS: dict[str, Any] = {"shuffle": True, "compression": "gzip", "compression_opts": 1}


def create(path: Path) -> File:
    """A new file; FileExistsError if there is one."""
    # metadata in pages of the disk's sectors: a power failure tears no piece of it in two (measured in decision 10)
    return cast(File, h5py.File(path, "x", libver=VERSIONS, locking=LOCKING, fs_strategy="page", fs_page_size=PAGE))


def let_go(file: File) -> None:
    """Close a file that can no longer be written, leaving on the disk what was flushed.

    HDF5 insists on writing what it still holds. When that fails it frees half of its state, and crashes the process
    when it comes back to it, at the latest on exit; a crash is nothing for a program that drives a shaker. So the
    rest of the writing goes to the null device.
    """
    with suppress(OSError, RuntimeError, ValueError):
        nowhere = os.open(os.devnull, os.O_RDWR)
        os.dup2(nowhere, cast(int, cast(h5py.File, file).id.get_vfd_handle()), inheritable=False)
        os.close(nowhere)
    with suppress(OSError, RuntimeError, ValueError):
        file.close()


def open_again(path: Path) -> AbstractContextManager[File]:
    """A finished file, to add to it. Raises OSError when this program has it open."""
    return cast("AbstractContextManager[File]", h5py.File(path, "r+", libver=VERSIONS, locking=LOCKING))


def open_to_read(path: Path) -> File:
    """A finished file, one that is being written, or one that a killed writer left."""
    # in single-writer mode HDF5 tries for hours to read what is damaged, so only what was not closed is opened so
    return cast(File, h5py.File(path, "r", libver=VERSIONS, locking=LOCKING, swmr=not is_let_go(path)))


def open_to_judge(path: Path) -> File:
    """Any file, also a damaged one: as if its writer had closed it, and as long as it should be."""
    return cast(File, h5py.File(Quiet(path), "r", libver=VERSIONS))


def is_hdf5(path: Path) -> bool:
    """Whether the file begins like an HDF5 file."""
    return cast(bool, h5py.is_hdf5(path))


def create_group(parent: Group, name: str, nx_class: str) -> Group:
    """A new group of a NeXus class; what is in it keeps the order in which it was made."""
    made = parent.create_group(name, track_order=True)
    made.attrs["NX_class"] = nx_class
    return made


def delete(parent: Group, name: str) -> None:
    """Take a member out of a group."""
    del cast(h5py.Group, parent)[name]


def link(parent: Group, name: str, target: str) -> None:
    """A soft link to an absolute path: the data stay where they are."""
    parent[name] = h5py.SoftLink(target)


def view(parent: Group, name: str, source: Dataset, part: slice) -> Dataset:
    """A dataset that shows part of another one of the same file and holds nothing itself."""
    layout = h5py.VirtualLayout(shape=(part.stop - part.start,), dtype=source.dtype)
    layout[:] = h5py.VirtualSource(".", source.name, shape=source.shape, dtype=source.dtype)[part]
    return cast(Dataset, cast(h5py.Group, parent).create_virtual_dataset(name, layout))


def write_numbers(parent: Group, name: str, values: object, *, unit: str, description: str) -> Dataset:
    """A dataset of numbers that are all known now; a scalar when `values` is one."""
    made = parent.create_dataset(name, data=np.asarray(values))
    made.attrs["units"], made.attrs["description"] = unit, description
    return made


def grow_numbers(
    parent: Group, name: str, dtype: DTypeLike, *, unit: str, description: str, chunk: int, compress: bool
) -> Dataset:
    """An empty dataset of numbers that rows are appended to."""
    filters = FILTERS if compress else {}
    made = parent.create_dataset(name, shape=(0,), maxshape=(None,), dtype=dtype, chunks=(chunk,), **filters)
    made.attrs["units"], made.attrs["description"] = unit, description
    return made


def text_type(width: int) -> np.dtype[Any]:
    """Texts of `width` bytes of UTF-8, in memory and in the file: HDF5 does not convert from plain bytes."""
    return cast("np.dtype[Any]", h5py.string_dtype("utf-8", width))


def grow_texts(parent: Group, name: str, width: int, *, description: str, chunk: int) -> Dataset:
    """An empty dataset of texts of at most `width` bytes of UTF-8.

    Texts of variable length are kept apart from their dataset, and a reader of a live file may see one without
    the other; so all texts are of fixed length.
    """
    made = parent.create_dataset(name, shape=(0,), maxshape=(None,), dtype=text_type(width), chunks=(chunk,))
    made.attrs["description"] = description
    return made


def write_text(parent: Group, name: str, text: str, *, width: int = 0, description: str = "") -> Dataset:
    """A scalar text that occupies its own length, or `width` bytes when it is to be replaced later."""
    stored = text.encode()
    kind = text_type(max(width, len(stored), 1))
    made = parent.create_dataset(name, data=np.array(stored, dtype=kind), dtype=kind)
    if description:
        made.attrs["description"] = description
    return made


def write_texts(parent: Group, name: str, texts: Iterable[str], *, description: str) -> Dataset:
    """A dataset of texts that are all known now."""
    stored = [text.encode() for text in texts]
    kind = text_type(max([1, *map(len, stored)]))
    made = parent.create_dataset(name, data=np.array(stored, dtype=kind), dtype=kind)
    made.attrs["description"] = description
    return made


def clip_text(text: str, width: int) -> bytes:
    """UTF-8 of at most `width` bytes; a longer text ends with an ellipsis, and no character is cut in two."""
    stored = text.encode()
    if len(stored) <= width:
        return stored
    return stored[: width - 3].decode(errors="ignore").encode() + "…".encode()


def replace_text(target: Dataset, text: str, width: int) -> None:
    """Put another text, cut to `width` bytes if it must be, into a scalar that was made `width` bytes wide."""
    target[()] = np.array(clip_text(text, width), dtype=text_type(width))


def append(target: Dataset, values: NDArray[Any]) -> None:
    """Add rows at the end."""
    start = target.shape[0]
    target.resize((start + len(values),))
    target[start:] = values


def append_chunks(target: Dataset, packed: Iterable[bytes], count: int, rows: int) -> None:
    """Add `count` whole chunks of so many rows each, which have been through the filters already."""
    raw, start = cast(h5py.Dataset, target).id, target.shape[0]
    target.resize((start + count * rows,))
    for number, data in enumerate(packed):
        raw.write_direct_chunk((start + number * rows,), data)
