# pyright: reportUnknownMemberType=false
"""Results as a text table, and as a figure: decay, residual, spectrum, uncertainties and damping against amplitude."""

from collections.abc import Sequence
from math import tau
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.analysis.free_decay.response import OMEGA1, XI1
from bench.analysis.gain import COVERAGE
from bench.analysis.uncertainty import plus_minus
from bench.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    new_figure,
    set_grid,
    ticks_1_2_5,
)
from bench.figures.text_table import TextColumn, text_table
from protocols.common.decays.frame import FrameResult
from protocols.common.decays.parameters import DecayPoint

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS = (
    TextColumn("decay", words=True),
    TextColumn("k1", "N/m"),
    TextColumn("k2", "N/m"),
    TextColumn("xi1", "%"),
    TextColumn("xi2", "%"),
    TextColumn("f1", "Hz"),
    TextColumn("f2", "Hz"),
    TextColumn("drift", "mm"),
    TextColumn("residual", "um"),
    TextColumn("slope of xi1", "%/mm"),
)

PARTS = {
    "noise": BLUE,
    "table": GREEN,
    "clock": ORANGE,
    "linearity": PURPLE,
    "masses": GREY,
    "timebase": SKY,
    "scatter": VERMILLION,
}
QUANTITIES = ("$k_1$", "$k_2$", r"$\xi_1$", r"$\xi_2$")


def decays_table(points: Sequence[DecayPoint], result: FrameResult | None) -> str:
    """Text table with a row for each decay and one for all decays, with expanded uncertainties (k = 2), followed by the
    largest contributions and a statement on the damping.
    """
    if not points:
        return "Nothing was identified."
    table = text_table(_COLUMNS, map(_cells, points))
    return "\n".join([table, *(_notes(points[-1], result) if result is not None else ())])


def decay_figure(result: FrameResult | None, title: str) -> "Figure":
    """Figure of six panels, empty without a result."""
    figure = new_figure(9.0, 10.5)
    grid = figure.add_gridspec(4, 2, height_ratios=(3, 2, 2.6, 2.6))
    decay, rest = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, :])
    spectrum, budget = figure.add_subplot(grid[2, 0]), figure.add_subplot(grid[2, 1])
    damping = [figure.add_subplot(grid[3, column]) for column in range(2)]
    for panel in (decay, rest, spectrum, budget, *damping):
        set_grid(panel)
    decay.set_title(title if result is not None else "nothing was identified", loc="left", fontsize=10)
    if result is None:
        return figure
    _draw_decay(decay, rest, result)
    _draw_spectrum(spectrum, result)
    _draw_budget(budget, result)
    for mode, panel in enumerate(damping):
        _draw_damping(panel, result, mode)
    return figure


def _cells(point: DecayPoint) -> tuple[str, ...]:
    return (
        str(point.decay) if point.decay else "all",
        plus_minus(point.k1_n_m, point.k1_uncertainty),
        plus_minus(point.k2_n_m, point.k2_uncertainty),
        plus_minus(100.0 * point.xi1, 100.0 * point.xi1_uncertainty),
        plus_minus(100.0 * point.xi2, 100.0 * point.xi2_uncertainty),
        plus_minus(point.omega1_rad_s / tau, point.omega1_uncertainty / tau),
        plus_minus(point.omega2_rad_s / tau, point.omega2_uncertainty / tau),
        f"{1e3 * point.drift_peak_m:.1f}",
        f"{1e6 * point.residual_m:.1f}",
        plus_minus(0.1 * point.slope1_per_m, 0.1 * point.slope1_uncertainty),
    )


def _notes(point: DecayPoint, result: FrameResult) -> list[str]:
    damping = (
        "The damping does not depend significantly on the amplitude."
        if point.damping_is_linear
        else "The damping depends on the amplitude: see the figure. The stated ratios are means over the decays."
    )
    # the largest contribution to each quantity of the combined result
    largest = {
        name: max(result.parts, key=lambda part: float(result.parts[part][index]))
        for index, name in enumerate(("k1", "k2", "xi1", "xi2"))
    }
    most = ", ".join(f"{name}: {part}" for name, part in largest.items())
    birge = "" if point.birge is None else f" Birge ratio at most {point.birge:.2f}."
    return ["", f"+- is the expanded uncertainty, k = 2. Largest contributions: {most}.{birge}", damping]


