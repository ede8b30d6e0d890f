"""Report on tests under earthquake records: gains (Figs. 8(a) and 9(a) of the paper), table motions (Fig. 7), and
drifts (Figs. 8(b) and 9(b)).
"""

from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DRIFT, SignalMap
from bench.config.validation import validated
from bench.datafile.reader import DataFile
from bench.datafile.resting import rows_at_rest
from bench.datafile.tables import arrays
from bench.document.campaign import Campaign
from bench.document.document import Column, Listing, Notice, Part, Picture, Section, Table
from bench.document.typography import ABSENT, counted, percent, plain, typeset, with_uncertainty, yes_or_no
from bench.figures.earthquake_figure import DriftPicture, MotionPicture, drift_figure, gain_figure, motion_figure
from bench.live_values import RunningGain
from protocols.common.budgets import budget_parts, budgeted
from protocols.earthquake.campaign import check_statement
from protocols.earthquake.laser_check import advice
from protocols.earthquake.measurement import STEP, History
from protocols.earthquake.observation import observe
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import FileSources, Shaking, band_used, shakings
from sim.errors import InvalidInput


def seismic_sections(campaign: Campaign) -> list[Section]:
    """Report section on measured and predicted gains for every record and stiffness."""
    points = campaign.seismic_points
    if not points:
        return []
    compared = [row["agrees"] for row in points if row["agrees"] is not None]
    toppled = sum(row["status"] == "overturned" for row in points)
    parts: list[Part] = [
        f"{counted(len(points), 'test')}; {sum(compared)} of {len(compared)} measured gains are within the "
        "prediction interval for the achieved motion of the table; tests in which the block toppled: "
        f"{toppled or 'none'}. Uncertainties of measured gains are expanded (k = 2); the interval is the 95 % "
        "interval of the measured value, from a Monte Carlo simulation over specimen and sensors.",
        _gains(points),
        _first_storey(points),
        _conditions(points),
        *budget_parts(
            "the difference of measured and predicted α₂",
            [
                result
                for row in points
                for result in budgeted(
                    f"{row['record']}, β = {row['beta']:g}", row["alpha_2"], row.get("uncertainty_parts")
                )
            ],
        ),
    ]
    parts += _advice(campaign, points)
    table = campaign.record.tables.get("prediction", {})
    if {"record", "beta", "alpha_2"} <= table.keys():
        parts.append(
            Picture(
                gain_figure(points, arrays(table)),
                "Gain α₂ against the stiffness ratio: measured (k = 2), and predicted for the requested and the "
                "achieved motion.",
                "One panel per record: gain of the peak drift against the stiffness ratio, predicted and measured.",
            )
        )
    parts += _statement(campaign, points)
    remarks = [f"{row['record']}, β = {row['beta']:g}: {typeset(row['reason'])}" for row in points if row["reason"]]
    if remarks:
        parts += ["Remarks on single tests:", Listing(remarks)]
    parts += histories_parts(campaign)
    return [Section("seismic", "Earthquake records (as in Figs. 7 to 9 of the paper)", parts)]


def _advice(campaign: Campaign, points: Sequence[Mapping[str, Any]]) -> list[Part]:
    if campaign.configuration is None:
        return []
    found = advice(_parameters_of(campaign), campaign.configuration, points)
    return [typeset(found)] if found else []


def _parameters_of(campaign: Campaign) -> EarthquakeParameters:
    """Parameters of the run; files of earlier versions have no `laser_block`."""
    return validated(EarthquakeParameters, {"laser_block": None} | campaign.parameters)


def _gains(points: Sequence[Mapping[str, Any]]) -> Table:
    columns = [
        Column("record", words=True),
        Column("β", "1"),
        Column("status", words=True),
        Column("α₂ measured", "1"),
        Column("α₂ predicted", "1"),
        Column("95 % interval", "1"),
        Column("requested motion", "1"),
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
    caption = (
        "Measured and predicted gains under earthquake records; topples: predicted probability that the block topples"
    )
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
                # older files lack these fields and contain the gain without a verdict
                _interval(row.get("alpha_1_low"), row.get("alpha_1_high")),
                yes_or_no(row.get("alpha_1_agrees")),
            ]
        )
    caption = (
        "Gains of the first storey, measured (k = 2) and predicted for the achieved motion; interval and "
        "verdict as for α₂"
    )
    return Table(caption, columns, rows)


def _interval(low: float | None, high: float | None) -> str:
    return ABSENT if low is None or high is None else f"{low:.3f} to {high:.3f}"


