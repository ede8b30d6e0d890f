"""Curves of the last result of protocols without a gain: a fit with its data, or the response of the table."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.app.display import texts
from bench.app.display.typography import in_screen_unit, label, typeset
from bench.findings import FitFinished, Series, TableIdentified

MOST = 6
"""Largest number of drawn curves."""
DERIVED = ("residual", "uncertainty")
"""Suffixes of the names of series that are not drawn."""
FITTED = "fitted"


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve in displayed units, with arrays of shape (n,); `fitted` is whether it is that of a model."""

    name: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    fitted: bool


@dataclass(frozen=True)
class Figure:
    """Curves over a common axis, which have the same unit."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]


def figure_of(event: FitFinished | TableIdentified) -> Figure:
    """The figure of a result: the series with the unit of the first one."""
    if isinstance(event, FitFinished):
        return _figure(typeset(event.name), event.columns)
    size = Series(np.hypot(event.real, event.imaginary), "m/s2/V", texts.RESPONSE)
    return _figure("", {"frequency": Series(event.frequency, "Hz", ""), texts.RESPONSE: size})


def _figure(title: str, columns: Mapping[str, Series]) -> Figure:
    (axis, along), *others = columns.items()
    x, x_unit = in_screen_unit(along.unit)
    x_label = _with_unit(axis, x_unit)
    if not others:
        return Figure(title, x_label, "", ())
    unit = others[0][1].unit
    y, y_unit = in_screen_unit(unit)
    chosen = [
        Curve(label(name), x * along.values, y * series.values, name.endswith(FITTED))
        for name, series in others
        if series.unit == unit and not name.endswith(DERIVED) and np.isfinite(series.values).any()
    ][:MOST]
    return Figure(title, x_label, _with_unit(chosen[0].name if len(chosen) == 1 else "", y_unit), tuple(chosen))


def _with_unit(name: str, unit: str) -> str:
    return " ".join(part for part in (label(name), f"[{unit}]" if unit not in ("", "1") else "") if part)
