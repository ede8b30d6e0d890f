"""Means over a share of an octave: spectra of a single record are rough, what is asked of them here is smooth."""

from math import exp2
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", np.float64, np.complex128)

_REACH = exp2(1.0 / 6.0)
"""Ratio of the farthest frequency that counts to that in the middle: a sixth of an octave to either side."""


def octave_mean(values: NDArray[Number], frequency: NDArray[np.float64]) -> NDArray[Number]:
    """Mean of `values` within a third of an octave around each `frequency`, positive and ascending, same shape."""
    total: NDArray[Number] = np.concatenate((np.zeros(1, values.dtype), np.cumsum(values)))
    first = np.searchsorted(frequency, frequency / _REACH)
    last = np.searchsorted(frequency, frequency * _REACH, side="right")
    # numpy's stubs lose the type of the elements in a division
    return cast(NDArray[Number], (total[last] - total[first]) / (last - first))
