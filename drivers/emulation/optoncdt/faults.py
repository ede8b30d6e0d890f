"""What can go wrong on the way from the sensor to the client."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from drivers.emulation.optoncdt.words import WORD

Bytes = NDArray[np.uint8]

_HYPHEN = 0x2D


class Line:
    """What becomes of the bytes between sensor and client: faultless until told otherwise."""

    def __init__(self, random: Generator) -> None:
        self._random = random
        self.lose = 0
        """How many of the next bytes get lost."""
        self.probability = 0.0
        """The probability that a byte gets lost."""
        self.garbage = 0
        """How many bytes of noise come next."""
        self.silent_until = -np.inf
        """Until when nothing gets through [s]."""
        self.splits_words = False
        """Whether an answer may stand within a value."""

    def carried(self, stream: Bytes, answer: bytes, now: float) -> Bytes:
        """What arrives of the values of `stream` and of an answer, which stands between any two of the values."""
        sent = self._woven(stream, answer)
        if now < self.silent_until:
            return sent[:0]
        if self.garbage:
            noise = self._random.integers(0, 256, self.garbage, dtype=np.uint8)
            sent, self.garbage = np.concatenate((noise, sent)), 0
        if self.lose:
            lost = min(self.lose, sent.size)
            sent, self.lose = sent[lost:], self.lose - lost
        if self.probability:
            sent = sent[self._random.random(sent.size) >= self.probability]
        return sent

    def misread(self, sent: Bytes, baud: int, read_at: int) -> Bytes:
        """What a client makes of bytes sent at `baud` when it reads at another rate.

        Noise; without a hyphen, so that no test depends on whether it spells a prompt by chance.
        """
        noise = self._random.integers(0, 256, round(sent.size * min(1.0, read_at / baud)), dtype=np.uint8)
        return np.where(noise == _HYPHEN, np.uint8(0), noise)

    def _woven(self, stream: Bytes, answer: bytes) -> Bytes:
        if not answer:
            return stream
        place = WORD * int(self._random.integers(0, stream.size // WORD + 1))
        if self.splits_words and place < stream.size:
            place += int(self._random.integers(1, WORD))
        return np.insert(stream, place, np.frombuffer(answer, dtype=np.uint8))
