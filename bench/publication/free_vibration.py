"""The frame and its springs as free vibration told them."""

from collections.abc import Mapping
from math import tau
from typing import Any

from bench.publication.campaign import Campaign
from bench.publication.numbers import ABSENT, plain, with_uncertainty, yes_or_no
from bench.publication.typography import counted
from bench.publication.vibration_pictures import damping_course, frame_budget, spring_pictures
from bench.report.page.document import Column, Part, Section, Table

_EXPANDED = "Uncertainties are expanded (k = 2); those of the masses are in them."


def vibration_section(campaign: Campaign) -> Section | None:
    """Stiffness, damping and springs, decay by decay; None for a file of something else."""
    points = campaign.points
    if not points:
        return None
    if "k1_n_m" in points[0]:
        parts = [_frame_text(points), _frame(points), *frame_budget(points), _damping(points), *damping_course(points)]
        return Section("frame", "Frame from free vibration", parts)
    if "k1_with_spring_n_m" in points[0]:
        text = (
            "With the block held, the spring adds to the stiffness of the first storey: k_C is the difference to the "
            f"bare frame. {_EXPANDED}"
        )
        return Section("springs", "Springs with the block held", [text, _springs(points), *spring_pictures(points)])
    return None


def _frame_text(points: list[dict[str, Any]]) -> Part:
    decays = sum(row["decay"] > 0 for row in points)
    together = [row for row in points if row["decay"] == 0]
    text = (
        f"{counted(decays, 'decay')} of the bare frame, each fitted with the exact response to the measured motion of "
        f"the table. {_EXPANDED}"
    )
    birge = together[-1]["birge"] if together else None
    if birge is not None:
        text += f" The decays scatter by at most {birge:.2f} times their own uncertainty (Birge ratio)."
    return text


def _frame(points: list[dict[str, Any]]) -> Table:
    columns = [
        Column("decay", words=True),
        Column("k₁", "N/m"),
        Column("k₂", "N/m"),
        Column("ξ₁", "%"),
        Column("ξ₂", "%"),
        Column("f₁", "Hz"),
        Column("f₂", "Hz"),
    ]
    rows = [
        [
            _decay(row),
            _value(row, "k1_n_m", "k1"),
            _value(row, "k2_n_m", "k2"),
            _value(row, "xi1", "xi1", 100.0),
            _value(row, "xi2", "xi2", 100.0),
            _value(row, "omega1_rad_s", "omega1", 1.0 / tau),
            _value(row, "omega2_rad_s", "omega2", 1.0 / tau),
        ]
        for row in points
    ]
    return Table("Stiffness, damping and natural frequencies of the bare frame", columns, rows)


def _damping(points: list[dict[str, Any]]) -> Table:
    columns = [
        Column("decay", words=True),
        Column("drift", "mm"),
        Column("left by the fit", "µm"),
        Column("ξ₁ over drift", "%/mm"),
        Column("ξ₂ over drift", "%/mm"),
        Column("significant", words=True),
    ]
    rows = [
        [
            _decay(row),
            plain(1e3 * row["drift_peak_m"], 3),
            plain(1e6 * row["residual_m"], 3),
            _value(row, "slope1_per_m", "slope1", 0.1),
            _value(row, "slope2_per_m", "slope2", 0.1),
            yes_or_no(not row["damping_is_linear"]),
        ]
        for row in points
    ]
    return Table("What the fit leaves, and whether the damping depends on the amplitude (99 %)", columns, rows)


def _springs(points: list[dict[str, Any]]) -> Table:
    columns = [
        Column("spring β", words=True),
        Column("decay", words=True),
        Column("k₁ + k_C", "N/m"),
        Column("k_C", "N/m"),
        Column("as labelled", "N/m"),
        Column("β mounted", "1"),
        Column("k₂", "N/m"),
    ]
    rows = [
        [
            "bare frame" if row["beta"] is None else f"{row['beta']:g}",
            _decay(row),
            _value(row, "k1_with_spring_n_m", "k1_with_spring"),
            _value(row, "k_c_n_m", "k_c"),
            plain(row["k_c_nominal_n_m"], 5),
            _value(row, "beta_mounted", "beta"),
            _value(row, "k2_n_m", "k2"),
        ]
        for row in points
    ]
    return Table("Stiffness of the springs as mounted", columns, rows)


def _decay(row: Mapping[str, Any]) -> str:
    return str(row["decay"]) if row["decay"] else "all"


def _value(row: Mapping[str, Any], name: str, doubt: str, factor: float = 1.0) -> str:
    value, uncertainty = row[name], row[f"{doubt}_uncertainty"]
    return ABSENT if value is None else with_uncertainty(factor * value, factor * (uncertainty or 0.0))
