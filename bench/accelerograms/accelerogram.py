"""One component of a ground motion."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.excitation import SampledRecord

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Accelerogram:
    """Ground acceleration [m/s2], shape (n,), at a constant step `dt` [s].

    The samples of a file are converted to m/s2 and otherwise unchanged, except that the mean of a K-NET or KiK-net
    record is subtracted; `header` then states this offset. `name` is a short name for tables and legends. `source` is
    the path of the file, or a note that the motion is synthetic; `format` is the file format, `unit` the unit in the
    file, `sha256` the hash of the file's bytes (of the rounded samples for a synthetic motion). `header` contains the
    header's values or lines by name.
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
        """Time from the first to the last sample [s]."""
        return (self.acceleration.size - 1) * self.dt

    @property
    def peak(self) -> float:
        """Largest magnitude of the samples [m/s2]."""
        return float(np.abs(self.acceleration).max())

    @property
    def sampled(self) -> SampledRecord:
        """The record as a base excitation of the model."""
        return SampledRecord(self.acceleration, self.dt)
