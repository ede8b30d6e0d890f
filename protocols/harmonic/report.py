"""Report sections on steady sine tests: gains and budgets; spectra, map and cycles (Figs. 6, 4 and 5 of the paper)."""

from collections.abc import Mapping, Sequence
from math import degrees
from typing import Any

from bench.analysis.signals import SignalMap
from bench.datafile.tables import arrays
from bench.document.campaign import Campaign
from bench.document.document import Column, Listing, Notice, Part, Picture, Section, Table
from bench.document.gain_map import map_section
from bench.document.typography import ABSENT, counted, percent, plain, typeset, with_uncertainty, yes_or_no
from bench.figures.map_figure import MapPoint
from bench.figures.spectra_figure import gain_spectra
from bench.prediction.bands import expanded_uncertainty
from protocols.common.budgets import budget_parts, budgeted
from protocols.common.sine.holding import HoldCycle
from protocols.harmonic.protocol import COMPARED
from protocols.harmonic.report_cycles import Dwells, MeasuredMotion, measured_figure
from protocols.harmonic.report_hold import hold_figure
from sim.errors import InvalidInput
from sim.gain import Branch, predict_gain

ROWS = 4
"""Maximum number of points in a figure of cycles."""

BRANCHES = "rocking", "resting"


def harmonic_sections(campaign: Campaign) -> list[Section]:
    """Sections on results, gain spectra, gain map, holds and time histories; none for a file without points."""
    if not campaign.harmonic_points:
        return []
    measured = [
        MapPoint(row["omega_rad_s"], row["beta"], row["layer"], row["alpha_2"]) for row in campaign.harmonic_points
    ]
    found = [
        _results_section(campaign),
        _spectra_section(campaign),
        map_section(campaign.specimen, campaign.amplitude_factor, measured),
        _holds_section(campaign),
        _histories_section(campaign),
    ]
    return [section for section in found if section is not None]


def _results_section(campaign: Campaign) -> Section:
    """Measured and predicted gain of every point with uncertainties, and the conditions of its test."""
    points = campaign.harmonic_points
    compared = [row["agrees"] for row in points if row["agrees"] is not None]
    parts: list[Part] = [
        f"{counted(len(points), 'point was', 'points were')} tested, {len(compared)} with a steady or held "
        f"motion that can be compared, of which {counted(sum(compared), 'agrees', 'agree')} with the "
        "prediction. Both gains are for the achieved amplitudes of the table and for the branch of the point. They "
        "agree when they differ by no more than their combined uncertainty (root sum of squares). The uncertainty of a "
        "measured gain is expanded (k = 2) and includes sensors and scatter, for a modulated motion only sensors and "
        "noise; that of a predicted gain (k = 2, to first order) follows from the uncertainty of the specimen.",
        _gains(campaign, points),
        _conditions(points),
        *_budget_parts(points),
    ]
    remarks = [
        f"β = {row['beta']:g}, Ω = {row['omega_rad_s']:g} rad/s: {typeset(row['reason'])}"
        for row in points
        if row["reason"]
    ]
    if remarks:
        parts += ["Remarks on individual points:", Listing(remarks)]
    return Section("results", "Harmonic tests: measured against predicted", parts)


def _spectra_section(campaign: Campaign) -> Section | None:
    """Gain spectra from the stored prediction and the points; None without a stored prediction."""
    table = campaign.record.tables.get("prediction", {})
    if not {"omega", "beta", "alpha_2", "stable", "layer"} <= table.keys():
        return None
    picture = Picture(
        gain_spectra(campaign.harmonic_points, arrays(table)),
        "Gain spectra: measured points with expanded uncertainty (k = 2), and the prediction made before the test.",
        "Gain of the peak drift (logarithmic) against frequency, one panel per stiffness ratio.",
    )
    return Section("spectra", "Gain spectra (as in Fig. 6 of the paper)", [picture])


def _holds_section(campaign: Campaign) -> Section | None:
    """Peak drift and control of every held point; None without held points."""
    held = [row for row in campaign.harmonic_points if row["status"] == "held"]
    cycles = campaign.record.columns_of(HoldCycle)
    if not held or not cycles.get("cycle"):
        return None
    parts: list[Part] = [
        Picture(
            hold_figure(cycles, row["omega_rad_s"], row["beta"]),
            f"Hold at β = {row['beta']:g}, Ω = {row['omega_rad_s']:g} rad/s: peak drift and control of each cycle, "
            "including those after the release.",
            "Peak drift and control, both logarithmic, against the cycle number.",
        )
        for row in held
    ]
    return Section("holds", "Motions held on their orbits", parts)


def _histories_section(campaign: Campaign) -> Section | None:
    """Last measured cycles of every point and the predicted motion; None without measured cycles."""
    points = [row for row in campaign.harmonic_points if row["drift_peak_m"] is not None]
    if not points:
        return None
    return Section("histories", "Time histories (as in Fig. 5 of the paper)", _histories(campaign, points))


