# pyright: reportUnknownMemberType=false
"""Lines of text on a page: how wide they are, where they break, how wide the columns of a table are.

matplotlib's keyword arguments have no types, hence the first line. Lengths are inches unless named otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING

from bench.report.page.document import Table

if TYPE_CHECKING:
    from matplotlib.font_manager import FontProperties

POINT = 1.0 / 72.0
LEADING = 1.32
"""Distance of lines over the size of the letters."""

GAP = 0.13
"""Between the columns of a table."""

ROUNDING = 1e-6
"""What the sums of widths may be off."""

NARROWEST, LONGEST_WORD = 0.75, 1.7
"""A column of words is not made narrower than this while others can be, nor than its longest word up to that."""


@dataclass(frozen=True)
class Font:
    """Size in points, and whether the letters are bold."""

    size: float
    bold: bool = False

    @property
    def line(self) -> float:
        """From one line to the next."""
        return LEADING * self.size * POINT

    def width(self, text: str) -> float:
        """Width of a line, word by word: words come again, and a space takes no part in kerning."""
        words = text.split(" ")
        return sum(_width(word, self) for word in words) + (len(words) - 1) * _width(" ", self)

    def wrapped(self, text: str, width: float) -> list[str]:
        """The lines of a paragraph; a word that is too long for a line is cut."""
        lines: list[str] = []
        line = ""
        for word in text.split():
            longer = f"{line} {word}" if line else word
            if self.width(longer) <= width + ROUNDING:
                line = longer
                continue
            if line:
                lines.append(line)
            line = word
            while self.width(line) > width + ROUNDING:
                fits = max(1, int(len(line) * width / self.width(line)))
                while fits > 1 and self.width(line[:fits]) > width:
                    fits -= 1
                lines.append(line[:fits])
                line = line[fits:]
        return [*lines, line]


@lru_cache(maxsize=8192)
def _width(word: str, font: Font) -> float:
    from matplotlib.textpath import text_to_path

    properties = _properties(font.size, font.bold)
    width, _, _ = text_to_path.get_text_width_height_descent(word, properties, ismath=False)
    return float(width) * POINT


@cache
def _properties(size: float, bold: bool) -> "FontProperties":
    from matplotlib.font_manager import FontProperties

    return FontProperties(family="DejaVu Sans", size=size, weight="bold" if bold else "normal")


@dataclass(frozen=True)
class Grid:
    """A table set to a width: `widths` of the columns, `head` and `rows` as cells, each a list of lines."""

    font: Font
    widths: list[float]
    head: list[list[str]]
    rows: list[list[list[str]]]


def grid_of(table: Table, width: float, sizes: Sequence[float]) -> Grid:
    """The table in the largest of `sizes` (points, descending) at which its columns fit, words broken into lines."""
    font, widths = Font(sizes[-1]), _widths(table, Font(sizes[-1]), width)
    for size in sizes[:-1]:
        larger = _widths(table, Font(size), width)
        if sum(larger) <= width + ROUNDING:
            font, widths = Font(size), larger
            break
    head = [
        Font(font.size, bold=True).wrapped(column.heading, each - GAP)
        for column, each in zip(table.columns, widths, strict=True)
    ]
    rows = [[font.wrapped(cell, each - GAP) for cell, each in zip(row, widths, strict=True)] for row in table.rows]
    return Grid(font, widths, head, rows)


def _widths(table: Table, font: Font, width: float) -> list[float]:
    """Numbers keep their line; headings and words are broken where room is short."""
    bold = Font(font.size, bold=True)
    least: list[float] = []
    natural: list[float] = []
    for k, column in enumerate(table.columns):
        cells = [font.width(row[k]) for row in table.rows]
        heading = max(bold.width(word) for word in column.heading.split())
        whole = max([heading, min(bold.width(column.heading), 1.1), *cells]) + GAP
        natural.append(whole)
        if not column.words:
            least.append(max([heading, *cells]) + GAP)
            continue
        longest = max((font.width(word) for row in table.rows for word in row[k].split()), default=0.0)
        least.append(min(whole, max(heading, NARROWEST, min(longest, LONGEST_WORD)) + GAP))
    spare = width - sum(least)
    wanted = sum(natural) - sum(least)
    share = 1.0 if wanted <= 0.0 else min(1.0, max(0.0, spare / wanted))
    return [low + share * (high - low) for low, high in zip(least, natural, strict=True)]
