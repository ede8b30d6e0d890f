"""Values as they go over the line: codes of distances and errors, three bytes a value."""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

WORD = 3
"""Bytes of a value."""
WORD_BITS = 30
"""Bits of a value on the line: each byte has a start bit and a stop bit."""
LAST_DISTANCE = 65520
"""Code of the end of the reserve behind the measuring range (manual of the optoNCDT 1420, p. 65)."""
LAST_MASTERED = 262071
"""Largest code that a mastered distance may have: the errors begin above."""


class Fault(IntEnum):
    """Codes in place of a distance (manual of the optoNCDT 1420, p. 66)."""

    DATA_VOLUME = 262075
    NO_PEAK = 262076
    TOO_CLOSE = 262077
    TOO_FAR = 262078
    LASER_OFF = 262082


def distance_codes(shares: NDArray[np.float64]) -> NDArray[np.int64]:
    """Codes of distances given as shares of the measuring range, shape (n,), reserve included.

    x = (100 d / MR + 1) 65520 / 102 (manual of the optoNCDT 1420, p. 65). NaN is not allowed.
    """
    codes = np.rint((100.0 * shares + 1.0) * (LAST_DISTANCE / 102.0))
    return np.clip(codes, 0, LAST_DISTANCE).astype(np.int64)


def mastered_codes(shares: NDArray[np.float64]) -> NDArray[np.int64]:
    """Codes of mastered distances, shape (n,): x = (100 d / MR + 51) 65520 / 102, over 18 bits (manual, p. 65)."""
    codes = np.rint((100.0 * shares + 51.0) * (LAST_DISTANCE / 102.0))
    return np.clip(codes, 0, LAST_MASTERED).astype(np.int64)


def words(blocks: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Bytes of `n` blocks of `m` values of 18 bits, shape (n, m): low, middle and high six bits (manual, p. 84).

    The two upper bits tell the three bytes apart, and the first value of a block from the others.
    """
    sent = np.empty((*blocks.shape, WORD), dtype=np.uint8)
    sent[:, :, 0] = blocks & 0x3F
    sent[:, :, 1] = blocks >> 6 & 0x3F | 0x40
    sent[:, :, 2] = blocks >> 12 & 0x3F | 0xC0
    sent[:, 0, 2] &= 0xBF
    return sent.reshape(-1)