def _draw_decay(decay: "Axes", rest: "Axes", result: FrameResult) -> None:
    fit = result.decays[0].fit
    time = fit.stretch.time
    drift = 1e3 * (fit.stretch.readings[1] - fit.stretch.readings[0])
    decay.plot(time, drift, color=BLUE, linewidth=0.9, label="measured (first decay)")
    decay.plot(time, 1e3 * (fit.fitted[1] - fit.fitted[0]), "--", color=VERMILLION, linewidth=0.9, label="fitted")
    decay.axvline(result.decays[0].begin, color=GREY, linewidth=0.8)
    decay.set_ylabel("drift [mm]")
    decay.legend(loc="upper right", fontsize=8)
    for row, colour in enumerate((BLUE, GREEN)):
        rest.plot(time, 1e6 * fit.residual[row], color=colour, linewidth=0.5, label=f"laser {row + 1}")
    rest.set_ylabel("measured − fitted\n[µm]")
    rest.set_xlabel("time [s]")
    rest.legend(loc="upper right", fontsize=8, ncols=2)


def _draw_spectrum(panel: "Axes", result: FrameResult) -> None:
    from scipy import signal

    welch: Any = signal.welch
    # decays after a release by hand differ in length, the averaged spectra must not
    segment = min(2048, *(one.fit.residual.shape[1] for one in result.decays))
    for row, colour in enumerate((BLUE, GREEN)):
        powers: list[np.ndarray] = []
        frequency = np.zeros(0)
        for one in result.decays:
            rate = 1.0 / one.fit.stretch.step
            left = one.fit.residual[row]
            frequency, power = welch(left, rate, nperseg=segment)
            powers.append(power)
        panel.loglog(
            frequency[1:],
            1e6 * np.sqrt(np.mean(powers, axis=0)[1:]),
            color=colour,
            linewidth=0.8,
            label=f"laser {row + 1}",
        )
    for mode, omega in enumerate(result.frame.values[OMEGA1:]):
        name = "modes" if mode == 0 else None
        panel.axvline(omega / (2.0 * np.pi), color=BLACK, linewidth=0.7, linestyle=":", label=name)
    ticks_1_2_5(panel.yaxis)
    panel.legend(loc="lower left", fontsize=7)
    panel.set_xlabel("frequency [Hz]")
    panel.set_ylabel("residual [µm/√Hz]")


def _draw_budget(panel: "Axes", result: FrameResult) -> None:
    """Draw the relative standard uncertainties, by contribution and in total."""
    width = 0.8 / (len(result.parts) + 1)
    positions = np.arange(len(QUANTITIES))
    relative = np.abs(result.frame.values[: len(QUANTITIES)])
    bars = {**{name: result.parts[name] for name in result.parts}, "together": result.uncertainty}
    for number, (name, uncertainties) in enumerate(bars.items()):
        share = 100.0 * uncertainties[: len(QUANTITIES)] / relative
        panel.bar(positions + number * width, share, width, color=PARTS.get(name, BLACK), label=name)
    panel.set_xticks(positions + 0.4 - 0.5 * width, QUANTITIES)
    panel.set_ylabel("standard uncertainty [%]")
    panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=7, ncols=4, frameon=False)


def _draw_damping(panel: "Axes", result: FrameResult, mode: int) -> None:
    for one in result.decays:
        course = one.courses[mode]
        panel.errorbar(
            1e3 * course.amplitude,
            100.0 * course.damping,
            100.0 * COVERAGE * course.uncertainty,
            fmt="o",
            ms=3,
            color=BLUE,
            lw=0.8,
        )
    value = 100.0 * result.frame.values[XI1 + mode]
    slope, uncertainty = (0.1 * values[mode] for values in (result.slopes.values, result.slope_uncertainty))
    panel.axhline(value, color=VERMILLION, linewidth=0.9)
    panel.set_xlabel(f"drift in mode {mode + 1} [mm]")
    panel.set_ylabel(rf"$\xi_{mode + 1}$ [%]")
    verdict = "significant" if result.nonlinear[mode] else "not significant"
    text = plus_minus(slope, COVERAGE * uncertainty, sign="±")
    panel.set_title(f"slope {text} %/mm (k = 2), {verdict} (99 %)", loc="left", fontsize=8)
