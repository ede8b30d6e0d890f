"""One input of a bench: from counts to values."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Channel:
    """One input. `value = counts * scale + offset` in `unit`; counts outside `valid` carry no value.

    `quantity` says what is measured: "displacement", "acceleration" or "voltage".
    `valid` is the inclusive range of counts that are measurements: outside it the converter is saturated or the
    sensor signals an error, and the sample becomes NaN.
    """

    name: str
    quantity: str
    unit: str
    scale: float
    offset: float
    valid: tuple[int, int]
    device: str

    def to_unit(self, counts: NDArray[np.int16]) -> NDArray[np.float64]:
        """Counts as values in `unit`, same shape; NaN where the counts are not a measurement."""
        values = counts.astype(np.float64) * self.scale + self.offset
        values[(counts < self.valid[0]) | (counts > self.valid[1])] = np.nan
        return values

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest value [unit] that the channel can report."""
        ends = sorted(count * self.scale + self.offset for count in self.valid)
        return ends[0], ends[1]
