# pyright: reportUnknownMemberType=false
"""Rendering of a report as one HTML file, and as A4 pages of a PDF.

The HTML has no script and no reference to another file; its template escapes all text. For the PDF, matplotlib draws
each figure as a page of a PDF file, which Typst embeds; text is passed to the template `report.typ` as JSON and is
never read as markup.
"""

import io
import re
from collections.abc import Iterable
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.document.document import Document, Picture, template_content
from bench.document.typesetting import Typesetter
from bench.unfinished import temporary_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_IDENTIFIER = re.compile(r' id="([^"]+)"')
_REFERENCE = re.compile(r'(href="|url\()#([^")]+)')
_OUTLINE = re.compile(r'( d=")([^"]+)(")')
_DIGITS = re.compile(r"(\.\d\d)\d+")
_RULE = re.compile(r"<defs>\s*<style.*?</style>\s*</defs>\s*", re.DOTALL)
_OPENING = re.compile(r"<svg\b([^>]*)>")

_INDEXED = re.compile(r"(?<![\w.\\/-])([A-Za-z])_([A-Za-z])(?![\w.\\-])")
"""A symbol whose index is not a Unicode character, such as h_b and k_C; not a part of a path."""

INCH = 72.0
"""Points per inch."""

WIDTH, HEIGHT = 6.77, 8.0
"""Largest size of a figure in a PDF [in]: the text area of an A4 page minus a heading, a paragraph and a caption of a
few lines each, so that a section with one large figure fits on a page.
"""


def html_page(document: Document) -> str:
    """The complete HTML text, which declares the encoding UTF-8. Draws every figure."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    # matplotlib's SVG is safe because its text is outlines or escaped; the template escapes all other text
    content = template_content(document, lambda picture, number: Markup(_inline_svg(picture, number)))
    environment = Environment(
        loader=PackageLoader("bench.document", ""),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=_with_indices,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template("report.html.jinja").render(report=content)


def _with_indices(value: object) -> object:
    """A value for the template; in text, the indices of symbols are lowered."""
    from markupsafe import Markup, escape

    if not isinstance(value, str) or isinstance(value, Markup):
        return value
    return Markup(_INDEXED.sub(r"\1<sub>\2</sub>", str(escape(value))))


def write_pdf(path: Path, document: Document) -> None:
    """Write the pages to `path`, replacing any existing file. Figures larger than a page are drawn smaller; a figure
    that would leave a page partly blank is drawn at another height, or follows the next text of its section.
    """
    drawings: list[tuple[Picture, dict[str, Any]]] = []

    def empty(picture: Picture, _number: int) -> dict[str, Any]:
        width, height = _largest_size(picture.figure)
        drawings.append((picture, {"page": None, "width": INCH * width, "height": INCH * height}))
        return drawings[-1][1]

    content = template_content(document, empty)
    with temporary_folder() as folder:
        typesetter = Typesetter(folder, content)
        typesetter.fill_pages(INCH * HEIGHT)
        sizes = [(drawing["width"] / INCH, drawing["height"] / INCH) for _, drawing in drawings]
        _save_pages(folder / "figures.pdf", zip([picture.figure for picture, _ in drawings], sizes, strict=True))
        for page, (_, drawing) in enumerate(drawings, 1):
            drawing["page"] = page
        path.write_bytes(typesetter.pdf())


def _inline_svg(picture: Picture, number: int) -> str:
    """An `<svg>` element without XML header and unused identifiers; the used ones are unique on the page.

    Letters are outlines and need no fonts; title and description are for screen readers.
    """
    import matplotlib

    text, prefix = io.StringIO(), f"f{number}"
    # a fixed salt gives the same identifiers in every run
    with matplotlib.rc_context({"svg.fonttype": "path", "svg.hashsalt": "rockbench"}):
        metadata = {"Date": None, "Creator": None, "Format": None, "Type": None}
        picture.figure.savefig(text, format="svg", metadata=metadata)
    whole = text.getvalue()
    body = whole[whole.index("<svg") :].strip()
    used = {name for _, name in _REFERENCE.findall(body)}
    body = _IDENTIFIER.sub(lambda found: f' id="{prefix}-{found[1]}"' if found[1] in used else "", body)
    body = _REFERENCE.sub(rf"\g<1>#{prefix}-\g<2>", body)
    # two decimals suffice: printers do not resolve a hundredth of a point
    body = _OUTLINE.sub(lambda found: found[1] + _DIGITS.sub(r"\1", found[2]) + found[3], body)
    # the style sheet of the page already contains this rule
    body = _RULE.sub("", body)
    body = re.sub(r"<!--.*?-->\s*", "", body, flags=re.DOTALL)
    attributes = f'role="img" aria-labelledby="{prefix}-title {prefix}-text"'
    title = f'<title id="{prefix}-title">Fig. {number}</title>'
    description = f'<desc id="{prefix}-text">{escape(picture.description)}</desc>'
    return _OPENING.sub(lambda found: f"<svg {attributes}{found[1]}>{title}{description}", body, count=1)


def _largest_size(figure: "Figure") -> tuple[float, float]:
    """Width and height of a figure in a PDF [in], no larger than a page; if the width is reduced, the height is reduced
    by the square root of the same factor.
    """
    width, height = (float(side) for side in figure.get_size_inches())
    narrower = min(1.0, WIDTH / width)
    return narrower * width, min(HEIGHT, height * narrower**0.5)


def _save_pages(path: Path, figures: "Iterable[tuple[Figure, tuple[float, float]]]") -> None:
    """Saves figures as the pages of one file, each with a size [in]. A figure is drawn at that size rather than scaled,
    so that its text keeps its size. The parts of the fonts that the figures need are extracted once for all of them.
    """
    import matplotlib
    from matplotlib.backends.backend_pdf import PdfPages

    # embedded fonts instead of outlines, so that text can be searched and copied
    with matplotlib.rc_context({"pdf.fonttype": 42}), PdfPages(path) as pages:
        for figure, size in figures:
            own = tuple(figure.get_size_inches())
            figure.set_size_inches(*size)
            try:
                pages.savefig(figure)
            finally:
                figure.set_size_inches(*own)
