# pyright: reportUnknownMemberType=false
"""A report as PDF: A4 pages of text, tables and vector figures, typeset by Typst from `report.typ`.

matplotlib draws each figure as a PDF file of its own, which Typst embeds as it is. Texts reach the template as JSON and
are never read as markup. matplotlib's keyword arguments have no types, hence the first line.
"""

import json
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from bench.report.page.document import Document, Picture, template_content

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 6.77, 9.4
"""Largest figure [in]: the text of an A4 page without a caption of a few lines."""


def write_pdf(path: Path, document: Document) -> None:
    """Write the pages to `path`, over whatever is there. Draws every figure, which keeps its size."""
    import matplotlib
    import typst

    with TemporaryDirectory(prefix="rockbench-") as name:
        folder = Path(name)

        def draw(picture: Picture, number: int) -> str:
            file = f"figure-{number}.pdf"
            _draw(picture.figure, folder / file)
            return file

        (folder / "report.json").write_text(json.dumps(template_content(document, draw)), encoding="utf-8")
        template = folder / "report.typ"
        template.write_bytes(files("bench.report.page").joinpath(template.name).read_bytes())
        fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
        path.write_bytes(typst.compile(template, font_paths=[fonts], ignore_system_fonts=True))


def _draw(figure: "Figure", path: Path) -> None:
    """Save a figure no larger than a page; a wide one gets lower by the root of the factor that it gets narrower by.

    Letters keep their size, for the figure is drawn at that size instead of being scaled.
    """
    import matplotlib

    width, height = (float(side) for side in figure.get_size_inches())
    narrower = min(1.0, WIDTH / width)
    figure.set_size_inches(narrower * width, min(HEIGHT, height * narrower**0.5))
    try:
        # whole fonts instead of outlines: text can be found and copied
        with matplotlib.rc_context({"pdf.fonttype": 42}):
            figure.savefig(path, format="pdf")
    finally:
        figure.set_size_inches(width, height)
