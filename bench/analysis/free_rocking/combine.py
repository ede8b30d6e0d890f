"""Several tilts made into one value: weighted, with what they scatter and what they have in common."""

from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.analysis.birge import mean_of_repeats

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Combined:
    """A value and its standard uncertainty with its parts: `noise` and `timing` differ between tilts, `linearity` and
    `scale` are the laser's own, `scatter` is what the tilts differ by beyond the first two, Student's t counted.

    `birge` is the ratio of the tilts' scatter to what is expected; NaN for a single tilt.
    """

    value: float
    noise: float
    timing: float
    linearity: float
    scale: float
    scatter: float
    birge: float

    @property
    def uncertainty(self) -> float:
        """Standard uncertainty."""
        return hypot(self.noise, self.timing, self.linearity, self.scale, self.scatter)

    def parts(self) -> dict[str, float]:
        """The parts of the standard uncertainty."""
        names = ("noise", "timing", "linearity", "scale", "scatter")
        return {name: float(getattr(self, name)) for name in names}


def combined(values: ArrayLike, noise: ArrayLike, timing: ArrayLike, linearity: Array, scale: float) -> Combined:
    """Mean of n `values`, weighted by what is independent between them: standard uncertainties `noise` and `timing`.

    `linearity`, shape (n, components), are changes by errors that all values have in common, component by component,
    and `scale` is a standard uncertainty that they have in common. What the values scatter beyond their independent
    uncertainties widens the result and makes the weights more equal (`bench.analysis.birge`).
    """
    found, own, wander = (np.asarray(each, dtype=np.float64) for each in (values, noise, timing))
    repeats = mean_of_repeats(found[:, None], (own**2 + wander**2)[:, None])
    weights = repeats.weights[:, 0]
    return Combined(
        value=float(repeats.values[0]),
        noise=float(np.linalg.norm(weights * own)),
        timing=float(np.linalg.norm(weights * wander)),
        linearity=float(np.linalg.norm(weights @ linearity)),
        scale=scale,
        scatter=float(repeats.scatter[0]),
        birge=float(repeats.birge[0]),
    )
