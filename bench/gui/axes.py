# pyright: reportUnknownMemberType=false
"""The axes of every plot: their colours, and units as they are, never rescaled."""

from math import floor, log10
from typing import Any

from bench.gui.palette import Theme


def colour_axes(plot: Any, theme: Theme) -> None:
    """Give the axes of a pyqtgraph plot item the colours of `theme`."""
    for side in ("left", "bottom"):
        axis = plot.getAxis(side)
        axis.setPen(theme.faint)
        axis.setTextPen(theme.text)
        axis.enableAutoSIPrefix(False)


def round_down(value: float) -> float:
    """The largest number that is short to read, such as 0.3 or 15, that is not above `value`, which is positive."""
    decade = 10.0 ** floor(log10(value))
    digits = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
    return max(digit * decade for digit in digits if digit * decade <= value * (1.0 + 1e-9))
