"""How much of a dataset is in the file: of one that was cut short, HDF5 reads zeros beyond its end and says nothing."""

from collections.abc import Mapping

from bench.record import hdf5
from bench.record.declared import part_of
from bench.record.errors import RecordError


def intact_rows(stored: hdf5.Dataset, size: int) -> int:
    """Rows before the first chunk that is not wholly in the first `size` bytes of the file, or whose place is lost."""
    length, chunk = stored.shape[0], (stored.chunks or (1,))[0]
    places = hdf5.places_of_chunks(stored)
    for start in range(0, length, chunk):
        place = places.get(start)
        if place is None or place[0] + place[1] > size:
            return start
    return length


def is_within(stored: hdf5.Dataset, size: int) -> bool:
    """Whether a dataset that does not grow is wholly in the first `size` bytes of the file."""
    place = hdf5.place(stored)
    return place is None or place[0] + place[1] <= size


def check_whole(entry: hdf5.Group, counted: Mapping[str, int], size: int) -> None:
    """Read what describes the file, and look up where its counted rows are.

    Raises what HDF5 raises for what is damaged, and RecordError where rows are beyond `size` bytes.
    """
    for group in hdf5.groups(entry):
        for name in group.attrs:
            _ = group.attrs[name]
    for stored in hdf5.datasets(entry):
        for name in stored.attrs:
            _ = stored.attrs[name]
        if hdf5.grows(stored):
            whole = intact_rows(stored, size) >= min(counted[part_of(stored.name)], stored.shape[0])
        else:
            whole = is_within(stored, size)
        if not whole:
            raise RecordError(f"{stored.name} reaches beyond the end of the file: it is truncated")
