# pyright: reportUnknownMemberType=false
"""Fitted model: measured and fitted values, and their residuals."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.figures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILLION, new_figure, set_grid
from bench.findings import FitFinished

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, ROW, LEGEND = 6.8, 1.3, 0.5
"""Width of the figure, height of a panel, and height of legend and axis [inch]."""

LINES = ((BLUE, "-", 1.4), (VERMILLION, "--", 1.0), (BLACK, ":", 1.0), (GREEN, "-.", 1.0), (PURPLE, "-", 0.8))
"""Colour, dash and width of each curve of a panel, in order."""

POWERS = str.maketrans({"2": "²", "3": "³"})

PREFIXED = {"m": ((1e-3, "µm", 1e6), (1.0, "mm", 1e3)), "rad": ((1.0, "mrad", 1e3),)}
"""For each unit: upper limits of the values, with the prefixed unit and the factor that apply below each."""

APART = 8.0
"""Maximum ratio of a panel's range of values to that of any of its columns; beyond it, columns are drawn separately."""

UNCERTAINTY, COVERAGE = "_uncertainty", 2.0
"""Suffix of the columns that are drawn as error bars of other columns, and the coverage factor of the bars."""


def fit_figure(fit: FitFinished) -> "Figure":
    """One panel per unit, and one for the residuals of each unit, against the first column.

    Columns of very different scale are drawn in separate panels. The standard uncertainty of a column is drawn as error
    bars (k = 2).
    """
    axis, *names = fit.columns
    along = fit.columns[axis]
    bars = {name for name in names if name.removesuffix(UNCERTAINTY) in fit.columns and name.endswith(UNCERTAINTY)}
    panels = _panels(fit, [name for name in names if name not in bars])
    figure = new_figure(WIDTH, ROW * max(len(panels), 1) + LEGEND)
    drawn = figure.subplots(max(len(panels), 1), 1, squeeze=False, sharex=True)[:, 0]
    for panel, together in zip(drawn, panels, strict=False):
        unit, factor = _scaled(fit, together)
        for name, (colour, dash, width) in zip(together, LINES * len(together), strict=False):
            label = name.replace("_", " ")
            shade = ORANGE if "residual" in name else colour
            values = factor * fit.columns[name].values
            if (uncertainty := fit.columns.get(f"{name}{UNCERTAINTY}")) is None:
                panel.plot(along.values, values, dash, color=shade, linewidth=width, label=label)
            else:
                expanded = COVERAGE * factor * uncertainty.values
                label = f"{label} (k = 2)"
                panel.errorbar(along.values, values, expanded, fmt="o", ms=3, lw=0.8, color=shade, label=label)
        panel.set_ylabel(_axis(", ".join(together), unit), fontsize=8)
        panel.tick_params(labelsize=8)
        set_grid(panel)
        panel.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=7.5, frameon=False)
    drawn[-1].set_xlabel(_axis(axis, along.unit), fontsize=8)
    figure.align_ylabels(drawn.tolist())
    return figure


def _panels(fit: FitFinished, names: list[str]) -> list[list[str]]:
    """Names of the columns of each panel."""
    panels: dict[str, list[list[str]]] = {}
    for name in names:
        kind = f"{fit.columns[name].unit} residual" if "residual" in name else fit.columns[name].unit
        alike = panels.setdefault(kind, [])
        fitting = next((each for each in alike if _of_one_scale(fit, [*each, name])), None)
        if fitting is None:
            alike.append([name])
        else:
            fitting.append(name)
    return [each for alike in panels.values() for each in alike]


def _of_one_scale(fit: FitFinished, names: list[str]) -> bool:
    ends = np.array([_ends(fit.columns[name].values) for name in names])
    return float(ends[:, 1].max() - ends[:, 0].min()) <= APART * float(np.min(ends[:, 1] - ends[:, 0]))


def _ends(values: NDArray[np.float64]) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)


def _scaled(fit: FitFinished, names: list[str]) -> tuple[str, float]:
    """Unit with prefix, and the factor that converts values to it for drawing."""
    unit = fit.columns[names[0]].unit
    size = max(abs(end) for name in names for end in _ends(fit.columns[name].values))
    return next(((there, factor) for below, there, factor in PREFIXED.get(unit, ()) if size < below), (unit, 1.0))


def _axis(name: str, unit: str) -> str:
    words = name.replace("_", " ")
    short = words if len(words) < 25 else "values"
    return short if unit == "1" else f"{short}  [{unit.translate(POWERS).replace('Hz^0.5', '√Hz')}]"
