"""Events that publish the results of identification: the response of the table, fitted models and the specimen."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.events import Event, event
from sim.identified import Identified
from sim.parameters import column

Array = NDArray[np.float64]


@event(table="table_response", notice="table", eq=False)
class TableIdentified(Event):
    """The response of the table has been identified. The arrays, each of shape (n_lines,), contain the values at the
    frequency lines, in the units of `bench.control.table_model.TableModel`; `text` states the mounted
    specimen, the band, the number of lines and the rms acceleration.
    """

    text: str
    frequency: Array = column("Hz", "frequency line of the identification")
    real: Array = column("m/s2/V", "table acceleration per drive, real part, exp(+i omega t)")
    imaginary: Array = column("m/s2/V", "table acceleration per drive, imaginary part")
    uncertainty: Array = column("m/s2/V", "standard uncertainty of the response due to noise and distortion")
    distortion: Array = column("m/s2/V", "standard deviation of one realisation due to nonlinear distortion alone")
    coherence: Array = column("1", "fraction of the acceleration's power that is coherent with the drive")
    noise: Array = column("m/s2/Hz^0.5", "amplitude spectral density of the noise in the acceleration")

    @property
    def line(self) -> str:
        return self.text


@dataclass(frozen=True, eq=False)
class Series:
    """Values along the axis of a fit, shape (n,), with their unit in SI symbols ("1" for a pure number) and a
    description.
    """

    values: Array
    unit: str
    description: str


@dataclass(frozen=True)
class FittedParameter:
    """Fitted value of a model parameter; the standard uncertainty has the same unit and is NaN if unknown."""

    value: float
    uncertainty: float
    unit: str


@event(notice="fit", eq=False)
class FitFinished(Event):
    """A model was fitted to a section of a recording; `name` should be short and unique within a session, `text` is one
    line.

    `columns` holds series of equal length by name: first the axis (such as time), then the measured values and, for
    comparison, the fitted values, residuals and so on. Raises ValueError for series of unequal length, and for a name
    that is not valid in a data file. Stored by `bench.datafile.findings_tables`.
    """

    name: str
    text: str
    columns: Mapping[str, Series]
    parameters: Mapping[str, FittedParameter]

    def __post_init__(self) -> None:
        shapes = {series.values.shape for series in self.columns.values()}
        if len(shapes) != 1 or len(*shapes) != 1:
            raise ValueError(
                f"columns of the fit {self.name} have shapes {shapes}; they must all have the same shape (n,)"
            )
        for name in (self.name, *self.columns):
            if not name.strip(".") or "/" in name:
                raise ValueError(f"{name!r} in the fit {self.name} is not a valid name in a data file")

    @property
    def line(self) -> str:
        return f"{self.name}: {self.text}"


@event()
class SpecimenIdentified(Event):
    """The specimen as identified so far: findings of this and earlier runs; stored by
    `bench.datafile.findings_tables`.
    """

    identified: Identified

    @property
    def line(self) -> str:
        return "; ".join(
            f"{each.name} = {each.value:.7g} +- {each.standard_uncertainty:.2g} (k = 1)"
            for each in self.identified.findings
        )
