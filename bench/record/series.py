"""Channels and runs of a file as arrays that are read when they are asked for."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROWS_AT_ONCE = 2**18


@dataclass(frozen=True)
class Series:
    """An array of one dimension in the file: `series[i]`, `series[a:b]`, `series[:]` and `numpy.asarray(series)`.

    `unit` is that of its values; `quantity` says what they are. Nothing is kept in memory.
    """

    name: str
    quantity: str
    unit: str
    read: Callable[[slice], NDArray[Any]]
    rows: range

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, key: int | slice) -> Any:
        if isinstance(key, slice):
            part = self.rows[key]
            if part.step < 0:
                return self.read(slice(part[-1], part[0] + 1, -part.step))[::-1] if part else self.read(slice(0, 0))
            return self.read(slice(part.start, max(part.start, part.stop), part.step))
        row = self.rows[key]
        return self.read(slice(row, row + 1))[0]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        if copy is False:
            raise ValueError("what is in a file cannot be had without a copy")
        return np.asarray(self[:], dtype=dtype)

    def pieces(self, size: int = ROWS_AT_ONCE) -> Iterator[NDArray[Any]]:
        """The values in order, at most `size` at once."""
        for start in range(0, len(self), size):
            yield self[start : start + size]


@dataclass(frozen=True)
class RecordedRun:
    """One run, from arming to stopping: its `number` from 1, its `rows` in the file and its arrays by channel.

    `time` is in seconds since the rig was armed; it jumps where samples are missing.
    """

    number: int
    rows: range
    channels: Mapping[str, Series]
    drive: Series
    time: Series
