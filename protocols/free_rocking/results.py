# pyright: reportUnknownMemberType=false
"""The results as text for the terminal and as a figure: motion with fit, residual, restitution by impact, budget.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from math import degrees, log10
from typing import TYPE_CHECKING

import numpy as np

from bench.analysis.free_rocking.findings import Findings
from bench.analysis.free_rocking.fit import ZERO
from bench.analysis.free_rocking.tilt import Tilt
from bench.analysis.gain import COVERAGE
from bench.report.rocking_figure import Impacts, draw_impacts
from bench.report.style import BLACK, BLUE, VERMILLION, new_figure, set_grid
from bench.report.text_table import TextColumn, text_table
from protocols.free_rocking.protocol import ALL, RockingPoint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = (
    TextColumn("", words=True),
    TextColumn("tilt", "deg"),
    TextColumn("impacts", "1"),
    TextColumn("r", "1"),
    TextColumn("U (k=2)", "1"),
    TextColumn("r / r_th", "1"),
    TextColumn("U (k=2)", "1"),
    TextColumn("r, amplitudes", "1"),
    TextColumn("U (k=2)", "1"),
    TextColumn("residual", "um"),
)


def rocking_table(points: Sequence[RockingPoint]) -> str:
    """One row for each tilt and one for all, and below them the block's parameters from its motion."""
    if not points:
        return "No tilt could be used."
    table = text_table(_COLUMNS, map(_cells, points))
    combined = next((point for point in points if point.part == ALL), None)
    return "\n".join([table] if combined is None else [table, "", *_combined(combined)])


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
    ratio, expanded = combined.ratio, combined.ratio_uncertainty
    motion.set_title(f"r_exp / r_th = {ratio:.6f} +- {expanded:.1g} (k = 2), {combined.impacts} impacts", loc="left")
    return figure


def _cells(point: RockingPoint) -> tuple[str, ...]:
    return (
        point.part,
        "" if point.tilt_rad is None else f"{degrees(point.tilt_rad):+.2f}",
        str(point.impacts),
        *_pair(point.r_exp, point.r_exp_uncertainty),
        *_pair(point.ratio, point.ratio_uncertainty),
        *_pair(point.r_amplitudes, point.r_amplitudes_uncertainty),
        f"{1e6 * point.residual_m:.1f}",
    )


def _combined(point: RockingPoint) -> list[str]:
    trend, alpha = _pair(point.trend, point.trend_uncertainty), _pair(point.alpha_rad, point.alpha_uncertainty_rad)
    p = _pair(point.p_rad_s, point.p_uncertainty_rad_s)
    birge = "" if point.birge is None else f"; the tilts scatter {point.birge:.2f} times what is expected"
    by = f", by the {point.estimator}" if point.estimator else ""
    return [
        f"r_exp / r_th = {point.ratio:.6f} +- {point.ratio_uncertainty:.1g} (k = 2){by}, r_th = {point.r_th:.6f}"
        f"{birge}",
        f"change of r over the impacts' speeds: {trend[0]} +- {trend[1]}",
        f"alpha = {alpha[0]} +- {alpha[1]} rad, by the sides {point.alpha_sides_rad:.6f} rad",
        f"p = {p[0]} +- {p[1]} rad/s, by the sides {point.p_sides_rad_s:.5f} rad/s",
        *([f"see to: {point.remarks}"] if point.remarks else []),
    ]


def _pair(value: float, uncertainty: float) -> tuple[str, str]:
    """A value and its uncertainty, both to two digits of the uncertainty."""
    places = min(max(1 - int(log10(uncertainty) // 1), 0), 8) if uncertainty > 0.0 else 8
    return f"{value:.{places}f}", f"{uncertainty:.{places}f}"


def _motion(motion: "Axes", left: "Axes", tilt: Tilt) -> None:
    seen, fit, zero = tilt.seen, tilt.fit, tilt.fit.values[ZERO]
    end = float(fit.times[-1]) + 1.0
    shown = slice(None, int(end * seen.sample_rate), max(round(seen.sample_rate / 500.0), 1))
    motion.plot(seen.times[shown], 1e3 * (seen.displacement[shown] - zero), color=BLACK, lw=0.9, label="measured")
    # the fit has no samples between its pieces: NaN breaks the line there
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
