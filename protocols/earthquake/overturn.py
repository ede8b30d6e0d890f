"""When the block overturned, from the first storey alone."""

import numpy as np
from numpy.typing import NDArray

from bench.analysis.fall import FallWatch
from bench.analysis.signals import U1
from sim.specimen import Specimen


def overturning_time(signals: NDArray[np.float64], sample_rate: float, specimen: Specimen) -> float | None:
    """Seconds since the first of `signals`, shape (n, len(SIGNALS)), that end soon after a fall was noticed.

    A fallen block holds the storey aside. The mean of u1 over a period of the frame's first mode is taken around each
    sample: it last passed the threshold of `FallWatch` when the block passed its critical angle for good. In ten
    simulated falls it was 0.12 s late on average, from 0.14 s early to 0.4 s late; the strap took hold 0.3 to 0.6 s
    afterwards. None where no sample of u1 is known.
    """
    span = min(round(2.0 * np.pi / specimen.frame.natural_frequencies[0] * sample_rate), len(signals))
    u1 = signals[:, U1]
    known = np.isfinite(u1)
    if not known.any():
        return None
    values = np.interp(np.arange(u1.size), np.flatnonzero(known), u1[known])
    mean = np.convolve(values, np.full(span, 1.0 / span), mode="same")
    # at the end the mean runs out of samples: what it has is the fallen block
    mean[-(span // 2) :] = mean[-(span // 2) - 1]
    below = np.flatnonzero(np.abs(mean) <= FallWatch(specimen, sample_rate).threshold)
    return float((below[-1] + 1 if below.size else 0) / sample_rate)
