"""Models fitted to stretches of the recording: rows while the file grows, and NXdata groups once it is closed.

No group can be added to a file that may be read meanwhile, so the values of all fits follow one another in one
dataset. The groups are views of it (HDF5 virtual datasets) that hold no values of their own: silx, NexPy, h5web and
their like draw them.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from bench.events import FitFinished, FittedParameter, Series
from bench.record import hdf5
from bench.record.fields import Field, Kind, decode
from bench.record.rows import Rows

VIEWS = "fitted"
FITS = (
    Field("time", Kind.REAL, "s", "bench time"),
    Field("name", Kind.TEXT, "", "name of the fit"),
    Field("text", Kind.TEXT, "", "findings in one line"),
    Field("rows", Kind.WHOLE, "1", "values of each column"),
    Field("columns", Kind.WHOLE, "1", "how many columns it has: so many rows of fit_columns"),
    Field("parameters", Kind.WHOLE, "1", "how many parameters it has: so many rows of fit_parameters"),
)
FIT_COLUMNS = (
    Field("name", Kind.TEXT, "", "name of the column; the first of a fit is its axis"),
    Field("unit", Kind.TEXT, "", "its unit"),
    Field("description", Kind.TEXT, "", "what it is"),
)
FIT_PARAMETERS = (
    Field("name", Kind.TEXT, "", "name of the parameter"),
    Field("value", Kind.REAL, "of the row", "value that was found, in the unit of the row"),
    Field("uncertainty", Kind.REAL, "of the row", "its standard uncertainty; NaN if unknown"),
    Field("unit", Kind.TEXT, "", "unit of both"),
)
FIT_VALUES = (Field("value", Kind.REAL, "of the column", "columns one after the other, fit by fit"),)
TABLES = {"fits": FITS, "fit_columns": FIT_COLUMNS, "fit_parameters": FIT_PARAMETERS, "fit_values": FIT_VALUES}


def add(rows: Mapping[str, Rows], fit: FitFinished) -> None:
    """Append a fit to its tables."""
    length = len(next(iter(fit.columns.values())).values)
    rows["fits"].add(fit.time, fit.name, fit.text, length, len(fit.columns), len(fit.parameters))
    for name, series in fit.columns.items():
        rows["fit_columns"].add(name, series.unit, series.description)
        rows["fit_values"].extend(series.values)
    for name, found in fit.parameters.items():
        rows["fit_parameters"].add(name, found.value, found.uncertainty, found.unit)


def read(entry: hdf5.Group, whole: int) -> list[FitFinished]:
    """The first `whole` fits, as they were said."""
    columns, parameters = _table(entry, "fit_columns"), _table(entry, "fit_parameters")
    values = hdf5.dataset(entry, "fit_values/value")
    found: list[FitFinished] = []
    column = parameter = at = 0
    for fit in _table(entry, "fits")[:whole]:
        own = columns[column : column + fit["columns"]]
        series: dict[str, Series] = {}
        for one in own:
            series[one["name"]] = Series(values[at : at + fit["rows"]], one["unit"], one["description"])
            at += fit["rows"]
        known = {
            one["name"]: FittedParameter(one["value"], one["uncertainty"], one["unit"])
            for one in parameters[parameter : parameter + fit["parameters"]]
        }
        column, parameter = column + len(own), parameter + len(known)
        found.append(FitFinished(fit["name"], fit["text"], series, known, time=fit["time"]))
    return found


def add_views(entry: hdf5.Group, whole: int) -> None:
    """Make an NXdata group of each of the first `whole` fits, in a file that nobody reads."""
    if not whole:
        return
    views = hdf5.create_group(entry, VIEWS, "NXcollection")
    source, at = hdf5.dataset(entry, "fit_values/value"), 0
    for number, fit in enumerate(read(entry, whole), start=1):
        name = fit.name if fit.name not in views else f"{fit.name} ({number})"
        view = hdf5.create_group(views, name, "NXdata")
        axis, *others = fit.columns
        view.attrs["signal"], view.attrs["axes"] = (others or [axis])[0], [axis]
        view.attrs[f"{axis}_indices"], view.attrs["title"] = 0, fit.text
        # what has another unit has another scale, and would flatten the picture
        if alike := [each for each in others[1:] if fit.columns[each].unit == fit.columns[others[0]].unit]:
            view.attrs["auxiliary_signals"] = alike
        for each, series in fit.columns.items():
            made = hdf5.view(view, each, source, slice(at, at + len(series.values)))
            made.attrs["units"], made.attrs["description"] = series.unit, series.description
            made.attrs["long_name"] = f"{each} [{series.unit}]"
            at += len(series.values)
        for each, found in fit.parameters.items():
            view.attrs[f"parameter_{each}"] = np.array([found.value, found.uncertainty])
            view.attrs[f"parameter_{each}_units"] = found.unit


def whole(entry: hdf5.Group) -> int:
    """How many fits have all their rows, in a file whose tables were cut to what could be read."""
    if "fits" not in entry:
        return 0
    fits = _table(entry, "fits")
    needed = np.cumsum(
        [(fit["columns"], fit["parameters"], fit["columns"] * fit["rows"]) for fit in fits] or [(0, 0, 0)], axis=0
    )
    there = [len(_table(entry, "fit_columns")), len(_table(entry, "fit_parameters"))]
    there.append(hdf5.dataset(entry, "fit_values/value").shape[0])
    return min(len(fits), int(np.count_nonzero((needed <= there).all(axis=1))))


def _table(entry: hdf5.Group, name: str) -> list[dict[str, Any]]:
    group = hdf5.group(entry, name)
    columns = {column: decode(hdf5.dataset(group, column)) for column in group}
    return [dict(zip(columns, row, strict=False)) for row in zip(*columns.values(), strict=False)]
