"""Keeps the last samples of something that never ends."""

from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput

T = TypeVar("T", bound=np.generic)


class History(Generic[T]):
    """The newest `capacity` rows of a growing table, by row number; rows are appended and never changed."""

    def __init__(self, capacity: int, columns: int, dtype: type[T]) -> None:
        self._rows: NDArray[T] = np.zeros((capacity, columns), dtype=dtype)
        self._end = 0

    @property
    def end(self) -> int:
        """How many rows were ever appended: the number of the next one."""
        return self._end

    def append(self, rows: NDArray[T]) -> None:
        """Add `rows`, shape (n, columns)."""
        capacity = self._rows.shape[0]
        kept = rows[-capacity:]
        places = np.arange(self._end + len(rows) - len(kept), self._end + len(rows)) % capacity
        self._rows[places] = kept
        self._end += len(rows)

    def at(self, numbers: NDArray[np.int64]) -> NDArray[T]:
        """Rows of these numbers, shape (n, columns). Raises InvalidInput for rows that are gone or still to come."""
        if numbers.size and not (self._end - self._rows.shape[0] <= numbers.min() and numbers.max() < self._end):
            allowed = f"rows {max(self._end - self._rows.shape[0], 0)} to {self._end - 1} are kept"
            raise InvalidInput("row", (int(numbers.min()), int(numbers.max())), allowed)
        return self._rows[numbers % self._rows.shape[0]]
