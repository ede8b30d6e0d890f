"""Free vibration of the frame and of its springs: values, budgets, damping over the amplitude.

Points of files from before there were budgets have none: what they lack is left out.
"""

import json
from collections.abc import Mapping, Sequence
from math import tau
from typing import Any

from bench.publication.campaign import Campaign
from bench.publication.numbers import ABSENT, plain, with_uncertainty, yes_or_no
from bench.publication.typography import counted
from bench.report.budget_figure import budget_figure
from bench.report.page.document import Column, Part, Picture, Section, Table
from bench.report.vibration_figure import Course, damping_figure, labels_figure

_COVERAGE = 2.0
_SIGNS = {"k1": ("k₁", "k1_n_m"), "k2": ("k₂", "k2_n_m"), "xi1": ("ξ₁", "xi1"), "xi2": ("ξ₂", "xi2")}

Rows = Sequence[Mapping[str, Any]]


def frame_budget(points: Rows) -> list[Part]:
    """A table and bars of what makes the uncertainty of the frame, all decays together."""
    together = [row for row in points if row["decay"] == 0 and row.get("k1_parts")]
    if not together:
        return []
    row = together[-1]
    shares = [_shares(row[f"{name}_parts"], row[field]) for name, (_, field) in _SIGNS.items()]
    expanded = [100.0 * row[f"{name}_uncertainty"] / abs(row[field]) for name, (_, field) in _SIGNS.items()]
    return _budget("the frame", [sign for sign, _ in _SIGNS.values()], shares, expanded)


def damping_course(points: Rows) -> list[Part]:
    """The damping ratios of both modes over the amplitude, in windows of every decay."""
    told = [row for row in points if row.get("damping1_course")]
    together = [row for row in points if row["decay"] == 0]
    if not told or not together:
        return []
    modes = [[_course(row[f"damping{mode}_course"]) for row in told] for mode in (1, 2)]
    figure = damping_figure(modes, [together[-1]["xi1"], together[-1]["xi2"]])
    caption = "Damping ratios in five windows of every decay over the amplitude of the drift in the mode."
    return [Picture(figure, caption, "Damping ratio over amplitude for both modes, with the stated value.")]


def spring_pictures(points: Rows) -> list[Part]:
    """Springs beside their labels, and what makes their uncertainty."""
    rows = [row for row in points if row["beta"] is not None and row["decay"] == 0]
    if not rows:
        return []
    figure = labels_figure(*([row[name] for row in rows] for name in ("beta", "beta_mounted", "beta_uncertainty")))
    caption = "How far the springs as mounted are off their labels, with expanded uncertainties (k = 2)."
    parts: list[Part] = [Picture(figure, caption, "Deviation of every spring from its label.")]
    known = [row for row in rows if row.get("k_c_parts")]
    if not known:
        return parts
    shares = [_shares(row["k_c_parts"], row["k_c_n_m"]) for row in known]
    expanded = [100.0 * row["k_c_uncertainty"] / abs(row["k_c_n_m"]) for row in known]
    return parts + _budget("k_C", [f"β = {row['beta']:g}" for row in known], shares, expanded)


def _budget(quantity: str, labels: list[str], shares: list[dict[str, float]], expanded: list[float]) -> list[Part]:
    names = sorted({name for each in shares for name in each}, key=lambda name: -sum(s.get(name, 0.0) for s in shares))
    columns = [Column("quantity", words=True), Column("U (k = 2)", "%"), *(Column(name, "%") for name in names)]
    rows = [
        [label, f"{size:.4f}", *(f"{share[name]:.4f}" if name in share else ABSENT for name in names)]
        for label, size, share in zip(labels, expanded, shares, strict=True)
    ]
    caption = f"Uncertainty budget of {quantity}: expanded, and standard by part, the largest first"
    figure = budget_figure(labels, shares, expanded, "expanded uncertainty")
    text = f"What makes the uncertainty of {quantity}: bars as long as it is, cut in the shares of the variance."
    return [Table(caption, columns, rows), Picture(figure, text, "Horizontal bars divided by contribution.")]


def _shares(parts: str, value: float) -> dict[str, float]:
    """Standard uncertainties relative to the value [%], by part."""
    return {name: 100.0 * size / abs(value) for name, size in json.loads(parts).items()}


def _course(told: str) -> Course:
    amplitude, damping, uncertainty = json.loads(told)
    return Course(amplitude, damping, [_COVERAGE * each for each in uncertainty])


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
