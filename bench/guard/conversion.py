"""Conversion of a block's counts to values, and the smallest and largest value of each channel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.rig import Channel, Counts

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Extremes:
    """Smallest and largest value of each channel, by column, in a block without missing samples."""

    low: list[float]
    high: list[float]

    def magnitude(self, column: int) -> float:
        """Largest magnitude of a channel."""
        return max(-self.low[column], self.high[column])


class Conversion:
    """Conversion of blocks of counts, of all channels at once if all are linear and no sample is missing."""

    def __init__(self, channels: tuple[Channel, ...]) -> None:
        self._channels = channels
        self._linear = [(float(each.scale), float(each.offset)) for each in channels if not each.higher]
        self._scale, self._offset = (np.array([getattr(each, key) for each in channels]) for key in ("scale", "offset"))

    def of(self, counts: Counts) -> tuple[Array, Extremes | None]:
        """Convert counts, shape (n, n_channels), n > 0, to values, same shape; NaN where a count is invalid.

        Returns the values and their extremes, or None instead of the extremes if any sample is missing.
        """
        low, high = np.minimum.reduce(counts).tolist(), np.maximum.reduce(counts).tolist()
        if len(self._linear) < len(self._channels) or self._missing(low, high):
            return self._by_channel(counts)
        values = counts.astype(np.float64, order="F")
        values *= self._scale
        values += self._offset
        # convert with the same two operations as above, so that the extremes are bit-identical to those of the array
        for k, (scale, offset) in enumerate(self._linear):
            first, last = low[k] * scale + offset, high[k] * scale + offset
            low[k], high[k] = (first, last) if scale > 0.0 else (last, first)
        return values, Extremes(low, high)

    def _missing(self, low: list[int], high: list[int]) -> bool:
        for channel, least, most in zip(self._channels, low, high, strict=True):
            if least < channel.valid[0] or most > channel.valid[1]:
                return True
        return False

    def _by_channel(self, counts: Counts) -> tuple[Array, Extremes | None]:
        values = np.empty(counts.shape, order="F")
        for column, channel in enumerate(self._channels):
            values[:, column] = channel.to_unit(counts[:, column])
        if np.isnan(values).any():
            return values, None
        return values, Extremes(values.min(axis=0).tolist(), values.max(axis=0).tolist())
