# pyright: reportUnknownMemberType=false
"""Where the lines of a check lie between their limits.

matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from bench.analysis.check_line import CheckLine, Verdict
from bench.report.style import BLUE, GREY, VERMILLION, new_figure, set_grid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_OUTSIDE = 1.5
"""Where a line that is far beyond its limits is drawn."""


def margins(lines: Sequence[CheckLine]) -> "Figure":
    """Each judged line from its lowest (-1) to its highest allowed value (+1)."""
    judged = [(line, place) for line in lines if (place := _place(line)) is not None]
    figure = new_figure(8.0, 1.2 + 0.24 * len(judged))
    panel = figure.subplots()
    panel.axvspan(-1.0, 1.0, color=BLUE, alpha=0.08, linewidth=0.0)
    for row, (line, place) in enumerate(judged):
        passed = line.verdict is Verdict.PASSED
        panel.plot(place, row, "o" if passed else "X", color=BLUE if passed else VERMILLION, markersize=6)
    labels = [f"{line.subject}: {line.what}" for line, _ in judged]
    panel.set_yticks(range(len(judged)), labels, fontsize=7)
    panel.set_xlim(-1.1 * _OUTSIDE, 1.1 * _OUTSIDE)
    panel.set_xticks([-1.0, 0.0, 1.0], ["lowest", "middle", "highest"])
    panel.set_xlabel("place within what is allowed; circles passed, crosses failed", color=GREY)
    panel.invert_yaxis()
    set_grid(panel)
    return figure


def _place(line: CheckLine) -> float | None:
    """The measured value on a scale from -1 to 1 between its limits, cut beyond; None where it is not judged."""
    if line.measured is None or line.lowest is None or line.highest is None:
        return None
    middle, half = 0.5 * (line.lowest + line.highest), 0.5 * (line.highest - line.lowest)
    if half == 0.0:
        return 0.0 if line.measured == middle else _OUTSIDE
    return min(max((line.measured - middle) / half, -_OUTSIDE), _OUTSIDE)
