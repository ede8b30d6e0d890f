"""Sets a report on pages: headings stay with what follows, tables go on with their heads, figures find a page.

A figure that finds no room waits for the top of the next page, and the text of its section goes on in the meantime.
"""

from collections import deque
from collections.abc import Sequence
from typing import assert_never

from bench.report.page.document import Document, Listing, Notice, Numbers, Part, Picture, Table
from bench.report.page.sheet import INK, MARGIN, MEASURE, WIDTH, Line, Placed, Rule, Sheet
from bench.report.page.typeset import Font, grid_of
from bench.report.style import BLUE, PALE, VERMILLION

TITLE, HEADING, BODY, SMALL = Font(17, bold=True), Font(12.5, bold=True), Font(9.5), Font(8.5)
TABLE_SIZES = (8.5, 7.5, 6.5, 5.5)
"""Points: a table takes the largest at which it fits."""

AFTER = 0.08
"""Inches of air after a paragraph."""

ALONE = 1.2
"""Inches that a heading needs with the first of what follows."""

LOWEST = 0.75
"""A figure is made lower to share a page, down to this share of its height."""

FOOT = 0.1
"""Between a figure and its caption."""


def composed(document: Document) -> list[Sheet]:
    """The pages of a report."""
    return _Compositor().compose(document)


class _Compositor:
    def __init__(self) -> None:
        self._sheet = Sheet()
        self._sheets = [self._sheet]
        self._waiting: deque[tuple[Picture, str]] = deque()

    def compose(self, document: Document) -> list[Sheet]:
        numbers = Numbers()
        self._lines(document.title, TITLE)
        self._lines(document.made, SMALL, colour="#444444")
        self._parts(document.summary, numbers)
        for section in document.sections:
            self._heading(section.heading, section.parts)
            self._parts(section.parts, numbers)
        return [sheet for sheet in self._sheets if not sheet.empty]

    def _parts(self, parts: Sequence[Part], numbers: Numbers) -> None:
        for part, after in zip(parts, [*parts[1:], None], strict=False):
            name = numbers.next(part)
            match part:
                case str():
                    # what introduces a list does not stand alone at the foot of a page
                    lines = len(BODY.wrapped(part, MEASURE)) + 1
                    self._make_room(AFTER + lines * BODY.line if isinstance(after, Listing) else 0.0)
                    self._lines(part, BODY)
                case Notice():
                    self._notice(part)
                case Listing():
                    for item in part.items:
                        self._lines(f"•  {item}", BODY, indent=0.15)
                case Table():
                    self._table(part, name)
                case Picture():
                    self._waiting.append((part, name))
                    self._place_waiting()
                case _:
                    assert_never(part)
        while self._waiting:
            self._turn()

    def _heading(self, text: str, parts: Sequence[Part]) -> None:
        """A heading never stands alone at the foot of a page, nor without the figure that follows at once."""
        needs = ALONE
        for part in parts:
            if isinstance(part, Picture):
                needs += LOWEST * _size(part)[1]
            if not isinstance(part, str | Notice):
                break
            needs += BODY.line * len(BODY.wrapped(part if isinstance(part, str) else part.text, MEASURE))
        if not self._sheet.empty and self._sheet.left < needs:
            self._turn()
        sheet = self._sheet
        sheet.y -= 0.0 if sheet.empty else 0.16
        sheet.marks.append(Rule((MARGIN, WIDTH - MARGIN), (sheet.y, sheet.y), BLUE, 1.2))
        sheet.y -= 0.05
        self._lines(text, HEADING)

    def _lines(self, text: str, font: Font, *, indent: float = 0.0, colour: str = INK) -> None:
        for line in font.wrapped(text, MEASURE - indent):
            self._make_room(font.line)
            self._sheet.y -= font.line
            self._sheet.marks.append(Line(MARGIN + indent, self._sheet.y + 0.25 * font.line, line, font, colour))
        self._sheet.y -= AFTER

    def _notice(self, notice: Notice) -> None:
        self._make_room(BODY.line * len(BODY.wrapped(notice.text, MEASURE - 0.2)))
        top = self._sheet.y
        self._lines(notice.text, BODY, indent=0.15)
        bottom = min(self._sheet.y + AFTER, top)
        self._sheet.marks.append(Rule((MARGIN + 0.03, MARGIN + 0.03), (bottom, top), VERMILLION, 3.0))

    def _table(self, table: Table, name: str) -> None:
        grid = grid_of(table, MEASURE, TABLE_SIZES)
        line, head_font = grid.font.line, Font(grid.font.size, bold=True)
        depth = line * max(len(cell) for cell in grid.head)
        first = line * max((len(cell) for cell in grid.rows[0]), default=1) if grid.rows else 0.0
        caption = SMALL.wrapped(f"{name}. {table.caption}", MEASURE)
        self._make_room(len(caption) * SMALL.line + depth + first + 0.3)
        self._lines(f"{name}. {table.caption}", SMALL)
        self._row(table, grid.head, grid.widths, head_font, ("#333333", 1.0))
        for row in grid.rows:
            if self._make_room(line * max(len(cell) for cell in row) + 0.06):
                self._row(table, grid.head, grid.widths, head_font, ("#333333", 1.0))
            self._row(table, row, grid.widths, grid.font, (PALE, 0.5))
        self._sheet.y -= 2.0 * AFTER

    def _row(
        self, table: Table, cells: list[list[str]], widths: list[float], font: Font, rule: tuple[str, float]
    ) -> None:
        sheet, x = self._sheet, MARGIN
        for column, lines, width in zip(table.columns, cells, widths, strict=True):
            for k, text in enumerate(lines):
                y = sheet.y - (k + 0.85) * font.line
                right = not column.words
                sheet.marks.append(Line(x + width - 0.06 if right else x + 0.02, y, text, font, right=right))
            x += width
        sheet.y -= font.line * max(len(lines) for lines in cells) + 0.04
        sheet.marks.append(Rule((MARGIN, x), (sheet.y, sheet.y), *rule))

    def _place_waiting(self) -> None:
        """Every figure that waits and finds room on this page, in order; the first on an empty page always does."""
        while self._waiting:
            picture, name = self._waiting[0]
            text = f"{name}. {picture.caption}"
            caption = SMALL.line * len(SMALL.wrapped(text, MEASURE)) + AFTER + FOOT
            width, height = _size(picture)
            room = self._sheet.left - caption
            if room < LOWEST * height and not self._sheet.empty:
                return
            self._waiting.popleft()
            height = min(height, room)
            self._sheet.y -= height
            place = MARGIN + 0.5 * (MEASURE - width), self._sheet.y
            self._sheet.marks.append(Placed(picture.figure, *place, width, height))
            self._sheet.y -= FOOT
            self._lines(text, SMALL)

    def _make_room(self, height: float) -> bool:
        """Turn the page unless so much is free, or nothing is on it yet; says whether it was turned."""
        turned = False
        while self._sheet.left < height and not self._sheet.empty:
            self._turn()
            turned = True
        return turned

    def _turn(self) -> None:
        """Go on with a new page, whose top belongs to the figures that wait."""
        self._sheet = Sheet()
        self._sheets.append(self._sheet)
        self._place_waiting()


def _size(picture: Picture) -> tuple[float, float]:
    """Width and height on paper: a figure that is too wide gets lower as well, by the root of what it gets narrower."""
    width, height = (float(side) for side in picture.figure.get_size_inches())
    narrower = min(1.0, MEASURE / width)
    return narrower * width, height * narrower**0.5
