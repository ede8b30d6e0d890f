"""The binary words of the sensor: 18 bits in three bytes, told apart by their top bits (manual, p. 84).

L-byte  0 0 D5  D4  D3  D2  D1  D0
M-byte  0 1 D11 D10 D9  D8  D7  D6
H-byte  1 F D17 D16 D15 D14 D13 D12     F = 0: first value of a measurement
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

FULL_SCALE = 65520
"""Largest word that is a distance, at 101 % of the measuring range (manual, p. 65)."""

MID_RANGE = FULL_SCALE // 2
"""The word at the middle of the measuring range."""

Number = TypeVar("Number", float, NDArray[np.float64])


def count_size(measuring_range: float) -> float:
    """How far the target moves from one word to the next [m] (manual, p. 65)."""
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
    """The inverse of `distance`, not rounded."""
    return (distance - 0.5 * measuring_range) / count_size(measuring_range) + MID_RANGE


@dataclass(frozen=True)
class Words:
    """Decoded words, all 18 bits of them: `code` and `first`, shape (n,)."""

    code: NDArray[np.int32]
    first: NDArray[np.bool_]


class Decoder:
    """Finds the words in a stream that may be cut anywhere and may have lost bytes.

    A word is an L-, an M- and an H-byte in a row; what does not belong to one is dropped.
    """

    def __init__(self) -> None:
        self._begun = b""

    def restart(self) -> None:
        """Forget the word that was begun: what follows on the line does not continue it."""
        self._begun = b""

    def feed(self, chunk: bytes) -> Words:
        """The words that end in `chunk`."""
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
