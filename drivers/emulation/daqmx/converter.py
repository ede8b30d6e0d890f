"""The analogue-to-digital converter of one input: from the plant's counts to its own raw counts, and to volts."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.emulation.daqmx.device import AnalogInputs
from sim.channel import Counts
from sim.sensors import Converter

_NEWTON_STEPS = 3
"""A calibration polynomial is all but straight: three steps are exact to a fraction of a count."""


class InputConverter:
    """Input `k` of a device, set to `range` [V]. `source` is the converter that made the plant's counts.

    volts = coefficients[0] + coefficients[1] raw + coefficients[2] raw^2 + ...
    """

    def __init__(self, inputs: AnalogInputs, k: int, range: float, source: Converter) -> None:
        widest = inputs.ranges[0]
        straight = (0.0, 2.0 * widest / 2**inputs.resolution)
        self.range = range
        self.coefficients = tuple(c * range / widest for c in inputs.polynomials.get(k, straight))
        self._rails = -(2 ** (inputs.resolution - 1)), 2 ** (inputs.resolution - 1) - 1
        self._dtype = np.int16 if inputs.raw_bits == 16 else np.int32
        self._source = source
        self._same = self.coefficients == (0.0, source.lsb) and self._rails == source.codes

    def is_like(self, other: "InputConverter") -> bool:
        """Whether both give the same raw counts."""
        return self.coefficients == other.coefficients and self._rails == other._rails

    def raw(self, counts: Counts) -> NDArray[np.int16 | np.int32]:
        """Raw counts for the plant's counts, same shape; at the rail wherever the plant's converter is at its own."""
        if self._same:
            return counts.astype(self._dtype)
        volts = counts.astype(np.float64) * self._source.lsb
        raw = (volts - self.coefficients[0]) / self.coefficients[1]
        if len(self.coefficients) > 2:
            for _ in range(_NEWTON_STEPS):
                raw -= (_polynomial(self.coefficients, raw) - volts) / self._slope(raw)
        lowest, highest = self._rails
        raw = np.clip(np.rint(raw), lowest, highest)
        raw[counts <= self._source.codes[0]] = lowest
        raw[counts >= self._source.codes[1]] = highest
        return raw.astype(self._dtype)

    def volts(self, raw: NDArray[np.int16 | np.int32]) -> NDArray[np.float64]:
        """What the driver makes of raw counts [V], same shape."""
        return _polynomial(self.coefficients, raw.astype(np.float64))

    def _slope(self, raw: NDArray[np.float64]) -> NDArray[np.float64]:
        return _polynomial([power * c for power, c in enumerate(self.coefficients)][1:], raw)


def _polynomial(coefficients: Sequence[float], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """coefficients[0] + coefficients[1] x + coefficients[2] x^2 + ..., by Horner's rule."""
    value = np.zeros_like(x)
    for c in reversed(coefficients):
        value = value * x + c
    return value
