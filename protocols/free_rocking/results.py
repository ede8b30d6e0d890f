# pyright: reportUnknownMemberType=false
"""Results of free rocking: text table, figures, and report section."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees, log10
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_rocking.findings import Findings, Tilt
from bench.analysis.free_rocking.fit import ZERO
from bench.analysis.gain import COVERAGE
from bench.document.campaign import Campaign
from bench.document.document import Column, Listing, Notice, Part, Picture, Section, Table
from bench.document.typography import plain, typeset, with_uncertainty
from bench.figures.style import BLACK, BLUE, GREY, MARKERS, SERIES, VERMILLION, new_figure, set_grid
from bench.figures.text_table import TextColumn, text_table
from protocols.common.budgets import Budgeted, budget_parts, budgeted
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

_FIT = "impacts of "
"""Prefix of the name of a fit that contains the individual impacts after a tilt."""

_MOTION = (("r_motion", "r_exp"), ("r_motion_uncertainty", "r_exp_uncertainty"))
"""Fields of the restitution from the fit of the motion, each with the field that contains it in older files."""


@dataclass(frozen=True, eq=False)
class Impacts:
    """Impacts after the release from one `tilt` [rad], arrays of shape (n,): `speed`, the angular velocity at impact
    relative to that of a fall from the critical angle; `restitution` r; `uncertainty`, the expanded uncertainty of r
    due to noise.
    """

    tilt: float
    speed: NDArray[np.float64]
    restitution: NDArray[np.float64]
    uncertainty: NDArray[np.float64]


def rocking_table(points: Sequence[RockingPoint]) -> str:
    """Text table with a row for each tilt and one for all tilts, followed by the block's parameters as identified from
    its motion.
    """
    if not points:
        return "No tilt was usable."
    table = text_table(_COLUMNS, map(_cells, points))
    combined = next((point for point in points if point.part == ALL), None)
    return "\n".join([table] if combined is None else [table, "", *_combined(combined)])


def rocking_figure(points: Sequence[RockingPoint], tilts: Sequence[Tilt], found: Findings | None) -> "Figure":
    """Figure of motion and residual of the largest tilt, all impacts, and uncertainties; empty without a result."""
    figure = new_figure(8.0, 11.0)
    motion, left, single, parts = figure.subplots(4, 1, height_ratios=(3, 1.5, 3, 1.6))
    for panel in (motion, left, single, parts):
        set_grid(panel)
    combined = next((point for point in points if point.part == ALL), None)
    if not tilts or found is None or combined is None:
        motion.set_title("no tilt was usable", loc="left")
        return figure
    _motion(motion, left, max(tilts, key=lambda tilt: abs(tilt.swings.held)))
    _draw_impacts(single, [_impacts(tilt) for tilt in tilts], combined.r_exp, combined.r_th)
    _parts(parts, found)
    ratio, expanded = combined.ratio, combined.ratio_uncertainty
    motion.set_title(
        rf"$r_\mathrm{{exp}}/r_\mathrm{{th}}$ = {ratio:.6f} ± {expanded:.1g} (k = 2), {combined.impacts} impacts",
        loc="left",
    )
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
    birge = "" if point.birge is None else f"; scatter of the tilts: {point.birge:.2f} times the expected scatter"
    by = f", from the {point.estimator}" if point.estimator else ""
    return [
        f"r_exp / r_th = {point.ratio:.6f} +- {point.ratio_uncertainty:.1g} (k = 2){by}, r_th = {point.r_th:.6f}"
        f"{birge}",
        f"change of r over the whole range of impact velocities: {trend[0]} +- {trend[1]}",
        f"alpha = {alpha[0]} +- {alpha[1]} rad from the motion; {point.alpha_sides_rad:.6f} rad from the dimensions",
        f"p = {p[0]} +- {p[1]} rad/s from the motion; {point.p_sides_rad_s:.5f} rad/s from the dimensions",
        *([f"check: {point.remarks}"] if point.remarks else []),
    ]


def _pair(value: float, uncertainty: float) -> tuple[str, str]:
    """A value and its uncertainty, both rounded to two significant digits of the uncertainty."""
    places = min(max(1 - int(log10(uncertainty) // 1), 0), 8) if uncertainty > 0.0 else 8
    return f"{value:.{places}f}", f"{uncertainty:.{places}f}"


def _motion(motion: "Axes", left: "Axes", tilt: Tilt) -> None:
    seen, fit, zero = tilt.recording, tilt.fit, tilt.fit.values[ZERO]
    end = float(fit.times[-1]) + 1.0
    shown = slice(None, int(end * seen.sample_rate), max(round(seen.sample_rate / 500.0), 1))
    motion.plot(seen.times[shown], 1e3 * (seen.displacement[shown] - zero), color=BLACK, lw=0.9, label="measured")
    # NaN interrupts the plotted line between the swings of the fit
    broken = np.insert(1e3 * (fit.fitted - zero), np.flatnonzero(np.diff(fit.swing)) + 1, np.nan)
    times = np.insert(fit.times, np.flatnonzero(np.diff(fit.swing)) + 1, np.nan)
    motion.plot(times, broken, "--", color=VERMILLION, lw=1.2, label="exact motion, fitted")
    motion.set_ylabel("face of the block [mm]")
    motion.legend(loc="upper right", fontsize=8)
    motion.set_xlim(0.0, end)
    left.plot(fit.times, 1e6 * fit.residual, ".", ms=1.5, color=BLUE)
    left.set_ylabel("residual [µm]")
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


def _impacts_figure(tilts: Sequence[Impacts], mean: float, theory: float) -> "Figure":
    figure = new_figure(7.0, 3.4)
    panel = figure.subplots()
    set_grid(panel)
    _draw_impacts(panel, tilts, mean, theory)
    return figure


def _draw_impacts(panel: "Axes", tilts: Sequence[Impacts], mean: float, theory: float) -> None:
    """Draw the restitution of each impact, the identified `mean`, and the value of the `theory`."""
    for number, tilt in enumerate(tilts):
        panel.errorbar(
            tilt.speed,
            tilt.restitution,
            tilt.uncertainty,
            fmt=MARKERS[number % len(MARKERS)],
            ms=3.5,
            lw=0.7,
            color=SERIES[number % len(SERIES)],
            label=f"{1e3 * tilt.tilt:+.0f} mrad",
        )
    panel.axhline(mean, color=BLACK, lw=1.2, label="all tilts")
    panel.axhline(theory, color=GREY, ls="--", lw=1.2, label="theory")
    panel.set_ylabel("r of single impacts,\nby amplitudes (k = 2, noise)")
    panel.set_xlabel("angular velocity at the impact relative to a fall from the critical angle")
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)


def rocking_sections(campaign: Campaign) -> list[Section]:
    """Report section on the result, the tilts and the single impacts, as far as the file contains them."""
    if not campaign.points:
        return []
    tilts = [row for row in campaign.points if row["part"] != ALL]
    combined = next((row for row in campaign.points if row["part"] == ALL), None)
    parts: list[Part] = []
    if combined is None:
        parts.append(Notice("The run ended before its tilts could be combined."))
    else:
        parts += [_result_text(combined), _shape_table(combined)]
    parts.append(_tilts_table([*tilts, combined] if combined else tilts))
    budgets = list[Budgeted]()
    for row in [*tilts, combined] if combined else tilts:
        budgets += budgeted(str(row["part"]), row["r_exp"], row.get("uncertainty_parts"), row["r_exp_uncertainty"])
    parts += budget_parts("r", budgets)
    remarks = [f"{row['part']}: {row['remarks']}" for row in campaign.points if row["remarks"]]
    if remarks:
        parts += ["Remarks:", Listing(remarks)]
    if combined and (impacts := _recorded_impacts(campaign, tilts)):
        caption = "Restitution of every impact from the largest angles before and after it, with the combined value"
        figure = _impacts_figure(impacts, combined["r_exp"], combined["r_th"])
        parts.append(Picture(figure, f"{caption} and the theoretical one.", "Restitution against impact velocity."))
    return [Section("free-rocking", "Free rocking of the block", parts)]


def _result_text(row: Mapping[str, Any]) -> str:
    ratio = with_uncertainty(row["ratio"], row["ratio_uncertainty"])
    theory = with_uncertainty(row["r_th"], row["r_th_uncertainty"])
    by = (
        "The restitution is taken from the amplitudes, because the impacts differ so much that the fit of the exact "
        "nonlinear motion from the release onward is less accurate."
        if row.get("estimator") == "amplitudes"
        else "The restitution is taken from the fit of the exact nonlinear motion from the release onward; the "
        "amplitudes are used as a check."
    )
    return (
        f"rₑₓₚ / rₜₕ = {ratio}, from {row['impacts']} impacts of the stand-alone block on a table clamped to the"
        f" ground, with rₜₕ = {theory} from the block's dimensions. Uncertainties are expanded (k = 2). {by}"
    )


def _shape_table(row: Mapping[str, Any]) -> Table:
    names = (("alpha", "rad", "critical angle"), ("p", "rad_s", "frequency parameter, √(M g R / J)"))
    rows = [
        [
            typeset(name),
            meaning,
            with_uncertainty(row[f"{name}_{unit}"], row[f"{name}_uncertainty_{unit}"]),
            with_uncertainty(row[f"{name}_sides_{unit}"], row[f"{name}_sides_uncertainty_{unit}"]),
            "rad" if unit == "rad" else "rad/s",
        ]
        for name, unit, meaning in names
    ]
    rows.append(
        [
            "r",
            "change of r over the range of impact velocities",
            with_uncertainty(row["trend"], row["trend_uncertainty"]),
            "0",
            "1",
        ]
    )
    columns = [
        Column("symbol", words=True),
        Column("meaning", words=True),
        Column("from the motion"),
        Column("expected"),
        Column("unit", words=True),
    ]
    return Table("Shape of the block, and dependence of r on the impact velocity (k = 2)", columns, rows)


def _tilts_table(rows: list[dict[str, Any]]) -> Table:
    cells = [
        [
            str(row["part"]),
            plain(None if row["tilt_rad"] is None else degrees(row["tilt_rad"])),
            str(row["impacts"]),
            with_uncertainty(*(row.get(name, row[other]) for name, other in _MOTION)),
            with_uncertainty(row["r_amplitudes"], row["r_amplitudes_uncertainty"]),
            plain(1e6 * row["residual_m"], 3),
        ]
        for row in rows
    ]
    columns = [
        Column("part", words=True),
        Column("tilt", "°"),
        Column("impacts"),
        Column("r, motion"),
        Column("r, amplitudes"),
        Column("residual", "µm"),
    ]
    return Table("Tilts, positive towards the frame (measured, k = 2)", columns, cells)


def _recorded_impacts(campaign: Campaign, tilts: list[dict[str, Any]]) -> list[Impacts]:
    fits = {fit.name.removeprefix(_FIT): fit for fit in campaign.record.fits if fit.name.startswith(_FIT)}
    found: list[Impacts] = []
    for row in tilts:
        if (fit := fits.get(str(row["part"]))) is not None:
            speed, each, doubt = (
                fit.columns[name].values for name in ("speed", "restitution", "restitution_uncertainty")
            )
            found.append(Impacts(float(row["tilt_rad"]), speed, each, COVERAGE * doubt))
    return found
