# pyright: reportUnknownMemberType=false
"""Results of a stability test: text table, figure, and report section."""

from cmath import rect
from collections.abc import Mapping, Sequence
from math import degrees, nan
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.analysis.uncertainty import COVERAGE
from bench.datafile.tables import arrays
from bench.document.campaign import Campaign
from bench.document.document import Column, Listing, Part, Picture, Section, Table
from bench.document.typography import plain, typeset, with_uncertainty
from bench.figures.style import BLACK, BLUE, GREEN, GREY, VERMILLION, new_figure, set_grid
from bench.figures.text_table import TextColumn, text_table
from protocols.common.budgets import budget_parts, budgeted
from protocols.stability.laws import HOUSNER, WORDS, law_texts
from protocols.stability.prediction import Boundary, boundaries
from protocols.stability.protocol import StabilityPoint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Curve = Mapping[str, NDArray[Any]]

ABSENT = "-"

STABLE, UNSTABLE, OPEN = "stable", "unstable", "not distinguishable from 1"
"""Classes of a measured modulus; `OPEN` if its interval contains 1."""

FILLS: Mapping[str, dict[str, Any]] = {
    STABLE: {"markerfacecolor": "white"},
    UNSTABLE: {"markerfacecolor": BLACK},
    OPEN: {"markerfacecolor": BLACK, "markerfacecoloralt": "white", "fillstyle": "bottom"},
}
"""Fills of the classes' markers."""

LAWS = (
    "laws of restitution (normalised deviation: measured minus predicted, divided by the combined expanded "
    "uncertainty; the restitution is exact):"
)

_COLUMNS = (
    TextColumn("omega", "rad/s"),
    TextColumn("amplitude", "1"),
    TextColumn("status", words=True),
    TextColumn("|mu|", "1"),
    TextColumn("U (k=2)", "1"),
    TextColumn("predicted", "1"),
    TextColumn("U (k=2)", "1"),
    TextColumn("angle", "deg"),
    TextColumn("U (k=2)", "deg"),
    TextColumn("predicted", "deg"),
    TextColumn("agrees", words=True),
)


def by_amplitude(curve: Curve) -> bool:
    """Whether the test varies the amplitude; otherwise it varies the frequency. `curve` is its prediction, which covers
    all planned points.
    """
    return np.unique(curve["amplitude_factor"]).size > 1


def stability(point: StabilityPoint) -> str | None:
    """Class of a point's modulus; None if it was not measured."""
    if point.modulus is None:
        return None
    if abs(point.modulus - 1.0) <= (point.modulus_uncertainty or 0.0):
        return OPEN
    return UNSTABLE if point.modulus > 1.0 else STABLE


def measured_boundaries(points: Sequence[StabilityPoint], *, over: bool = False) -> list[Boundary]:
    """Boundaries between the measured points: amplitude factors if the test is `over` amplitude, otherwise frequencies
    [rad/s].
    """
    known = [point for point in points if point.modulus is not None]
    return boundaries(
        [point.amplitude_factor if over else point.omega_rad_s for point in known],
        [point.modulus or nan for point in known],
        [(point.modulus_uncertainty or 0.0) / COVERAGE for point in known],
    )


def predicted_boundaries(curve: Curve, ground: str) -> list[float]:
    """Frequencies [rad/s] or amplitude factors where a predicted modulus crosses 1; `ground` is "fixed" or "table"."""
    over = np.unique(curve["amplitude_factor"]).size > 1
    places, moduli = curve["amplitude_factor" if over else "omega_rad_s"], curve[f"{ground}_modulus"]
    return [each.place for each in boundaries(places.tolist(), moduli.tolist(), [0.0] * len(places))]


def stability_table(points: Sequence[StabilityPoint], curve: Curve) -> str:
    """Text table with a row per point, followed by the boundaries and remarks."""
    if not points:
        return "No point was measured."
    rows = sorted(points, key=lambda point: (point.omega_rad_s, point.amplitude_factor))
    lines = [text_table(_COLUMNS, map(_cells, rows)), "", *boundary_texts(rows, curve)]
    if laws := laws_texts(rows, curve):
        lines += ["", LAWS, *laws, ""]
    lines += _remarks(rows)
    return "\n".join(lines)


