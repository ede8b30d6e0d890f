"""Input channel, and the conversion of its counts to values."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

TABLE_DISPLACEMENT, TABLE_ACCELERATION = "table_displacement", "table_acceleration"
TABLE_FORCE, COIL_CURRENT = "table_force", "coil_current"
STOREYS = ("laser_1", "laser_2")
"""Names of the channels, independent of the instrument: table and coil, and the lasers at storeys 1 and 2."""

Counts = NDArray[np.int16 | np.int32]
"""Array of a converter's counts: of 16-bit integers for most converters, of 32-bit integers for 24-bit ones."""

_NO_FAULTS: Mapping[int, str] = MappingProxyType({})


@dataclass(frozen=True)
class Channel:
    """Input channel.

    `value = offset + scale counts + higher[0] counts^2 + ...` in `unit`.

    `quantity` is the measured quantity, such as "displacement" or "acceleration". `valid` is the inclusive range of
    counts of valid measurements: outside it the converter is saturated or the sensor signals an error, and the sample
    becomes NaN. `faults` gives the meaning of individual counts outside that range. The `delay` [s] of the channel,
    with standard uncertainty `delay_uncertainty` [s], has already been removed from its samples. `higher` are the small
    higher-order coefficients of a converter whose own calibration is a polynomial.
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
    delay: float = 0.0
    delay_uncertainty: float = 0.0

    def to_unit(self, counts: Counts) -> NDArray[np.float64]:
        """Convert counts to values in `unit`, same shape; NaN for counts outside `valid`."""
        values = self._converted(counts.astype(np.float64))
        values[(counts < self.valid[0]) | (counts > self.valid[1])] = np.nan
        return values

    def meaning(self, count: int) -> str:
        """Why an invalid count is invalid."""
        end = "lower" if count < self.valid[0] else "upper"
        return self.faults.get(count) or f"beyond the {end} end of its range"

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest value [unit] of the valid counts."""
        low, high = sorted(self._converted(np.array(self.valid, dtype=np.float64)))
        return float(low), float(high)

    @property
    def storage(self) -> type[np.int16] | type[np.int32]:
        """Narrowest integer type that can represent every valid count."""
        return np.int16 if self.valid[0] >= -(2**15) and self.valid[1] < 2**15 else np.int32

    def _converted(self, counts: NDArray[np.float64]) -> NDArray[np.float64]:
        values = counts * self.scale + self.offset
        for power, coefficient in enumerate(self.higher, 2):
            values += coefficient * counts**power
        return values
