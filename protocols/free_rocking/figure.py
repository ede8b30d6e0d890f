# pyright: reportUnknownMemberType=false
"""The rocking with its fit, what is left, r of every impact, and what the uncertainty is made of.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bench.analysis.free_rocking.findings import Findings
from bench.analysis.free_rocking.fit import ZERO
from bench.analysis.free_rocking.tilt import Tilt
from bench.analysis.gain import COVERAGE
from bench.report.rocking_figure import Impacts, draw_impacts
from bench.report.style import BLACK, BLUE, VERMILLION, new_figure, set_grid
from protocols.free_rocking.protocol import ALL, RockingPoint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def rocking_figure(points: Sequence[RockingPoint], tilts: Sequence[Tilt], found: Findings | None) -> "Figure":
    """Four panels; empty ones where nothing was found. The motion is that of the largest tilt."""
    figure = new_figure(8.0, 11.0)
    motion, left, single, parts = figure.subplots(4, 1, height_ratios=(3, 1.5, 3, 1.6))
    for panel in (motion, left, single, parts):
        set_grid(panel)
    combined = next((point for point in points if point.part == ALL), None)
    if not tilts or found is None or combined is None:
        motion.set_title("no tilt could be used", loc="left")
        return figure
    _motion(motion, left, max(tilts, key=lambda tilt: abs(tilt.swings.held)))
    draw_impacts(single, [_impacts(tilt) for tilt in tilts], combined.r_exp, combined.r_th)
    _parts(parts, found)
    ratio, doubt = combined.ratio, combined.ratio_uncertainty
    motion.set_title(f"r_exp / r_th = {ratio:.6f} +- {doubt:.1g} (k = 2), {combined.impacts} impacts", loc="left")
    return figure


def _motion(motion: "Axes", left: "Axes", tilt: Tilt) -> None:
    seen, fit, zero = tilt.seen, tilt.fit, tilt.fit.values[ZERO]
    end = float(fit.times[-1]) + 1.0
    shown = slice(None, int(end * seen.sample_rate), max(round(seen.sample_rate / 500.0), 1))
    motion.plot(seen.times[shown], 1e3 * (seen.displacement[shown] - zero), color=BLACK, lw=0.9, label="measured")
    # pieces between impacts: what lies between them was left out
    broken = np.insert(1e3 * (fit.fitted - zero), np.flatnonzero(np.diff(fit.swing)) + 1, np.nan)
    times = np.insert(fit.times, np.flatnonzero(np.diff(fit.swing)) + 1, np.nan)
    motion.plot(times, broken, "--", color=VERMILLION, lw=1.2, label="exact motion, fitted")
    motion.set_ylabel("face of the block [mm]")
    motion.legend(loc="upper right", fontsize=8)
    motion.set_xlim(0.0, end)
    left.plot(fit.times, 1e6 * fit.residual, ".", ms=1.5, color=BLUE)
    left.set_ylabel("residual [um]")
    left.set_xlabel("time [s]")
    left.set_xlim(0.0, end)


def _impacts(tilt: Tilt) -> Impacts:
    relation = tilt.relation
    return Impacts(tilt.swings.held, relation.speed, relation.each, COVERAGE * relation.each_uncertainty)


def _parts(panel: "Axes", found: Findings) -> None:
    parts = found.restitution.parts() | {"all": found.restitution.uncertainty}
    names = list(parts)
    panel.barh(names, [1e6 * value for value in parts.values()], color=[BLUE] * (len(names) - 1) + [BLACK])
    panel.invert_yaxis()
    panel.set_xlabel("standard uncertainty of r [1e-6]")
