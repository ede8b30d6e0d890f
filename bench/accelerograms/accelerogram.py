"""One horizontal component of a ground motion, as its source gives it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.excitation import SampledRecord

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Accelerogram:
    """Ground acceleration [m/s2], shape (n,), at a constant step `dt` [s]; nothing was filtered or scaled.

    Nothing was shifted either, except that the offset of K-NET's recorders is taken away; `header` then says so.
    `name` is short, for tables and legends. `source` is the file's path, or says that the motion is synthetic; `format`
    names the spelling of the file, `unit` what its numbers were in, `sha256` is the hash of its bytes (of the samples
    where there is no file). `header` is what the source says of itself, by name.
    """

    name: str
    acceleration: Array
    dt: float
    source: str
    format: str
    unit: str
    sha256: str
    header: Mapping[str, str]
    synthetic: bool = False

    @property
    def duration(self) -> float:
        """From the first to the last sample [s]."""
        return (self.acceleration.size - 1) * self.dt

    @property
    def peak(self) -> float:
        """Largest magnitude [m/s2]."""
        return float(np.abs(self.acceleration).max())

    @property
    def sampled(self) -> SampledRecord:
        """As an excitation of the model."""
        return SampledRecord(self.acceleration, self.dt)
