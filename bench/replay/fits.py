"""Fitted models and identified properties as rows and columns, for their comparison with the recorded ones."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from bench.findings import FitFinished, Series
from sim.identified import Identified


def parameter_rows(fits: Sequence[FitFinished]) -> list[dict[str, Any]]:
    """The parameters of all fits."""
    return [
        {"fit": fit.name, "name": name, "value": found.value, "uncertainty": found.uncertainty, "unit": found.unit}
        for fit in fits
        for name, found in fit.parameters.items()
    ]


def property_rows(identified: Identified | None) -> list[dict[str, Any]]:
    """The identified properties, without their dates, and the correlations of their errors."""
    if identified is None:
        return []
    return [
        *(
            {"name": each.name, "value": each.value, "uncertainty": each.standard_uncertainty, "unit": each.unit}
            for each in identified.findings
        ),
        *(
            {"name": f"{each.first}, {each.second}", "value": each.coefficient, "unit": "1"}
            for each in identified.correlations
        ),
    ]


def differences_of_columns(stored: Sequence[FitFinished], came: Sequence[FitFinished]) -> Iterator[tuple[str, float]]:
    """Each column of each fit by name, with its largest difference relative to the largest magnitude of the columns of
    the same unit in the fit; infinite for columns of another length, or absent in one of the two.
    """
    for was, now in zip(stored, came, strict=False):
        scales = _scales(was.columns)
        for name in was.columns.keys() | now.columns.keys():
            before, after = was.columns.get(name), now.columns.get(name)
            if before is None or after is None or before.values.shape != after.values.shape:
                yield f"{was.name}: {name}", np.inf
                continue
            equal = (before.values == after.values) | (np.isnan(before.values) & np.isnan(after.values))
            apart = np.abs(before.values - after.values)[~equal]
            apart[np.isnan(apart)] = np.inf
            yield f"{was.name}: {name}", float(apart.max()) / scales[before.unit] if apart.size else 0.0


def _scales(columns: Mapping[str, Series]) -> dict[str, float]:
    scales: dict[str, float] = {}
    for series in columns.values():
        finite = np.abs(series.values[np.isfinite(series.values)])
        largest = float(finite.max()) if finite.size else 0.0
        scales[series.unit] = max(scales.get(series.unit, np.finfo(np.float64).tiny), largest)
    return scales
