"""The noise of a signal at rest."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def noise_density(rest: Array, sample_rate: float) -> tuple[Array, Array]:
    """Frequencies [Hz] and one-sided spectral density [unit^2/Hz] of `rest`, shape (n,), without its linear trend."""
    from scipy import signal

    # `Any`: scipy's stubs know no linear trend
    tools: Any = signal
    frequency, power = tools.welch(rest, sample_rate, nperseg=max(rest.size // 4, 8), detrend="linear")
    return np.asarray(frequency), np.asarray(power)
