"""The specimen as it is known best, and others that it may be as well, all under the motion of one table."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.fall import FALLEN_TILT
from bench.config.model import BenchConfiguration
from sim.specimen import Specimen
from sim.streaming import Stream

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Specimens, the best known first, and by how much the table really moves more than its sensor says: `scales`,
    shape (n,).
    """

    specimens: Sequence[Specimen]
    scales: Array

    def bare(self) -> "Candidates":
        """The same frames without block and spring."""
        return Candidates([specimen.bare() for specimen in self.specimens], self.scales)

    def first(self, n: int) -> "Candidates":
        """The first `n` of them."""
        return Candidates(self.specimens[:n], self.scales[:n])


def candidates(specimen: Specimen, configuration: BenchConfiguration) -> Candidates:
    """`specimen` and those drawn from what is left open of it, and of the accelerometer; the same for every call."""
    twin, random = configuration.twin, np.random.default_rng(configuration.twin.seed)
    others = configuration.known.draws(specimen, twin.members, random)
    scales = 1.0 + configuration.analysis.table_scale * random.standard_normal(twin.members)
    return Candidates([specimen, *others], np.concatenate(([1.0], scales)))


class Ensemble:
    """They start from rest, and move on as the acceleration of the table becomes known, every `dt` [s]."""

    def __init__(self, those: Candidates, dt: float) -> None:
        self._scales = those.scales
        self._streams = [
            Stream(specimen, dt, peaks_from=None, overturning_angle=FALLEN_TILT) for specimen in those.specimens
        ]
        for stream in self._streams:
            # the table was at rest until now
            stream.feed([0.0])

    def __len__(self) -> int:
        return len(self._streams)

    def keep(self, n: int) -> None:
        """Go on with the first `n` alone."""
        del self._streams[n:]

    def feed(self, acceleration: Array) -> Array:
        """u1, u2 [m] and theta [rad] at each of the accelerations [m/s2], shape (n,): shape (3, n_specimens, n).

        NaN from where on a block has fallen. Raises InvalidInput for accelerations that are not finite.
        """
        motions = np.full((3, len(self._streams), acceleration.size), np.nan)
        for k, (stream, scale) in enumerate(zip(self._streams, self._scales, strict=False)):
            states = stream.feed(scale * acceleration)
            motions[:, k, : len(states)] = states[:, [0, 1, 4]].T
        return motions