def _conditions(points: Sequence[Mapping[str, Any]]) -> Table:
    columns = [
        Column("record", words=True),
        Column("β", "1"),
        Column("requested peak", "m/s²"),
        Column("achieved peak", "m/s²"),
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
    caption = "Tracking of the table: errors relative to the record, within the band, and peaks of table and drift"
    return Table(caption, columns, rows)


def _statement(campaign: Campaign, points: Sequence[Mapping[str, Any]]) -> list[Part]:
    """Table of the verdicts on the paper's statement, for measured and predicted gains in the band of the campaign."""
    if campaign.configuration is None:
        return []
    parameters = _parameters_of(campaign)
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
    return [Table(f"Statement 8 of the paper, for records limited to {low:g} to {high:g} Hz", columns, rows)]


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Played:
    """Played record: file rows `start` to `stop`, from the start of its drive to its last running gain; `run` is the
    first row of its run.
    """

    name: str
    beta: float | None
    run: int
    start: int
    stop: int


def played_records(record: DataFile) -> list[Played]:
    """Every played record with running gains in the file, in order; `beta` is None for the bare frame."""
    gains, blocks = record.columns_of(RunningGain), record.blocks
    found: list[Played] = []
    if not gains:
        return found
    rows, runs, times = (blocks[column] for column in ("row", "run", "time"))
    for time, name, beta, seconds in zip(
        *(gains[column] for column in ("time", "record", "beta", "seconds")), strict=True
    ):
        block = bisect_right(times, time + 1e-6) - 1
        if block < 0:
            continue
        stop = int(rows[block + 1]) if block + 1 < rows.size else record.rows
        begin = int(rows[bisect_left(runs, runs[block])])
        samples = round(seconds * record.sample_rate)
        one = Played(str(name), None if beta is None else float(beta), begin, stop - samples, stop)
        # all gains of a played record are relative to the same start
        if found and (found[-1].run, found[-1].name, found[-1].beta) == (one.run, one.name, one.beta):
            # the first gain is at the end of a block, which determines the start; the last gain may be within a block
            start = found.pop().start
            one = replace(one, start=start, stop=start + samples)
        found.append(one)
    return [one for one in found if one.start >= one.run]


def signals_of(record: DataFile, signals: SignalMap, played: Played, rest: float) -> Floats:
    """Signals of a played record, shape (n, n_signals), relative to their values in the `rest` seconds at rest before
    the drive.
    """

    def values(start: int, stop: int) -> Floats:
        return np.column_stack([record.values(channel.name, slice(start, stop)) for channel in record.channels])

    still = rows_at_rest(record, played.run, rest)
    signals.tare(values(still.start, still.stop))
    return signals.of(values(played.start, played.stop))


MOST = 7
"""Largest number of records in a figure of histories."""


def histories_parts(campaign: Campaign) -> list[Part]:
    """Figures of the table's motions and of the drifts, from the raw channels."""
    record, configuration = campaign.record, campaign.configuration
    if configuration is None:
        return [Notice("Histories are not drawn: this version of the software cannot read the file's configuration.")]
    try:
        signals = SignalMap(record.channels, configuration.laser_reference, configuration.calibrated)
    except InvalidInput as refused:
        return [Notice(f"Histories are not drawn: {refused}.")]
    names = list(dict.fromkeys(row["record"] for row in campaign.seismic_points))
    plays = played_records(record)
    try:
        parameters = _parameters_of(campaign)
        known = {shaking.name: shaking for shaking in _shakings(campaign, parameters)}
    except InvalidInput as refused:
        return [Notice(f"Histories are not drawn because the records cannot be prepared: {refused}.")]
    every = max(round(STEP * record.sample_rate), 1)
    interval = every / record.sample_rate
    motions: list[MotionPicture] = []
    drifts: list[DriftPicture] = []
    for name in names:
        shaking = known.get(name)
        if shaking is None:
            continue
        for play in _bare_and_softest([play for play in plays if play.name == name]):
            shown = signals_of(record, signals, play, parameters.rest)
            if play.beta is None:
                asked = shaking.target.acceleration
                achieved = shown[: asked.size : every, ACCELERATION]
                motions.append(MotionPicture(name, interval, asked[::every][: achieved.size], achieved))
            drifts.append(
                DriftPicture(
                    name,
                    play.beta,
                    interval,
                    shown[::every, DRIFT],
                    _predicted_drift(campaign, shaking, play, shown),
                    STEP,
                )
            )
    parts: list[Part] = []
    for first in range(0, len(motions), MOST):
        figure = motion_figure(motions[first : first + MOST])
        caption = "Acceleration of the table under the records: as requested, and as measured with the bare frame."
        parts.append(Picture(figure, caption, "Acceleration against time, one row per record."))
    for first in range(0, len(names), MOST):
        some = [drift for drift in drifts if drift.name in names[first : first + MOST]]
        if some:
            caption = "Drift of the bare frame and of the frame coupled by the softest spring: measured"
            if any(drift.predicted.size for drift in some):
                caption += ", and predicted for the achieved table motion"
            if not all(drift.predicted.size for drift in some):
                caption += "; no prediction for tests that ended early or whose signals cannot be evaluated"
            parts.append(Picture(drift_figure(some), f"{caption}.", "Drift against time, one row per record."))
    return parts


def _shakings(campaign: Campaign, parameters: EarthquakeParameters) -> tuple[Shaking, ...]:
    """Records of the campaign from the data file; an older file does not contain them, so they are read again.

    Raises InvalidInput for records that cannot be read or prepared.
    """
    assert campaign.configuration is not None
    return shakings(parameters, campaign.configuration, FileSources.stored(campaign.record.tables))


def _bare_and_softest(plays: Sequence[Played]) -> list[Played]:
    """The last test of the bare frame and the last test with the softest spring."""
    bare = [play for play in plays if play.beta is None]
    springs = sorted(
        (play for play in plays if play.beta is not None), key=lambda play: (play.beta or 0.0, -play.start)
    )
    return [*bare[-1:], *springs[:1]]


def _predicted_drift(campaign: Campaign, shaking: Shaking, play: Played, shown: Floats) -> Floats:
    """Predicted drift [m] every `STEP` seconds under the measured table motion; empty if it cannot be evaluated."""
    if len(shown) < shaking.target.acceleration.size:
        # the evaluation of the table's motion requires signals that end at rest
        return np.zeros(0)
    specimen = campaign.specimen.bare() if play.beta is None else campaign.specimen.coupled(play.beta)
    try:
        base = observe(shown, shaking.target.rest, campaign.record.sample_rate).base
    except InvalidInput:
        return np.zeros(0)
    return History.of(specimen, base).drift