def _histories(campaign: Campaign, points: Sequence[Mapping[str, Any]]) -> list[Part]:
    configuration = campaign.configuration
    if configuration is None:
        return [Notice("Not drawn: this version of the software cannot read the file's configuration.")]
    try:
        dwells = Dwells(
            campaign, SignalMap(campaign.record.channels, configuration.laser_reference, configuration.calibrated)
        )
    except InvalidInput as refused:
        return [Notice(f"Not drawn: {refused}.")]
    drawn: list[MeasuredMotion] = []
    missing: list[str] = []
    for row in points:
        motion = dwells.motion(row, _branch(campaign, row))
        if motion is None:
            missing.append(f"β = {row['beta']:g}, Ω = {row['omega_rad_s']:g} rad/s")
        else:
            drawn.append(motion)
    parts: list[Part] = [
        "The curves are the last measured cycles from the raw channels, relative to the values at rest. They start at "
        "an upward zero crossing of the fundamental of the measured table acceleration; delays of the sensors are not "
        "corrected. u₁ is relative to the table. ϑ is not measured; it and the thin dotted curves are predicted for "
        "the achieved amplitude."
    ]
    for beta in sorted({motion.beta for motion in drawn}):
        of_spring = [motion for motion in drawn if motion.beta == beta]
        parts += [
            Picture(
                measured_figure(of_spring[first : first + ROWS]),
                f"Cycles at β = {beta:g}: measured and predicted drift of the coupled frame, and measured drift of the "
                "bare frame (left); measured and predicted u₁, and predicted ϑ (right).",
                "Curves of drift, first storey displacement and predicted rocking angle over three periods.",
            )
            for first in range(0, len(of_spring), ROWS)
        ]
    if missing:
        parts.append(f"The file does not contain the cycles of {'; '.join(missing)}.")
    return parts


def _branch(campaign: Campaign, row: Mapping[str, Any]) -> Branch | None:
    """Predicted branch of a point at its achieved amplitudes; None if there is none."""
    if row["amplitude_m_s2"] is None or row["layer"] not in BRANCHES:
        return None
    specimen = campaign.specimen.coupled(row["beta"])
    return predict_gain(specimen, row["omega_rad_s"], row["amplitude_m_s2"], row["bare_amplitude_m_s2"]).branches.get(
        row["layer"]
    )


def _gains(campaign: Campaign, points: Sequence[Mapping[str, Any]]) -> Table:
    columns = [
        Column("β", "1"),
        Column("Ω", "rad/s"),
        Column("status", words=True),
        Column("branch", words=True),
        Column("α₂ measured", "1"),
        Column("α₂ predicted", "1"),
        Column("difference", "%"),
        Column("agrees", words=True),
        Column("orbit", words=True),
    ]
    rows: list[list[str]] = []
    for row in points:
        measured, predicted = row["alpha_2"], row["alpha_2_predicted"]
        compared = row["status"] in COMPARED and measured is not None and predicted
        branch = _branch(campaign, row)
        open_ = row.get("alpha_2_predicted_uncertainty")
        if open_ is None and branch is not None:
            open_ = expanded_uncertainty(branch, campaign.known)
        stable = row["predicted_stable"]
        rows.append(
            [
                f"{row['beta']:g}",
                f"{row['omega_rad_s']:g}",
                row["status"],
                row["layer"],
                with_uncertainty(measured, row["alpha_2_uncertainty"]),
                with_uncertainty(predicted, open_),
                percent(measured / predicted - 1.0) if compared else ABSENT,
                yes_or_no(row["agrees"]),
                ABSENT if stable is None else "stable" if stable else "unstable",
            ]
        )
    return Table("Gain coefficient α₂, measured and predicted (expanded uncertainties, k = 2)", columns, rows)


def _conditions(points: Sequence[Mapping[str, Any]]) -> Table:
    columns = [
        Column("β", "1"),
        Column("Ω", "rad/s"),
        Column("peak drift, coupled", "mm"),
        Column("peak drift, bare", "mm"),
        Column("table, coupled", "m/s²"),
        Column("table, bare", "m/s²"),
        Column("amplitude error", "%"),
        Column("phase error", "°"),
        Column("table's THD", "%"),
        Column("cycles"),
        Column("settled", "s"),
        Column("starts"),
    ]
    rows: list[list[str]] = []
    for row in points:
        phase = row.get("phase_error_rad")
        distortion = row.get("table_harmonics")
        rows.append(
            [
                f"{row['beta']:g}",
                f"{row['omega_rad_s']:g}",
                plain(_times(row["drift_peak_m"], 1e3)),
                plain(_times(row["bare_drift_peak_m"], 1e3)),
                plain(row["amplitude_m_s2"], 5),
                plain(row["bare_amplitude_m_s2"], 5),
                percent(row["amplitude_error"], 3),
                plain(None if phase is None else degrees(phase), 2),
                plain(_times(distortion, 100.0), 2),
                plain(row["cycles_measured"]),
                plain(row["settle_time_s"], 3),
                plain(row["starts_tried"]),
            ]
        )
    caption = (
        "Conditions of the points. The scale errors of the sensors are common to the coupled and the bare test; those "
        "of the lasers cancel in α₂"
    )
    return Table(caption, columns, rows)


def _budget_parts(points: Sequence[Mapping[str, Any]]) -> list[Part]:
    results = [
        result
        for row in points
        for result in budgeted(
            f"β = {row['beta']:g}, Ω = {row['omega_rad_s']:g} rad/s",
            row["alpha_2"],
            row.get("uncertainty_parts"),
            row["alpha_2_uncertainty"],
            row.get("uncertainty_correlations"),
        )
    ]
    return budget_parts("α₂", results)


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value
