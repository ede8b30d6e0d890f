# pyright: reportUnknownMemberType=false
"""A figure as SVG that stands inside an HTML page: no header, no references, identifiers of its own.

Letters are drawn as outlines, so that they look and print alike where the font is not installed; what the figure says
is in its title and description, and in the caption. matplotlib's keyword arguments have no types, hence the first line.
"""

import io
import re
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_IDENTIFIER = re.compile(r' id="([^"]+)"')
_REFERENCE = re.compile(r'(href="|url\()#([^")]+)')
_OUTLINE = re.compile(r'( d=")([^"]+)(")')
_DIGITS = re.compile(r"(\.\d\d)\d+")
_RULE = re.compile(r"<defs>\s*<style.*?</style>\s*</defs>\s*", re.DOTALL)
_OPENING = re.compile(r"<svg\b([^>]*)>")


def inline_svg(figure: "Figure", prefix: str, title: str, description: str) -> str:
    """An `<svg>` element; its identifiers begin with `prefix`, which no other figure of the page may have."""
    import matplotlib

    text = io.StringIO()
    # the salt makes the identifiers the same in every run
    with matplotlib.rc_context({"svg.fonttype": "path", "svg.hashsalt": "rockbench"}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
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
    named = f'role="img" aria-labelledby="{prefix}-title {prefix}-text"'
    words = f'<title id="{prefix}-title">{escape(title)}</title><desc id="{prefix}-text">{escape(description)}</desc>'
    return _OPENING.sub(lambda found: f"<svg {named}{found[1]}>{words}", body, count=1)
