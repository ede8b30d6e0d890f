"""Tables of fitted models and of the identified specimen, whose rows refer to one another.

No group can be added to a file that is being read, so one dataset holds the concatenated values of all fits. The NXdata
groups of a closed file are views of it (HDF5 virtual datasets) for viewers such as silx, NexPy and h5web.
"""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

import numpy as np

from bench.datafile import hdf5
from bench.datafile.fields import Field, Kind, decode
from bench.datafile.rows import Rows
from bench.findings import FitFinished, FittedParameter, Series
from sim.identified import Correlation, Finding, Identified

FIT_VIEWS = "fitted"
FITS = (
    Field("time", Kind.REAL, "s", "bench time"),
    Field("name", Kind.TEXT, "", "name of the fit"),
    Field("text", Kind.TEXT, "", "summary of the fit in one line"),
    Field("rows", Kind.WHOLE, "1", "number of values in each column"),
    Field("columns", Kind.WHOLE, "1", "number of columns, each a row of fit_columns"),
    Field("parameters", Kind.WHOLE, "1", "number of parameters, each a row of fit_parameters"),
)
FIT_COLUMNS = (
    Field("name", Kind.TEXT, "", "name of the column; the first of a fit is its axis"),
    Field("unit", Kind.TEXT, "", "unit of the column"),
    Field("description", Kind.TEXT, "", "description"),
)
FIT_PARAMETERS = (
    Field("name", Kind.TEXT, "", "name of the parameter"),
    Field("value", Kind.REAL, "of the row", "identified value, in the unit of the row"),
    Field("uncertainty", Kind.REAL, "of the row", "standard uncertainty of the value; NaN if unknown"),
    Field("unit", Kind.TEXT, "", "unit of value and standard uncertainty"),
)
FIT_VALUES = (Field("value", Kind.REAL, "of the column", "values of all columns of all fits, concatenated fit by fit"),)
FIT_TABLES = {"fits": FITS, "fit_columns": FIT_COLUMNS, "fit_parameters": FIT_PARAMETERS, "fit_values": FIT_VALUES}


def add_fit(rows: Mapping[str, Rows], fit: FitFinished) -> None:
    """Append a fit to its tables."""
    length = len(next(iter(fit.columns.values())).values)
    rows["fits"].add(fit.time, fit.name, fit.text, length, len(fit.columns), len(fit.parameters))
    for name, series in fit.columns.items():
        rows["fit_columns"].add(name, series.unit, series.description)
        rows["fit_values"].extend(series.values)
    for name, found in fit.parameters.items():
        rows["fit_parameters"].add(name, found.value, found.uncertainty, found.unit)


def read_fits(entry: hdf5.Group, whole: int) -> list[FitFinished]:
    """The first `whole` fits in the file, as published."""
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


def add_fit_views(entry: hdf5.Group, whole: int) -> None:
    """Create an NXdata group for each of the first `whole` fits; no program may be reading the file."""
    if not whole:
        return
    views = hdf5.create_group(entry, FIT_VIEWS, "NXcollection")
    source, at = hdf5.dataset(entry, "fit_values/value"), 0
    for number, fit in enumerate(read_fits(entry, whole), start=1):
        name = fit.name if fit.name not in views else f"{fit.name} ({number})"
        view = hdf5.create_group(views, name, "NXdata")
        axis, *others = fit.columns
        view.attrs["signal"], view.attrs["axes"] = (others or [axis])[0], [axis]
        view.attrs[f"{axis}_indices"], view.attrs["title"] = 0, fit.text
        # columns with a different unit have a different scale and would flatten the plot
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


def whole_fits(entry: hdf5.Group) -> int:
    """Number of complete fits in a file whose tables may be truncated."""
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


FINDINGS = (
    Field(
        "number",
        Kind.WHOLE,
        "1",
        "number of the set, equal to the number of rows of all earlier sets; the last set is valid",
    ),
    Field("time", Kind.REAL, "s", "bench time"),
    Field("name", Kind.TEXT, "", "name of the quantity, as in a specimen file"),
    Field("value", Kind.REAL, "of the row", "best estimate"),
    Field("standard_uncertainty", Kind.REAL, "of the row", "standard uncertainty (k = 1)"),
    Field("unit", Kind.TEXT, "", "SI unit of value and standard uncertainty"),
    Field("source", Kind.TEXT, "", "source of the value"),
    Field("date", Kind.TEXT, "", "date of the measurement, ISO 8601 with time zone"),
)
CORRELATIONS = (
    Field("number", Kind.WHOLE, "1", "number of the set of findings, as in the rows of the two findings"),
    Field("first", Kind.TEXT, "", "name of a finding"),
    Field("second", Kind.TEXT, "", "name of another finding"),
    Field("coefficient", Kind.REAL, "1", "correlation coefficient of their errors; 0 for pairs without a row"),
)
FINDING_TABLES = {"identified": FINDINGS, "identified_correlations": CORRELATIONS}


def add_findings(rows: Mapping[str, Rows], time: float, identified: Identified) -> None:
    """Append the findings and correlations of an event to their tables."""
    number = len(rows["identified"])
    for one in identified.correlations:
        rows["identified_correlations"].add(number, one.first, one.second, one.coefficient)
    for each in identified.findings:
        uncertain = (each.value, each.standard_uncertainty, each.unit)
        rows["identified"].add(number, time, each.name, *uncertain, each.source, each.date.isoformat())


def last_findings(
    findings: Sequence[Mapping[str, Any]], correlations: Sequence[Mapping[str, Any]]
) -> Identified | None:
    """The last findings, from the rows of both tables; None if there are none."""
    if not findings:
        return None
    number = findings[-1]["number"]
    names = ("name", "value", "standard_uncertainty", "source")
    return Identified(
        findings=tuple(
            Finding(**{name: row[name] for name in names}, date=datetime.fromisoformat(row["date"]))
            for row in findings
            if row["number"] == number
        ),
        correlations=tuple(
            Correlation(first=row["first"], second=row["second"], coefficient=row["coefficient"])
            for row in correlations
            if row["number"] == number
        ),
    )
