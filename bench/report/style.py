# pyright: reportUnknownMemberType=false
"""What all figures share: colours, sizes, grid, and how a figure is made and saved.

matplotlib is imported when a figure is drawn, and never through pyplot: no window, no global state. Its keyword
arguments have no types, hence the first line.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from bench.report.files import write_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

DPI = 200

# Okabe and Ito (2008): told apart by the colour blind; shapes and dashes say the same again for print in grey
BLACK, BLUE, VERMILLION, GREEN, PURPLE, GREY = "#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#666666"
ORANGE, SKY, PALE = "#E69F00", "#56B4E9", "#DDDDDD"


def new_figure(width: float, height: float) -> "Figure":
    """An empty figure of so many inches that belongs to no window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def write_figure(path: Path, figure: "Figure") -> None:
    """Save in the format that the suffix names: PNG at 200 dpi, PDF or SVG.

    Raises InvalidInput when `path` exists, RockbenchError when the disk fails.
    """
    write_new(
        path, lambda unfinished: figure.savefig(unfinished, dpi=DPI, format=path.suffix.lower().removeprefix("."))
    )


def set_grid(panel: "Axes") -> None:
    """A pale grid behind everything else."""
    panel.grid(which="major", color=PALE, linewidth=0.6)
    panel.set_axisbelow(True)


def ticks_1_2_5(axis: "Axis") -> None:
    """Ticks of a logarithmic axis at 1, 2, 5 and so on, as plain numbers, with unlabelled ones between."""
    from matplotlib.ticker import FixedLocator, NullFormatter, StrMethodFormatter

    decades = [10.0**power for power in range(-3, 4)]

    def places(digits: Iterable[int]) -> FixedLocator:
        return FixedLocator([digit * decade for decade in decades for digit in digits])

    axis.set_major_locator(places((1, 2, 5)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_locator(places((3, 4, 6, 7, 8, 9)))
    axis.set_minor_formatter(NullFormatter())
