# pyright: reportUnknownMemberType=false
"""Predicted drift under earthquake records as in Fig. 8(b) and 9(b) of the paper: bare and coupled frame.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.report.history_figure import MILLI, centre
from bench.report.style import BLUE, GREY, PURPLE, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

Floats = NDArray[np.float64]

WIDTH, ROW, MARGIN = 7.5, 1.25, 0.9
"""Inches: width of the figure, height of a record, and what legend and axis take."""


@dataclass(frozen=True, eq=False)
class ModelDrift:
    """Drift [m] of the bare and the coupled frame under one record at `time` [s], shape (n,); NaN after a fall."""

    name: str
    time: Floats
    bare: Floats
    coupled: Floats


def model_drift_figure(drifts: Sequence[ModelDrift]) -> "Figure":
    """A row per record. Returns a figure that belongs to no window."""
    figure = new_figure(WIDTH, ROW * len(drifts) + MARGIN)
    entries: dict[str, Line2D] = {}
    for k, drift in enumerate(drifts):
        panel = figure.add_subplot(len(drifts), 1, k + 1)
        panel.plot(drift.time, MILLI * drift.bare, color=GREY, linewidth=0.7, label="bare frame")
        panel.plot(drift.time, MILLI * drift.coupled, color=BLUE, linewidth=1.1, label="coupled frame")
        lost = np.flatnonzero(~np.isfinite(drift.coupled))
        if lost.size:
            end = float(drift.time[lost[0]])
            panel.axvline(end, color=PURPLE, linewidth=1.2, linestyle=":", label="block overturned")
        centre(panel, MILLI * drift.bare)
        panel.set_xlim(float(drift.time[0]), float(drift.time[-1]))
        panel.set_title(drift.name, loc="left", fontsize=8, pad=3.0)
        panel.set_ylabel("drift  [mm]", fontsize=8)
        panel.tick_params(labelsize=8)
        set_grid(panel)
        if k == len(drifts) - 1:
            panel.set_xlabel(r"$t$  [s]", fontsize=8)
        for line in panel.lines:
            entries.setdefault(str(line.get_label()), line)
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure
