"""Tests under earthquake records: gains as in Fig. 8(a) and 9(a), motions as in 7, drifts as in 8(b) and 9(b)."""

from collections.abc import Mapping, Sequence
from typing import Any, cast

from bench.config.validation import validated
from bench.publication.campaign import Campaign
from bench.publication.numbers import ABSENT, percent, plain, with_uncertainty, yes_or_no
from bench.publication.typography import counted, typeset
from bench.record.tables import arrays
from bench.report.earthquake_gains import gain_figure
from bench.report.page.document import Column, Listing, Part, Picture, Section, Table
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import band_used
from protocols.earthquake.report_histories import histories_parts
from protocols.earthquake.statement import check_statement


def seismic_section(campaign: Campaign) -> Section:
    """Measured against predicted for every record and stiffness."""
    points = campaign.seismic_points
    compared = [row["agrees"] for row in points if row["agrees"] is not None]
    toppled = sum(row["status"] == "overturned" for row in points)
    parts: list[Part] = [
        f"{counted(len(points), 'test')}; {sum(compared)} of {len(compared)} measured gains lie within what the model "
        "and the uncertainties let expect for the motion that the table really made, and the block toppled in "
        f"{toppled or 'none'}. Uncertainties of measured gains are expanded (k = 2); the interval holds 95 % of what "
        "may be measured, by Monte Carlo over specimen and sensors.",
        _gains(points),
        _first_storey(points),
        _conditions(points),
    ]
    table = campaign.record.tables.get("prediction", {})
    if {"record", "beta", "alpha_2"} <= table.keys():
        parts.append(
            Picture(
                gain_figure(points, arrays(table)),
                "Gain α₂ over the stiffness ratio: measured (k = 2), and predicted for the asked and achieved motions.",
                "A panel for each record: gain of the peak drift over the stiffness ratio, predicted and measured.",
            )
        )
    parts += _statement(campaign, points)
    remarks = [f"{row['record']}, β = {row['beta']:g}: {typeset(row['reason'])}" for row in points if row["reason"]]
    if remarks:
        parts += ["What was noticed at single tests:", Listing(remarks)]
    parts += histories_parts(campaign)
    return Section("seismic", "Earthquake records (as Fig. 7 to 9 of the paper)", parts)


def _gains(points: Sequence[Mapping[str, Any]]) -> Table:
    columns = [
        Column("record", words=True),
        Column("β", "1"),
        Column("status", words=True),
        Column("α₂ measured", "1"),
        Column("α₂ predicted", "1"),
        Column("95 % interval", "1"),
        Column("asked motion", "1"),
        Column("topples", "%"),
        Column("agrees", words=True),
    ]
    rows: list[list[str]] = []
    for row in points:
        chance = row["topple_chance"]
        rows.append(
            [
                str(row["record"]),
                f"{row['beta']:g}",
                str(row["status"]),
                with_uncertainty(row["alpha_2"], row["alpha_2_uncertainty"]),
                plain(row["alpha_2_predicted"]),
                _interval(row["alpha_2_low"], row["alpha_2_high"]),
                plain(row["alpha_2_target"]),
                ABSENT if chance is None else f"{100.0 * chance:.0f}",
                yes_or_no(row["agrees"]),
            ]
        )
    caption = "Gains under earthquake records, measured and predicted; topples: predicted chance that the block falls"
    return Table(caption, columns, rows)


def _first_storey(points: Sequence[Mapping[str, Any]]) -> Table:
    columns = [
        Column("record", words=True),
        Column("β", "1"),
        Column("α₁ measured", "1"),
        Column("α₁ predicted", "1"),
        Column("difference", "%"),
        Column("95 % interval", "1"),
        Column("agrees", words=True),
    ]
    rows: list[list[str]] = []
    for row in points:
        measured, predicted = row["alpha_1"], row["alpha_1_predicted"]
        rows.append(
            [
                str(row["record"]),
                f"{row['beta']:g}",
                with_uncertainty(measured, row["alpha_1_uncertainty"]),
                plain(predicted),
                percent(measured / predicted - 1.0) if measured is not None and predicted else ABSENT,
                # files of before these fields have the gain without a verdict
                _interval(row.get("alpha_1_low"), row.get("alpha_1_high")),
                yes_or_no(row.get("alpha_1_agrees")),
            ]
        )
    caption = "Gains of the first storey (k = 2), and predicted for the achieved motion; interval and verdict as for α₂"
    return Table(caption, columns, rows)


def _interval(low: float | None, high: float | None) -> str:
    return ABSENT if low is None or high is None else f"{low:.3f} to {high:.3f}"


def _conditions(points: Sequence[Mapping[str, Any]]) -> Table:
    columns = [
        Column("record", words=True),
        Column("β", "1"),
        Column("peak asked", "m/s²"),
        Column("peak achieved", "m/s²"),
        Column("tracking error, coupled", "%"),
        Column("spectrum error", "%"),
        Column("coupled against bare", "%"),
        Column("peak drift, coupled", "mm"),
        Column("peak drift, bare", "mm"),
        Column("passes"),
        Column("largest uncertainty", words=True),
    ]
    rows = [
        [
            str(row["record"]),
            f"{row['beta']:g}",
            plain(row["pga_target_m_s2"]),
            plain(row["pga_m_s2"]),
            percent(row["tracking_error"]).removeprefix("+"),
            percent(row["spectrum_error"]).removeprefix("+"),
            percent(row["motion_difference"]).removeprefix("+"),
            plain(None if row["drift_peak_m"] is None else 1e3 * row["drift_peak_m"]),
            plain(None if row["bare_drift_peak_m"] is None else 1e3 * row["bare_drift_peak_m"]),
            plain(row["passes"]),
            row["dominating"] or ABSENT,
        ]
        for row in points
    ]
    caption = "How the table followed: rms errors over the rms of the record, within the band; and the peaks"
    return Table(caption, columns, rows)


def _statement(campaign: Campaign, points: Sequence[Mapping[str, Any]]) -> list[Part]:
    """The paper's statement, for the band that was used: model, measured and paper side by side."""
    if campaign.configuration is None:
        return []
    parameters = validated(EarthquakeParameters, campaign.parameters)
    low, high = band_used(parameters, campaign.configuration)
    checked = check_statement(points, (low, high))
    rows = [["the paper, experiments", "holds", "about 0.5", "holds", "holds"]]
    for source, found in checked.items():
        if isinstance(found, dict):
            found = cast(dict[str, Any], found)
            rows.append([source, found["below_one"], plain(found["best"]), found["around_half"], found["towards_one"]])
    columns = [
        Column("gains", words=True),
        Column("α₂ < 1 throughout", words=True),
        Column("best α₂", "1"),
        Column("best about 0.5", words=True),
        Column("towards 1 as β grows", words=True),
    ]
    return [Table(f"Statement 8 of the paper, with records limited to {low:g} to {high:g} Hz", columns, rows)]
