# pyright: reportUnknownMemberType=false
"""A report as one HTML file: no script, no reference to another file, readable on screen and on paper.

The template escapes every text. matplotlib's keyword arguments have no types, hence the first line.
"""

import io
import re
from html import escape

from bench.report.page.document import Document, Picture, template_content

_IDENTIFIER = re.compile(r' id="([^"]+)"')
_REFERENCE = re.compile(r'(href="|url\()#([^")]+)')
_OUTLINE = re.compile(r'( d=")([^"]+)(")')
_DIGITS = re.compile(r"(\.\d\d)\d+")
_RULE = re.compile(r"<defs>\s*<style.*?</style>\s*</defs>\s*", re.DOTALL)
_OPENING = re.compile(r"<svg\b([^>]*)>")


def html_page(document: Document) -> str:
    """The whole file, to be written as UTF-8. Draws every figure."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    # matplotlib's own output, whose texts are outlines; every other text is escaped by the template
    content = template_content(document, lambda picture, number: Markup(_inline_svg(picture, number)))
    environment = Environment(
        loader=PackageLoader("bench.report", "page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template("report.html.jinja").render(report=content)


def _inline_svg(picture: Picture, number: int) -> str:
    """An `<svg>` element without header and references, whose identifiers no other figure of the page has.

    Letters are outlines, so that they look and print alike where the font is not installed; title and description
    hold what the figure shows.
    """
    import matplotlib

    text, prefix = io.StringIO(), f"f{number}"
    # the salt makes the identifiers the same in every run
    with matplotlib.rc_context({"svg.fonttype": "path", "svg.hashsalt": "rockbench"}):
        metadata = {"Date": None, "Creator": None, "Format": None, "Type": None}
        picture.figure.savefig(text, format="svg", metadata=metadata)
    whole = text.getvalue()
    body = whole[whole.index("<svg") :].strip()
    used = {name for _, name in _REFERENCE.findall(body)}
    body = _IDENTIFIER.sub(lambda found: f' id="{prefix}-{found[1]}"' if found[1] in used else "", body)
    body = _REFERENCE.sub(rf"\g<1>#{prefix}-\g<2>", body)
    # a hundredth of a point is finer than any printer
    body = _OUTLINE.sub(lambda found: found[1] + _DIGITS.sub(r"\1", found[2]) + found[3], body)
    # the page has this rule once for all
    body = _RULE.sub("", body)
    body = re.sub(r"<!--.*?-->\s*", "", body, flags=re.DOTALL)
    attributes = f'role="img" aria-labelledby="{prefix}-title {prefix}-text"'
    title = f'<title id="{prefix}-title">Fig. {number}</title>'
    description = f'<desc id="{prefix}-text">{escape(picture.description)}</desc>'
    return _OPENING.sub(lambda found: f"<svg {attributes}{found[1]}>{title}{description}", body, count=1)
