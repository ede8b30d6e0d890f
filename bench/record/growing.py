"""A dataset that rows are appended to, with the checksum of what it holds so far."""

from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5
from bench.record.packing import Packer


class Growing:
    """Appends, and hashes what it appends: the end of a long run needs no second reading."""

    def __init__(self, stored: hdf5.Dataset, packer: Packer | None = None) -> None:
        """Chunks that are compressed go through `packer`."""
        self._stored = stored
        self._packer = packer
        self._digest = sha256()

    @property
    def path(self) -> str:
        """Where the dataset is in the file."""
        return self._stored.name

    @property
    def checksum(self) -> str:
        """SHA-256 of the rows so far."""
        return self._digest.hexdigest()

    def append(self, values: NDArray[Any]) -> None:
        """Add rows at the end."""
        kept = np.ascontiguousarray(values, dtype=self._stored.dtype)
        if self._packer is None:
            hdf5.append(self._stored, kept)
        else:
            self._packer.append(self._stored, kept)
        # a view of bytes, because texts offer no buffer of their own
        self._digest.update(kept.view(np.uint8).data)