def boundary_texts(points: Sequence[StabilityPoint], curve: Curve) -> list[str]:
    """Statements on the measured and the predicted boundaries."""
    over = by_amplitude(curve)
    unit, name = ("", "amplitude factor") if over else (" rad/s", "frequency")
    found = measured_boundaries(points, over=over)
    lines = [
        f"boundary of stability: {name} {each.place:.4f} +- {each.uncertainty:.4f}{unit} (k = 2), between the points "
        f"{each.low:.4f} and {each.high:.4f}{unit}"
        for each in found
    ]
    if not found:
        classes = [each for point in points if (each := stability(point)) is not None]
        if classes:
            lines.append(f"no boundary was crossed: {_summary(classes)}")
    for ground, words in (("table", "on the simulated table"), ("fixed", "on fixed ground")):
        if np.isfinite(curve[f"{ground}_modulus"]).any():
            places = predicted_boundaries(curve, ground)
            text = ", ".join(f"{place:.4f}{unit}" for place in places) or "none in this range"
            lines.append(f"predicted boundary {words}: {text}")
    return lines


def _summary(classes: Sequence[str]) -> str:
    """Statement on orbits whose moduli are all on one side of 1."""
    clear = [each for each in classes if each != OPEN]
    if not clear:
        return f"every measured modulus is {OPEN} (k = 2)"
    left = len(classes) - len(clear)
    if not left:
        return f"every measured orbit is {clear[0]}"
    are, others = "orbit is" if len(clear) == 1 else "orbits are", "modulus is" if left == 1 else "moduli are"
    return f"{len(clear)} measured {are} {clear[0]}, {left} {others} {OPEN} (k = 2)"


def laws_texts(points: Sequence[StabilityPoint], curve: Curve) -> list[str]:
    """Statements on the laws of restitution."""
    over = by_amplitude(curve)
    return law_texts(points, measured_boundaries(points, over=over), curve, "" if over else " rad/s")


def _remarks(points: Sequence[StabilityPoint]) -> list[str]:
    return ["{} rad/s, amplitude factor {}: ".format(*_place(point)) + point.reason for point in points if point.reason]


def _place(point: StabilityPoint) -> tuple[str, str]:
    """Frequency and amplitude factor, with the digits in which points of the bisection differ."""
    return f"{point.omega_rad_s:.4f}", f"{point.amplitude_factor:.4f}"


def _cells(point: StabilityPoint) -> list[str]:
    def number(value: float | None, form: str) -> str:
        return ABSENT if value is None else format(value, form)

    def angle(value: float | None, form: str) -> str:
        return ABSENT if value is None else format(degrees(value), form)

    return [
        *_place(point),
        str(point.status),
        number(point.modulus, ".4f"),
        number(point.modulus_uncertainty, ".4f"),
        number(point.modulus_predicted, ".4f"),
        number(point.modulus_predicted_uncertainty, ".4f"),
        angle(point.angle_rad, ".2f"),
        angle(point.angle_uncertainty_rad, ".2f"),
        angle(point.angle_predicted_rad, ".2f"),
        ABSENT if point.agrees is None else "yes" if point.agrees else "NO <",
    ]


def stability_figure(points: Sequence[StabilityPoint], curve: Curve) -> "Figure":
    """Modulus against frequency or amplitude, with the boundaries and their intervals, and the multipliers in the
    complex plane; the marker of an unstable orbit is filled, that of a modulus not distinguishable from 1 half filled.
    """
    figure = new_figure(9.0, 3.8)
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    _draw_moduli(left, points, curve)
    _draw_plane(right, points, curve)
    return figure


def _draw_moduli(panel: "Axes", points: Sequence[StabilityPoint], curve: Curve) -> None:
    over = np.unique(curve["amplitude_factor"]).size > 1
    places = curve["amplitude_factor" if over else "omega_rad_s"]
    for ground, label, colour, dash in (
        ("fixed", "predicted, fixed ground", BLUE, "--"),
        ("table", "predicted, this table", VERMILLION, "-"),
    ):
        if np.isfinite(curve[f"{ground}_modulus"]).any():
            panel.plot(places, curve[f"{ground}_modulus"], color=colour, linestyle=dash, linewidth=1.4, label=label)
    for (law, words), dash in zip(WORDS.items(), ("-", ":", "-."), strict=True):
        if law != HOUSNER and f"{law}_modulus" in curve:
            panel.plot(places, curve[f"{law}_modulus"], color=GREEN, linestyle=dash, linewidth=1.0, label=words)
    for number, each in enumerate(measured_boundaries(points, over=by_amplitude(curve))):
        panel.axvspan(each.place - each.uncertainty, each.place + each.uncertainty, color=GREY, alpha=0.35, lw=0)
        label = "_" if number else "measured boundary (k = 2)"
        panel.axvline(each.place, color=GREY, linewidth=1.0, label=label)
    for each, fill in FILLS.items():
        shown = [point for point in points if stability(point) == each]
        if shown:
            panel.errorbar(
                [point.amplitude_factor if over else point.omega_rad_s for point in shown],
                [point.modulus or nan for point in shown],
                [point.modulus_uncertainty or 0.0 for point in shown],
                fmt="o",
                color=BLACK,
                markersize=5,
                capsize=2,
                label=f"measured, {each}",
                **fill,
            )
    panel.axhline(1.0, color=BLACK, linewidth=0.8)
    panel.set_xlabel("amplitude / uplift acceleration" if over else r"$\Omega$  [rad/s]")
    panel.set_ylabel(r"$|\mu|$")
    panel.legend(fontsize=7)
    set_grid(panel)


