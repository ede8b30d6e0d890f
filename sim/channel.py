"""One input of a bench: from counts to values."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

Counts = NDArray[np.int16 | np.int32]
"""What a converter gives: 16 bits are enough for most, 24 bits need the wider integer."""

_NO_FAULTS: Mapping[int, str] = MappingProxyType({})


@dataclass(frozen=True)
class Channel:
    """One input. `value = offset + scale counts + higher[0] counts^2 + ...` in `unit`.

    `quantity` says what is measured: "displacement", "acceleration" or "voltage".
    `valid` is the inclusive range of counts that are measurements: outside it the converter is saturated or the
    sensor signals an error, and the sample becomes NaN. `faults` says what single counts outside it mean.
    `higher` are the small terms of a converter whose own calibration is a polynomial.
    """

    name: str
    quantity: str
    unit: str
    scale: float
    offset: float
    valid: tuple[int, int]
    device: str
    higher: tuple[float, ...] = ()
    faults: Mapping[int, str] = field(default_factory=lambda: _NO_FAULTS)

    def to_unit(self, counts: Counts) -> NDArray[np.float64]:
        """Counts as values in `unit`, same shape; NaN where the counts are not a measurement."""
        values = self._converted(counts.astype(np.float64))
        values[(counts < self.valid[0]) | (counts > self.valid[1])] = np.nan
        return values

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest value [unit] that the channel can report."""
        low, high = sorted(self._converted(np.array(self.valid, dtype=np.float64)))
        return float(low), float(high)

    @property
    def storage(self) -> type[np.int16] | type[np.int32]:
        """The narrower integer that holds every valid count."""
        return np.int16 if self.valid[0] >= -(2**15) and self.valid[1] < 2**15 else np.int32

    def _converted(self, counts: NDArray[np.float64]) -> NDArray[np.float64]:
        values = counts * self.scale + self.offset
        for power, coefficient in enumerate(self.higher, 2):
            values += coefficient * counts**power
        return values
