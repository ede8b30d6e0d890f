# pyright: reportUnknownMemberType=false
"""A report as PDF: A4 pages of text, tables and vector figures, printed with matplotlib alone.

`PdfPages` prints one figure to a page; the file below it takes several, each moved to its place by the transformation
that PDF itself has. matplotlib's keyword arguments have no types, hence the first line.
"""

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.report.page.compositor import SMALL, composed
from bench.report.page.document import Document
from bench.report.page.sheet import HEIGHT, MARGIN, WIDTH, Line, Placed, Rule, Sheet
from bench.report.style import GREY, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOOT = 0.45
"""Height of the line at the foot of each page [in]."""

INCH = 72
"""Points, the unit of a PDF file."""


def write_pdf(path: Path, document: Document) -> None:
    """Write the pages to `path`, over whatever is there. Draws every figure, which keeps its size."""
    import matplotlib
    from matplotlib.backends.backend_pdf import PdfFile

    about = {"Title": document.title, "Creator": "rockbench", "CreationDate": datetime.now().astimezone()}
    sheets = composed(document)
    # fonts whole enough for text to be found and copied
    with matplotlib.rc_context({"pdf.fonttype": 42}):
        file: Any = PdfFile(path, metadata=about)
        try:
            for number, sheet in enumerate(sheets, 1):
                file.newPage(WIDTH, HEIGHT)
                foot = Line(MARGIN, FOOT, document.title, SMALL, GREY)
                page = Line(WIDTH - MARGIN, FOOT, f"{number} of {len(sheets)}", SMALL, GREY, right=True)
                _draw(file, _lettering(sheet, foot, page), 0.0, 0.0)
                for mark in sheet.marks:
                    if isinstance(mark, Placed):
                        _draw_placed(file, mark)
            file.finalize()
        finally:
            file.close()


def _lettering(sheet: Sheet, *more: Line) -> "Figure":
    """Text and rules of a page as a figure of its size."""
    from matplotlib.lines import Line2D

    page = new_figure(WIDTH, HEIGHT)
    page.set_layout_engine("none")
    for mark in (*sheet.marks, *more):
        if isinstance(mark, Rule):
            ends = [each / WIDTH for each in mark.x], [each / HEIGHT for each in mark.y]
            page.add_artist(Line2D(*ends, color=mark.colour, linewidth=mark.width, transform=page.transFigure))
        elif isinstance(mark, Line):
            page.text(
                mark.x / WIDTH,
                mark.y / HEIGHT,
                mark.text,
                fontsize=mark.font.size,
                fontweight="bold" if mark.font.bold else "normal",
                color=mark.colour,
                ha="right" if mark.right else "left",
                parse_math=False,
            )
    return page


def _draw_placed(file: Any, placed: Placed) -> None:
    size = placed.figure.get_size_inches().tolist()
    placed.figure.set_size_inches(placed.width, placed.height)
    try:
        _draw(file, placed.figure, placed.x, placed.y)
    finally:
        placed.figure.set_size_inches(*size)


def _draw(file: Any, figure: "Figure", x: float, y: float) -> None:
    """Draw onto the open page, the figure's lower left corner at (x, y)."""
    from matplotlib.backends.backend_pdf import Op, RendererPdf

    width, height = (float(side) for side in figure.get_size_inches())
    dpi = figure.dpi
    figure.dpi = INCH
    file.output(Op.gsave)
    file.output(1, 0, 0, 1, INCH * x, INCH * y, Op.concat_matrix)
    try:
        renderer = RendererPdf(file, dpi, height, width)
        figure.draw(renderer)
        renderer.finalize()
        file.output(Op.grestore)
    finally:
        figure.dpi = dpi
