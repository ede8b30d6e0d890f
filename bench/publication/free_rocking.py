"""Free rocking: the restitution of the block's impacts, and what its motion says of its shape."""

import json
from collections.abc import Mapping
from math import degrees
from typing import Any

from bench.publication.campaign import Campaign
from bench.publication.numbers import plain, with_uncertainty
from bench.publication.typography import typeset
from bench.report.budget_figure import budget_figure
from bench.report.page.document import Column, Listing, Notice, Part, Picture, Section, Table
from bench.report.rocking_figure import Impacts, impacts_figure

PROTOCOL, ALL, IMPACTS = "free-rocking", "all tilts", "impacts of "
"""Name of the protocol, of the row of all tilts, and what the names of the fits of single impacts begin with."""

_COVERAGE = 2.0

_MOTION = (("r_motion", "r_exp"), ("r_motion_uncertainty", "r_exp_uncertainty"))
"""Fields of the fit, and those that were the fit's in files from before the amplitudes could be the result."""


def rocking_section(campaign: Campaign) -> Section | None:
    """Result, tilts and single impacts; None for a file of another protocol, or without a result."""
    if campaign.protocol != PROTOCOL or not campaign.points:
        return None
    tilts = [row for row in campaign.points if row["part"] != ALL]
    combined = next((row for row in campaign.points if row["part"] == ALL), None)
    parts: list[Part] = []
    if combined is None:
        parts.append(Notice("The run ended before its tilts could be combined."))
    else:
        parts += [_result(combined), _shape(combined)]
    parts.append(_tilts([*tilts, combined] if combined else tilts))
    parts += _budget([*tilts, combined] if combined else tilts)
    remarks = [f"{row['part']}: {row['remarks']}" for row in campaign.points if row["remarks"]]
    if remarks:
        parts += ["What was noticed:", Listing(remarks)]
    if combined and (impacts := _impacts(campaign, tilts)):
        caption = "Restitution of every impact from the largest angles before and after it (measured), with the mean"
        figure = impacts_figure(impacts, combined["r_exp"], combined["r_th"])
        parts.append(Picture(figure, f"{caption} and theory.", "Restitution over the speed of the impact."))
    return Section("free-rocking", "Free rocking of the block", parts)


def _result(row: Mapping[str, Any]) -> str:
    ratio = with_uncertainty(row["ratio"], row["ratio_uncertainty"])
    theory = with_uncertainty(row["r_th"], row["r_th_uncertainty"])
    by = (
        "The restitution is that of the sizes of the swings: impacts differ so much from one another that the exact"
        " nonlinear motion, fitted from the release on, is the worse estimate."
        if row.get("estimator") == "amplitudes"
        else "The restitution is that of the exact nonlinear motion, fitted from the release on; the amplitudes alone"
        " are a check of it."
    )
    return (
        f"r_exp / r_th = {ratio}, from {row['impacts']} impacts of the stand-alone block on a table clamped to the"
        f" ground, with r_th = {theory} by the block's sides. Uncertainties are expanded (k = 2). {by}"
    )


def _shape(row: Mapping[str, Any]) -> Table:
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
    rows.append(["r", "change over all speeds", with_uncertainty(row["trend"], row["trend_uncertainty"]), "0", "1"])
    columns = [
        Column("symbol", words=True),
        Column("meaning", words=True),
        Column("by the motion"),
        Column("expected"),
        Column("unit", words=True),
    ]
    return Table("Shape of the block, and dependence of r on the speed (k = 2)", columns, rows)


def _tilts(rows: list[dict[str, Any]]) -> Table:
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
    return Table("Tilts, above zero towards the frame (measured, k = 2)", columns, cells)


def _budget(rows: list[dict[str, Any]]) -> list[Part]:
    """Bars of what makes the uncertainty of r; nothing for files from before it was kept."""
    known = [row for row in rows if row.get("uncertainty_parts")]
    if not known:
        return []
    figure = budget_figure(
        [str(row["part"]) for row in known],
        [json.loads(row["uncertainty_parts"]) for row in known],
        [100.0 * row["r_exp_uncertainty"] / row["r_exp"] for row in known],
        "expanded uncertainty of r",
    )
    text = "What makes the uncertainty of r: bars as long as it is (k = 2), cut in the shares of the variance."
    return [Picture(figure, text, "Horizontal bars of the expanded uncertainty, divided by contribution.")]


def _impacts(campaign: Campaign, tilts: list[dict[str, Any]]) -> list[Impacts]:
    fits = {fit.name.removeprefix(IMPACTS): fit for fit in campaign.record.fits if fit.name.startswith(IMPACTS)}
    found: list[Impacts] = []
    for row in tilts:
        if (fit := fits.get(str(row["part"]))) is not None:
            speed, each, doubt = (
                fit.columns[name].values for name in ("speed", "restitution", "restitution_uncertainty")
            )
            found.append(Impacts(float(row["tilt_rad"]), speed, each, _COVERAGE * doubt))
    return found
