# pyright: reportUnknownMemberType=false
"""Style of all figures: colours, grid, axes and legend; creation and saving of figures.

matplotlib is imported on first use, and never through pyplot, which has global state and opens windows. The keyword
arguments of matplotlib are untyped, hence the pyright comment in the first line of every figure module.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bench.unfinished import write_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

DPI = 200

# Okabe and Ito (2008): colours that colour-blind readers can distinguish; markers and dashes distinguish them in
# greyscale print
BLACK, BLUE, VERMILLION, GREEN, PURPLE, GREY = "#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#666666"
ORANGE, SKY, PALE = "#E69F00", "#56B4E9", "#DDDDDD"

SERIES = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
MARKERS = "osD^v<>"
"""Colours and markers of the curves of a panel, in order."""

HEADROOM = 1.12
"""Ratio of the axis limit to the largest drawn value."""

MILLI = 1e3
"""Factor from m to mm and from rad to mrad, the drawn units."""


def new_figure(width: float, height: float) -> "Figure":
    """An empty figure of `width` by `height` inches, without a window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from bench.figures.saved_figure import SavedFigure

    figure = SavedFigure(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def write_figure(path: Path, figure: "Figure") -> None:
    """Saves a figure in the format given by the suffix of `path`: PNG at 200 dpi, PDF or SVG.

    Raises InvalidInput if `path` exists and RockbenchError if it cannot be written.
    """
    write_new(
        path, lambda unfinished: figure.savefig(unfinished, dpi=DPI, format=path.suffix.lower().removeprefix("."))
    )


def set_grid(panel: "Axes") -> None:
    """Draws a light grid behind the curves."""
    panel.grid(which="major", color=PALE, linewidth=0.6)
    panel.set_axisbelow(True)


def centre(panel: "Axes", *curves: NDArray[np.float64]) -> None:
    """Centre the vertical axis at zero, with a margin beyond the largest magnitude of the curves."""
    finite = np.concatenate([curve[np.isfinite(curve)] for curve in curves])
    reach = HEADROOM * float(np.abs(finite).max(initial=0.0)) or 1.0
    panel.set_ylim(-reach, reach)


def add_legend(figure: "Figure", panels: "Iterable[Axes]", columns: int, **options: Any) -> None:
    """Draws one legend below all panels, with each label once, in the order of the panels."""
    entries: dict[str, Any] = {}
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    options = {"loc": "outside lower center", "fontsize": 8, "frameon": False, **options}
    figure.legend(list(entries.values()), list(entries), ncols=columns, **options)


def ticks_1_2_5(axis: "Axis") -> None:
    """Sets ticks of a logarithmic axis at 1, 2, 5, 10 ..., labelled with plain numbers, and unlabelled minor ticks."""
    from matplotlib.ticker import FixedLocator, NullFormatter, StrMethodFormatter

    decades = [10.0**power for power in range(-3, 4)]

    def places(digits: Iterable[int]) -> FixedLocator:
        return FixedLocator([digit * decade for decade in decades for digit in digits])

    axis.set_major_locator(places((1, 2, 5)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_locator(places((3, 4, 6, 7, 8, 9)))
    axis.set_minor_formatter(NullFormatter())
