"""Binary words of the sensor and their conversion to the counts of a block.

A word has 18 bits in three bytes, distinguished by their top bits (manual, p. 84):

L-byte  0 0 D5  D4  D3  D2  D1  D0
M-byte  0 1 D11 D10 D9  D8  D7  D6
H-byte  1 F D17 D16 D15 D14 D13 D12     F = 0: first value of a measurement

A distance is stored as counts from mid range, n = code - `MID_RANGE`, so that the distance from mid range is
n * `count_size`. The eight 16-bit integers below -`MID_RANGE`, and the two largest ones, are fault marks of samples
without a distance.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

FULL_SCALE = 65520
"""Largest word that is a distance, at 101 % of the measuring range (manual, p. 65)."""

MID_RANGE = FULL_SCALE // 2
"""Word at mid range."""

Number = TypeVar("Number", float, NDArray[np.float64])


def count_size(measuring_range: float) -> float:
    """Distance per count [m] (manual, p. 65)."""
    return 1.02 * measuring_range / FULL_SCALE


def encode(value: int, first: bool) -> bytes:
    """The three bytes of a word of 18 bits; `first` marks the first value of a measurement."""
    top = 0x80 if first else 0xC0
    return bytes((value & 0x3F, 0x40 | value >> 6 & 0x3F, top | value >> 12 & 0x3F))


def distance(code: Number, measuring_range: float) -> Number:
    """Distance from the start of the measuring range [m]; meaningful for codes from 0 to `FULL_SCALE`.

    Source: manual, p. 65, without mastering: d = (102 code / 65520 - 1) / 100 of the measuring range.
    """
    return (code - MID_RANGE) * count_size(measuring_range) + 0.5 * measuring_range


def code_of(distance: Number, measuring_range: float) -> Number:
    """The word, not rounded, of a distance [m]: the inverse of `distance`."""
    return (distance - 0.5 * measuring_range) / count_size(measuring_range) + MID_RANGE


@dataclass(frozen=True)
class Words:
    """Decoded words: the 18-bit `code` and the flag `first`, shape (n,)."""

    code: NDArray[np.int32]
    first: NDArray[np.bool_]


class Decoder:
    """Extracts words from a stream that arrives in arbitrary pieces and may have lost bytes.

    A word is a sequence of an L-, an M- and an H-byte; other bytes are dropped.
    """

    def __init__(self) -> None:
        self._begun = b""

    def restart(self) -> None:
        """Discard a partial word."""
        self._begun = b""

    def feed(self, chunk: bytes) -> Words:
        """The words completed by `chunk`."""
        data = np.frombuffer(self._begun + chunk, dtype=np.uint8)
        kind = data >> 6
        low = kind == 0
        half = kind == 1
        half[1:] &= low[:-1]
        half[:1] = False
        whole = kind >= 2
        whole[1:] &= half[:-1]
        whole[:1] = False
        self._begun = data[-1:].tobytes() if low[-1:].any() else data[-2:].tobytes() if half[-1:].any() else b""
        end = np.flatnonzero(whole)
        high = data[end].astype(np.int32)
        code = (data[end - 2] & 0x3F) | (data[end - 1] & 0x3F).astype(np.int32) << 6 | (high & 0x3F) << 12
        return Words(code, (high & 0x40) == 0)


LOST = -32768
NO_PEAK = -32767
TOO_CLOSE = -32766
TOO_FAR = -32765
NOT_CALCULABLE = -32764
TOO_WIDE = -32763
LASER_OFF = -32762
OTHER = -32761
LATE = 32767
IMPLAUSIBLE = 32766

MEANINGS: Mapping[int, str] = MappingProxyType(
    {
        LOST: "the value was lost on the line",
        NO_PEAK: "no reflection detected",
        TOO_CLOSE: "the target is in front of the measuring range",
        TOO_FAR: "the target is beyond the measuring range",
        NOT_CALCULABLE: "the value cannot be calculated",
        TOO_WIDE: "the reflected peak is too large or too wide",
        LASER_OFF: "the laser is off; its on/off wire must be grounded",
        LATE: "the value did not arrive, or arrived after its block was due",
        IMPLAUSIBLE: "the value differs from its predecessors by more than a moving target allows",
        OTHER: "no distance: the baud rate is too low for the data, or an unknown error",
    }
)
"""Meanings of the fault marks."""

_FIRST_ERROR = 262075
_MARKS = np.array(
    [OTHER, NO_PEAK, TOO_CLOSE, TOO_FAR, OTHER, NOT_CALCULABLE, TOO_WIDE, LASER_OFF, OTHER], dtype=np.int16
)
"""Fault marks of the error words from 262075 on (manual, p. 66, which lacks 262079); the last applies to all others."""


def marked(codes: NDArray[np.integer]) -> NDArray[np.int16]:
    """Counts from mid range, same shape, of 18-bit words; a fault mark for each word that is not a distance."""
    counts = (codes - MID_RANGE).astype(np.int16)
    bad = (codes < 0) | (codes > FULL_SCALE)
    if bad.any():
        place = codes[bad].astype(np.int64) - _FIRST_ERROR
        known = (place >= 0) & (place < _MARKS.size)
        counts[bad] = _MARKS[np.where(known, place, _MARKS.size - 1)]
    return counts
