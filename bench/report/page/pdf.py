# pyright: reportUnknownMemberType=false
"""A report as PDF: A4 pages of text, tables and vector figures, composed with matplotlib alone.

A page is at most one figure: the text of the page is drawn onto the figure's own canvas, which is then saved with the
whole page around it. matplotlib's keyword arguments have no types, hence the first line.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, assert_never

from bench.report.page.document import Document, Listing, Notice, Numbers, Part, Picture, Table
from bench.report.page.typeset import Font, grid_of
from bench.report.style import BLUE, GREY, PALE, VERMILLION, new_figure

if TYPE_CHECKING:
    from matplotlib.backends.backend_pdf import PdfPages
    from matplotlib.figure import Figure

LONG, SHORT = 11.69, 8.27
MARGIN, BOTTOM = 0.75, 0.8
"""Inches: the sides of A4; margins left, right and above, and below."""

TITLE, HEADING, BODY, SMALL = Font(17, bold=True), Font(12.5, bold=True), Font(9.5), Font(8.5)
TABLE_SIZES = (8.5, 7.5, 6.5, 5.5)
"""Points: a table takes the largest at which it fits."""

AFTER = 0.08
"""Inches of air after a paragraph."""

ALONE = 1.2
"""Inches that a heading needs with the first of what follows."""

LITTLE = 1.5
"""Inches of text that go along to the next page with a figure that did not fit below them."""

SMALLEST = 0.85
"""A figure that must be smaller than this, compared with what it could be, to share a page gets a new one."""


@dataclass(frozen=True)
class _Text:
    x: float
    y: float
    text: str
    font: Font
    colour: str = "#111111"
    right: bool = False


@dataclass(frozen=True)
class _Rule:
    x: tuple[float, float]
    y: tuple[float, float]
    colour: str
    width: float


@dataclass
class _Sheet:
    """A page that is being filled: from the top down, `left` inches of height still free above the bottom margin."""

    width: float = SHORT
    height: float = LONG
    marks: list[_Text | _Rule] = field(default_factory=list[_Text | _Rule])
    y: float = LONG - MARGIN

    @property
    def left(self) -> float:
        return self.y - BOTTOM

    @property
    def measure(self) -> float:
        return self.width - 2.0 * MARGIN

    @property
    def empty(self) -> bool:
        return not self.marks


def write_pdf(path: Path, document: Document) -> None:
    """Write the pages to `path`, over whatever is there. Draws every figure, which keeps its size."""
    import matplotlib
    from matplotlib.backends.backend_pdf import PdfPages

    about = {"Title": document.title, "Creator": "rockbench", "CreationDate": datetime.now().astimezone()}
    # fonts whole enough for text to be found and copied
    with matplotlib.rc_context({"pdf.fonttype": 42}), PdfPages(path, metadata=about) as pages:
        _Press(pages, document).print()


class _Press:
    """Sets a document, sheet by sheet."""

    def __init__(self, pages: "PdfPages", document: Document) -> None:
        self._pages, self._document = pages, document
        self._sheet, self._printed = _Sheet(), 0

    def print(self) -> None:
        document, numbers = self._document, Numbers()
        self._lines(document.title, TITLE)
        self._lines(document.made, SMALL, colour="#444444")
        self._parts(document.summary, numbers)
        for section in document.sections:
            self._heading(section.heading, section.parts)
            self._parts(section.parts, numbers)
        if not self._sheet.empty:
            self._turn()

    def _parts(self, parts: Sequence[Part], numbers: Numbers) -> None:
        for part in parts:
            name = numbers.next(part)
            match part:
                case str():
                    self._lines(part, BODY)
                case Notice():
                    self._notice(part)
                case Listing():
                    for item in part.items:
                        self._lines(f"•  {item}", BODY, indent=0.15)
                case Table():
                    self._table(part, name)
                case Picture():
                    self._picture(part, name)
                case _:
                    assert_never(part)

    def _heading(self, text: str, parts: Sequence[Part]) -> None:
        """A heading never stands alone at the foot of a page, nor without the figure that follows at once."""
        needs = ALONE
        for part in parts:
            if isinstance(part, Picture):
                needs += min(SMALLEST * float(part.figure.get_size_inches()[1]), LONG - MARGIN - BOTTOM - needs)
            if not isinstance(part, str | Notice):
                break
            needs += BODY.line * len(BODY.wrapped(part if isinstance(part, str) else part.text, self._sheet.measure))
        if not self._sheet.empty and self._sheet.left < needs:
            self._turn()
        sheet = self._sheet
        sheet.y -= 0.0 if sheet.empty else 0.16
        sheet.marks.append(_Rule((MARGIN, sheet.width - MARGIN), (sheet.y, sheet.y), BLUE, 1.2))
        sheet.y -= 0.05
        self._lines(text, HEADING)

    def _lines(self, text: str, font: Font, *, indent: float = 0.0, colour: str = "#111111") -> None:
        for line in font.wrapped(text, self._sheet.measure - indent):
            if self._sheet.left < font.line:
                self._turn()
            self._sheet.y -= font.line
            self._sheet.marks.append(_Text(MARGIN + indent, self._sheet.y + 0.25 * font.line, line, font, colour))
        self._sheet.y -= AFTER

    def _notice(self, notice: Notice) -> None:
        lines = BODY.wrapped(notice.text, self._sheet.measure - 0.2)
        if self._sheet.left < BODY.line * len(lines):
            self._turn()
        top = self._sheet.y
        self._lines(notice.text, BODY, indent=0.15)
        bottom = min(self._sheet.y + AFTER, top)
        self._sheet.marks.append(_Rule((MARGIN + 0.03, MARGIN + 0.03), (bottom, top), VERMILLION, 3.0))

    def _table(self, table: Table, name: str) -> None:
        grid = grid_of(table, self._sheet.measure, TABLE_SIZES)
        line = grid.font.line
        depth = line * max(len(cell) for cell in grid.head)
        first = line * max((len(cell) for cell in grid.rows[0]), default=1) if grid.rows else 0.0
        caption = SMALL.wrapped(f"{name}. {table.caption}", self._sheet.measure)
        if not self._sheet.empty and self._sheet.left < len(caption) * SMALL.line + depth + first + 0.3:
            self._turn()
        self._lines(f"{name}. {table.caption}", SMALL)
        self._row(table, grid.head, grid.widths, Font(grid.font.size, bold=True), ("#333333", 1.0))
        for row in grid.rows:
            if self._sheet.left < line * max(len(cell) for cell in row) + 0.05:
                self._turn()
                self._row(table, grid.head, grid.widths, Font(grid.font.size, bold=True), ("#333333", 1.0))
            self._row(table, row, grid.widths, grid.font, (PALE, 0.5))
        self._sheet.y -= 2.0 * AFTER

    def _row(
        self, table: Table, cells: list[list[str]], widths: list[float], font: Font, rule: tuple[str, float]
    ) -> None:
        sheet, x = self._sheet, MARGIN
        for column, lines, width in zip(table.columns, cells, widths, strict=True):
            for k, text in enumerate(lines):
                y = sheet.y - (k + 0.78) * font.line
                right = not column.words
                sheet.marks.append(_Text(x + width - 0.06 if right else x + 0.02, y, text, font, right=right))
            x += width
        sheet.y -= font.line * max(len(lines) for lines in cells) + 0.03
        sheet.marks.append(_Rule((MARGIN, x), (sheet.y, sheet.y), *rule))

    def _picture(self, picture: Picture, name: str) -> None:
        """On this page where there is room, else on one of its own, upright or across, whichever shows it larger."""
        figure = picture.figure
        width, height = (float(side) for side in figure.get_size_inches())
        text = f"{name}. {picture.caption}"

        def share(sheet: _Sheet) -> float:
            room = sheet.left - SMALL.line * len(SMALL.wrapped(text, sheet.measure)) - 0.15
            return min(1.0, sheet.measure / width, room / height)

        upright, across = _Sheet(), _Sheet(LONG, SHORT, y=SHORT - MARGIN)
        best = max((upright, across), key=share)
        if share(self._sheet) < SMALLEST * share(best):
            self._change_to(best)
        scale = share(self._sheet)
        figure.set_size_inches(scale * width, scale * height)
        left = 0.5 * (self._sheet.width - scale * width)
        self._sheet.y -= scale * height
        place = (left, self._sheet.y)
        self._sheet.y -= 0.1
        self._lines(text, SMALL)
        self._turn(figure, place)
        figure.set_size_inches(width, height)

    def _change_to(self, sheet: _Sheet) -> None:
        """Go on with a new sheet; what hardly fills the old one comes along."""
        old = self._sheet
        used = old.height - MARGIN - old.y
        if used > LITTLE:
            self._turn()
        else:
            down = sheet.height - old.height
            moved = (
                replace(mark, y=(mark.y[0] + down, mark.y[1] + down))
                if isinstance(mark, _Rule)
                else replace(mark, y=mark.y + down)
                for mark in old.marks
            )
            sheet.marks.extend(moved)
            sheet.y -= used
        self._sheet = sheet

    def _turn(self, figure: "Figure | None" = None, place: tuple[float, float] = (0.0, 0.0)) -> None:
        """Print the sheet, with a figure whose lower left corner is at `place`, and take a new one."""
        from matplotlib.lines import Line2D
        from matplotlib.transforms import Bbox

        sheet = self._sheet
        self._printed += 1
        foot = _Text(MARGIN, 0.45, self._document.title, SMALL, GREY)
        page = _Text(sheet.width - MARGIN, 0.45, str(self._printed), SMALL, GREY, right=True)
        host: Any = figure
        if host is None:
            host = new_figure(sheet.width, sheet.height)
            host.set_layout_engine("none")
        width, height = (float(side) for side in host.get_size_inches())
        engine = host.get_layout_engine()
        if engine is not None:
            host.draw_without_rendering()
            host.set_layout_engine("none")
        # a box larger than the figure moves what is placed in shares of it and nothing else; legends are not, by nature
        for legend in host.legends:
            legend.set_bbox_to_anchor((0.0, 0.0, 1.0, 1.0), transform=host.transFigure)

        def at(x: float, y: float) -> tuple[float, float]:
            return (x - place[0]) / width, (y - place[1]) / height

        drawn: list[Any] = []
        for mark in (*sheet.marks, foot, page):
            if isinstance(mark, _Rule):
                ends = [at(*end) for end in zip(mark.x, mark.y, strict=True)]
                style: Any = {"color": mark.colour, "linewidth": mark.width, "transform": host.transFigure}
                drawn.append(host.add_artist(Line2D(*zip(*ends, strict=True), **style)))
                continue
            drawn.append(
                host.text(
                    *at(mark.x, mark.y),
                    mark.text,
                    fontsize=mark.font.size,
                    fontweight="bold" if mark.font.bold else "normal",
                    color=mark.colour,
                    ha="right" if mark.right else "left",
                    parse_math=False,
                )
            )
        whole = Bbox.from_bounds(-place[0], -place[1], sheet.width, sheet.height)
        self._pages.savefig(host, bbox_inches=whole)
        for artist in drawn:
            artist.remove()
        for legend in host.legends:
            legend.set_bbox_to_anchor(None)
        host.set_layout_engine(engine)
        self._sheet = _Sheet()
