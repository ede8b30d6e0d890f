"""Tests under earthquake records: gains as in Fig. 8(a) and 9(a), motions as in 7, drifts as in 8(b) and 9(b)."""

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DRIFT, SignalMap
from bench.config.validation import validated
from bench.publication.campaign import Campaign
from bench.publication.numbers import ABSENT, percent, plain, with_uncertainty, yes_or_no
from bench.publication.played import Played, played_records, signals_of
from bench.record.tables import arrays
from bench.report.earthquake_gains import gain_figure
from bench.report.earthquake_histories import DriftPicture, MotionPicture, drift_figure, motion_figure
from bench.report.page.document import Column, Listing, Notice, Part, Picture, Section, Table
from protocols.earthquake.live import STEP, History
from protocols.earthquake.observed import observe
from protocols.earthquake.parameters import EarthquakeParameters
from protocols.earthquake.records import Shaking, band_used, shakings
from protocols.earthquake.statement import check_statement
from sim.errors import InvalidInput

Floats = NDArray[np.float64]

HEADING = "Earthquake records (as Fig. 7 to 9 of the paper)"

NONE = "There is no seismic test in this file."

MOST = 7
"""Records in a figure of histories."""


def seismic_section(campaign: Campaign) -> Section:
    """Measured against predicted for every record and stiffness."""
    points = campaign.seismic_points
    if not points:
        return Section("seismic", HEADING, [NONE])
    compared = [row["agrees"] for row in points if row["agrees"] is not None]
    toppled = sum(row["status"] == "overturned" for row in points)
    parts: list[Part] = [
        f"{len(points)} tests; {sum(compared)} of {len(compared)} measured gains lie within what the model and the "
        f"uncertainties let expect for the motion that the table really made, and the block toppled in {toppled}. "
        "Uncertainties of measured gains are expanded (k = 2); the interval holds 95 % of what may be measured, by "
        "Monte Carlo over specimen and sensors.",
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
    parts += _histories(campaign)
    remarks = [f"{row['record']}, β {row['beta']:g}: {row['reason']}" for row in points if row["reason"]]
    if remarks:
        parts += ["What was noticed at single tests:", Listing(remarks)]
    return Section("seismic", HEADING, parts)


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
        low, high, chance = row["alpha_2_low"], row["alpha_2_high"], row["topple_chance"]
        rows.append(
            [
                str(row["record"]),
                f"{row['beta']:g}",
                str(row["status"]),
                with_uncertainty(row["alpha_2"], row["alpha_2_uncertainty"]),
                plain(row["alpha_2_predicted"]),
                ABSENT if low is None or high is None else f"{low:.3f} to {high:.3f}",
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
            ]
        )
    return Table("Gains of the first storey (k = 2), and predicted for the achieved motion", columns, rows)


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


def _histories(campaign: Campaign) -> list[Part]:
    """The table's motions and the drifts, from the raw channels."""
    record, configuration = campaign.record, campaign.configuration
    if configuration is None:
        return [Notice("Histories are not drawn: this version of the software does not know the file's configuration.")]
    try:
        signals = SignalMap(record.channels, configuration.laser_reference)
    except InvalidInput as refused:
        return [Notice(f"Histories are not drawn: {refused}.")]
    names = list(dict.fromkeys(row["record"] for row in campaign.seismic_points))
    plays = played_records(record)
    try:
        known = {shaking.name: shaking for shaking in _shakings(campaign)}
    except InvalidInput as refused:
        return [Notice(f"Histories are not drawn, for the records are not at hand: {refused}.")]
    every = max(round(STEP * record.sample_rate), 1)
    motions: list[MotionPicture] = []
    drifts: list[DriftPicture] = []
    for name in names:
        shaking = known.get(name)
        if shaking is None:
            continue
        for play in _bare_and_softest([play for play in plays if play.name == name]):
            shown = signals_of(record, signals, play)
            if play.beta is None:
                asked = shaking.target.acceleration
                achieved = shown[: asked.size : every, ACCELERATION]
                motions.append(MotionPicture(name, STEP, asked[::every][: achieved.size], achieved))
            drifts.append(
                DriftPicture(name, play.beta, STEP, shown[::every, DRIFT], _expected(campaign, shaking, play, shown))
            )
    parts: list[Part] = []
    for first in range(0, len(motions), MOST):
        figure = motion_figure(motions[first : first + MOST])
        caption = "Acceleration of the table under the records: as asked, and as measured with the bare frame."
        parts.append(Picture(figure, caption, "Acceleration over time, a row for each record."))
    for first in range(0, len(names), MOST):
        some = [drift for drift in drifts if drift.name in names[first : first + MOST]]
        if some:
            caption = (
                "Drift of the bare frame and of the coupled one with the softest spring: measured, and predicted for "
                "the motion that the table made."
            )
            parts.append(Picture(drift_figure(some), caption, "Drift over time, a row for each record."))
    return parts


def _shakings(campaign: Campaign) -> tuple[Shaking, ...]:
    """The records as the campaign used them, read anew. Raises InvalidInput where one is not there any more."""
    assert campaign.configuration is not None
    parameters = validated(EarthquakeParameters, campaign.parameters)
    return shakings(parameters, campaign.configuration)


def _bare_and_softest(plays: Sequence[Played]) -> list[Played]:
    """The last test of the bare frame, and the last one with the softest spring."""
    bare = [play for play in plays if play.beta is None]
    springs = sorted(
        (play for play in plays if play.beta is not None), key=lambda play: (play.beta or 0.0, -play.start)
    )
    return [*bare[-1:], *springs[:1]]


def _expected(campaign: Campaign, shaking: Shaking, play: Played, shown: Floats) -> Floats:
    """The predicted drift [m] every STEP under the motion that the table made; empty where that cannot be seen."""
    specimen = campaign.specimen.bare() if play.beta is None else campaign.specimen.coupled(play.beta)
    try:
        base = observe(shown, shaking.target.rest, campaign.record.sample_rate).base
    except InvalidInput:
        return np.zeros(0)
    return History.of(specimen, base).drift