def _draw_plane(panel: "Axes", points: Sequence[StabilityPoint], curve: Curve) -> None:
    angles = np.linspace(0.0, np.pi, 400)
    panel.plot(np.cos(angles), np.sin(angles), color=BLACK, linewidth=0.8)
    for ground, colour, dash in (("fixed", BLUE, "--"), ("table", VERMILLION, "-")):
        modulus, angle = curve[f"{ground}_modulus"], curve[f"{ground}_angle_rad"]
        panel.plot(modulus * np.cos(angle), modulus * np.sin(angle), color=colour, linestyle=dash, linewidth=1.4)
    shown = list[complex]()
    for point in points:
        if (found := stability(point)) is not None and point.modulus and point.angle_rad:
            value = rect(point.modulus, point.angle_rad)
            panel.plot(value.real, value.imag, "o", color=BLACK, markersize=5, **FILLS[found])
            shown.append(value)
    if shown:
        centre = sum(shown) / len(shown)
        half = max(1.4 * max(abs(value - centre) for value in shown), 0.08)
        panel.set_xlim(centre.real - half, centre.real + half)
        panel.set_ylim(centre.imag - half, centre.imag + half)
    panel.locator_params(nbins=4)
    panel.set_aspect("equal")
    panel.set_xlabel(r"Re $\mu$")
    panel.set_ylabel(r"Im $\mu$")
    set_grid(panel)


def stability_sections(campaign: Campaign) -> list[Section]:
    """Report section with boundaries, figure, points and uncertainty budget."""
    if not campaign.points:
        return []
    points = [StabilityPoint.model_validate(row) for row in campaign.points]
    points.sort(key=lambda point: (point.omega_rad_s, point.amplitude_factor))
    curve = arrays(campaign.record.tables["prediction"])
    parts: list[Part] = [Listing([typeset(text) for text in boundary_texts(points, curve)])]
    caption = (
        "Multipliers of the held orbits after their release (markers, k = 2; filled: unstable, half filled: modulus "
        "not distinguishable from 1) and their prediction (lines): modulus with the boundary and its interval, and the "
        "complex plane with the unit circle."
    )
    parts.append(Picture(stability_figure(points, curve), caption, "Multipliers against frequency or amplitude."))
    parts.append(_points_table(points))
    if laws := laws_texts(points, curve):
        parts += [typeset(LAWS), Listing([typeset(text) for text in laws])]
    budgets = [
        each
        for point in points
        for each in budgeted(
            "{} rad/s, amplitude factor {}".format(*_place(point)),
            point.modulus,
            point.uncertainty_parts,
            point.modulus_uncertainty,
        )
    ]
    parts += budget_parts("|μ|", budgets)
    remarks = _remarks(points)
    return [Section("stability", "Stability of the rocking orbits", [*parts, *([Listing(remarks)] if remarks else [])])]


def _points_table(points: Sequence[StabilityPoint]) -> Table:
    def value(number: float | None, doubt: float | None, by: float = 1.0) -> str:
        return ABSENT if number is None else with_uncertainty(by * number, by * (doubt or 0.0))

    turn = degrees(1.0)
    rows = [
        [
            *_place(point),
            str(point.status),
            value(point.modulus, point.modulus_uncertainty),
            value(point.modulus_predicted, point.modulus_predicted_uncertainty),
            value(point.angle_rad, point.angle_uncertainty_rad, turn),
            plain(None if point.angle_predicted_rad is None else turn * point.angle_predicted_rad),
            str(point.released_cycles),
            plain(point.autocorrelation, 2),
        ]
        for point in points
    ]
    columns = [
        Column("Ω", "rad/s"),
        Column("A"),
        Column("status", words=True),
        Column("|μ|"),
        Column("|μ| predicted"),
        Column("angle", "°"),
        Column("angle predicted", "°"),
        Column("cycles"),
        Column("autocorrelation"),
    ]
    caption = "Multipliers of the orbits (k = 2); A is the amplitude relative to the uplift acceleration"
    return Table(caption, columns, rows)
