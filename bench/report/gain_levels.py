"""Where the lines of a gain map lie: contours at round gains, and the frequency at which the gain is least."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FEWEST_LEVELS = 4
"""With fewer of the usual levels in a gain, others are drawn."""


def least_over_omega(omegas: Floats, gain: Floats) -> Floats:
    """Frequency [rad/s] inside the range at which the gain, shape (n, m), is least, shape (n,).

    From a parabola through three points of log(gain); NaN where the least value lies on the edge or its neighbours
    are absent.
    """
    places = np.full(len(gain), np.nan)
    for i, row in enumerate(np.log(gain)):
        if np.isnan(row).all():
            continue
        k = int(np.nanargmin(row))
        if 0 < k < len(omegas) - 1 and np.isfinite(row[k - 1 : k + 2]).all():
            fit = np.asarray(np.polyfit(omegas[k - 1 : k + 2] - omegas[k], row[k - 1 : k + 2], 2), dtype=np.float64)
            places[i] = omegas[k] - 0.5 * float(fit[1] / fit[0]) if fit[0] > 0.0 else omegas[k]
    return places


def levels_for(gain: Floats, usual: Sequence[float]) -> list[float]:
    """The `usual` levels that a gain crosses, ascending; where those are few, round numbers between its extremes."""
    from matplotlib.ticker import MaxNLocator

    finite = gain[np.isfinite(gain)]
    if not finite.size:
        return [1.0]
    low, high = float(finite.min()), float(finite.max())
    levels = [level for level in usual if low <= level <= high]
    if len(levels) < FEWEST_LEVELS:
        rounds = (float(level) for level in MaxNLocator(6, steps=[1, 2, 5, 10]).tick_values(low, high))
        levels = [level for level in rounds if low <= level <= high and level > 0.0]
    return levels or [low]
