"""A page of a report as it is printed: lines of text, rules and figures, each at its place on A4 paper.

Lengths are inches from the lower left corner of the paper.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from bench.report.page.typeset import Font

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 8.27, 11.69
MARGIN, BOTTOM = 0.75, 0.8
"""Margins left, right and above, and below."""

MEASURE = WIDTH - 2.0 * MARGIN
"""Width that text, tables and figures have."""

INK = "#111111"


@dataclass(frozen=True)
class Line:
    """A line of text whose baseline begins at (x, y), or ends there where it is set to the right."""

    x: float
    y: float
    text: str
    font: Font
    colour: str = INK
    right: bool = False


@dataclass(frozen=True)
class Rule:
    """A straight line through two points, `width` points thick."""

    x: tuple[float, float]
    y: tuple[float, float]
    colour: str
    width: float


@dataclass(frozen=True, eq=False)
class Placed:
    """A figure whose lower left corner is at (x, y), drawn anew at `width` by `height`: its letters keep their size."""

    figure: "Figure"
    x: float
    y: float
    width: float
    height: float


@dataclass
class Sheet:
    """A page that is filled from the top down; what is set next comes below `y`."""

    y: float = HEIGHT - MARGIN
    marks: list[Line | Rule | Placed] = field(default_factory=list[Line | Rule | Placed])

    @property
    def left(self) -> float:
        """Height that is still free."""
        return self.y - BOTTOM

    @property
    def empty(self) -> bool:
        """Whether nothing has been set yet."""
        return not self.marks
