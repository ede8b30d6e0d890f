"""What the sensor says when it has no distance, and how that is stored.

A laser's value is stored as counts from mid range, n = code - `MID_RANGE`, so that the value from mid range is
n * `count_size`. The eight 16-bit integers below -`MID_RANGE` are left over and say why there is none.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from drivers.optoncdt.codec import FULL_SCALE, MID_RANGE

LOST = -32768
NO_PEAK = -32767
TOO_CLOSE = -32766
TOO_FAR = -32765
NOT_CALCULABLE = -32764
TOO_WIDE = -32763
LASER_OFF = -32762
OTHER = -32761

MEANINGS: Mapping[int, str] = MappingProxyType(
    {
        LOST: "the value was lost on the line",
        NO_PEAK: "no reflection is seen",
        TOO_CLOSE: "the target is before the measuring range",
        TOO_FAR: "the target is behind the measuring range",
        NOT_CALCULABLE: "the value cannot be calculated",
        TOO_WIDE: "the reflection is too large",
        LASER_OFF: "the laser is off; its on/off wire must be at ground",
        OTHER: "no distance: the baud rate is too low for the data, or an unknown error",
    }
)
"""What counts outside the measuring range mean."""

_FIRST_ERROR = 262075
_MARKS = np.array(
    [OTHER, NO_PEAK, TOO_CLOSE, TOO_FAR, OTHER, NOT_CALCULABLE, TOO_WIDE, LASER_OFF, OTHER], dtype=np.int16
)
"""Marks of the error words from 262075 on (manual, p. 66, which has no 262079); the last is for all others."""


def marked(codes: NDArray[np.integer]) -> NDArray[np.int16]:
    """Counts from mid range, same shape, for words of 18 bits; a mark for each word that is not a distance."""
    counts = (codes - MID_RANGE).astype(np.int16)
    bad = (codes < 0) | (codes > FULL_SCALE)
    if bad.any():
        place = codes[bad].astype(np.int64) - _FIRST_ERROR
        known = (place >= 0) & (place < _MARKS.size)
        counts[bad] = _MARKS[np.where(known, place, _MARKS.size - 1)]
    return counts
