# pyright: reportUnknownMemberType=false
"""The work-precision figure: run time against error of every method, both logarithmic.

matplotlib's keyword arguments have no types, hence the first line.
"""

from typing import TYPE_CHECKING, Any

from bench.benchmark.section import Section
from bench.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLES: dict[str, tuple[str, str, Any]] = {
    "taylor": (BLUE, "o", "-"),
    "taylor, no peaks": (BLUE, "P", "-"),
    "heyoka": (VERMILLION, "s", "-"),
    "heyoka, with peaks": (VERMILLION, "D", "-"),
    "paper": (BLACK, "X", "-"),
    "rk4-located": (GREY, "v", (0, (4, 1.5))),
    "CVODE Adams": (PURPLE, "^", (0, (1, 1))),
    "scipy DOP853": (GREEN, "o", (0, (6, 1.5))),
    "scipy DOP853, Python": (GREEN, "P", "none"),
    "scipy RK45": (GREEN, "s", (0, (2, 2))),
    "scipy LSODA": (ORANGE, "^", (0, (1, 1))),
    "scipy Radau": (SKY, "v", (0, (4, 1.5))),
}
"""Colour, marker and dashes of a method; one more has grey points."""


def work_precision_figure(section: Section) -> "Figure":
    """Shortest run time over the error of the end state, one line per method; methods that went wrong are left out."""
    figure = new_figure(7.6, 5.2)
    panel = figure.add_subplot(1, 1, 1)
    good = [row for row in section.rows if row["status"] == "ok"]
    for name in dict.fromkeys(str(row["method"]) for row in good):
        places = sorted(
            (float(row["error"] or 0.0), float(row["min_ms"] or 0.0)) for row in good if row["method"] == name
        )
        colour, marker, dashes = STYLES.get(name, (GREY, ".", "none"))
        panel.plot(
            [error for error, _ in places],
            [elapsed for _, elapsed in places],
            color=colour,
            marker=marker,
            linestyle=dashes,
            linewidth=1.6 if name == "taylor" else 1.1,
            markersize=6.5,
            markeredgecolor="white",
            markeredgewidth=0.6,
            zorder=4 if name == "taylor" else 3,
            label=name,
        )
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xlabel("error of the end state, largest component  [SI units]")
    panel.set_ylabel("shortest run time  [ms]")
    panel.set_title(r"120 s of steady rocking, 649 impacts ($\Omega$ = 17 rad/s, $\beta$ = 0.64)", fontsize=10)
    set_grid(panel)
    figure.legend(loc="outside right upper", fontsize=8, frameon=False, title="method", title_fontsize=8)
    return figure
