"""The checksum of every dataset: of what is known before the run at its beginning, of all that grows at its end.

A checksum is SHA-256 of the values' bytes as they are stored, uncompressed and in order, in hexadecimal digits.
Those of attributes are of their names and values as JSON: a conversion that was changed later is found as well.
"""

import json
from collections.abc import Iterable, Mapping
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5

GROUP = "checksums"
WIDTH = 64
ROWS_AT_ONCE = 2**18
_DATASETS, _VALUES, _ATTRIBUTES = f"{GROUP}/dataset", f"{GROUP}/values", f"{GROUP}/attributes"


class Checksums:
    """The table of a new file; made last, when every dataset exists."""

    def __init__(self, entry: hdf5.Group, changing: Iterable[str]) -> None:
        """`changing` are the paths of what is not yet as it will be: its checksums stay empty until `seal`."""
        stored = list(hdf5.datasets(entry))
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
    found = {name: _plain(stored.attrs[name]) for name in stored.attrs}
    return sha256(json.dumps(found, sort_keys=True).encode()).hexdigest()


def read(entry: hdf5.Group) -> dict[str, tuple[str, str]]:
    """The checksums of values and attributes by path; those of values are empty where the file was not closed."""
    columns = [hdf5.read_texts(hdf5.dataset(entry, path)[:]) for path in (_DATASETS, _VALUES, _ATTRIBUTES)]
    return {path: (values, attributes) for path, values, attributes in zip(*columns, strict=True)}


def _bytes(values: NDArray[Any]) -> bytes:
    return values.tobytes()


def _plain(value: Any) -> Any:
    return value if isinstance(value, str | int | float) else np.asarray(value).tolist()
