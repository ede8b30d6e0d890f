"""Texts that a person reads in windows, reports and figures, and the program's own notation in them."""

import re
from collections.abc import Iterable, Iterator
from html import unescape
from typing import TYPE_CHECKING

from bench.document.document import Document, Listing, Notice, Part, Picture, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TYPED = re.compile(
    r"`[^`]*`"  # commands and keys that are quoted as such
    r'|(?<!\{)"[\w.]+"'  # words that a key or an option takes
    r"|(?<![\w-])--?[a-z][\w-]*"  # options
    r"|\b[\w-]+(?:\.[a-z]\w*)+\b"  # keys with their table, and names of files
    r"|(?:[A-Za-z]:)?[\w.~-]*[/\\](?=[\w.~-]*[a-z]{3})[\w.~/\\ -]*"  # paths
)
"""What is typed in this form: commands, options, keys with their table, names of files, paths."""

_SYMBOL = re.compile(r"(?<![A-Za-z_])[A-Za-z]_(?:[A-Z]|[bcdfgqwyz])(?!\w)")
"""Symbols with an index that Unicode has not as a subscript, such as k_C and h_b; a report lowers the index."""

_NOTATION = {
    "identifier": re.compile(r"[A-Za-z]\w*_\w+"),
    "representation": re.compile(
        r"\{['\"]|\[['\"]|\b(?:nan|NaN|None|True|False|inf)\b|[A-Za-z]\w*\((?:\w+=|\d)|<\w+ object|<class"
    ),
    "unit": re.compile(
        r"/(?:s|m|Hz|V)\d|\b(?:s|kg m)\d/|\bkg m2|(?<![\w.])\d[\d.]* ?(?:um|us|deg)\b|\[(?:um|us|deg)\]"
        r"|\+-|\^|\*\*"
    ),
}


def program_notation(text: str) -> list[str]:
    """The parts of a text in the notation of the program: identifiers, representations of values, ASCII units."""
    left = _SYMBOL.sub(" ", _TYPED.sub(" ", re.sub(r"\$[^$]*\$", " ", text)))
    return [f"{kind} {found[0]!r}" for kind, rule in _NOTATION.items() for found in rule.finditer(left)]


def faults(texts: Iterable[tuple[str, str]]) -> list[str]:
    """Each place whose text has program notation, once: place, notation, text."""
    found = {text: (place, notation) for place, text in texts if (notation := program_notation(text))}
    return [f"{place}: {', '.join(notation)} in {text!r}" for text, (place, notation) in found.items()]


def figure_texts(figure: "Figure") -> Iterator[str]:
    """Titles, axis labels, legends, tick labels and annotations of a matplotlib figure."""
    from matplotlib.text import Text

    yield from (text.get_text() for text in figure.findobj(Text) if text.get_visible() and text.get_text())


def html_texts(page: str) -> Iterator[str]:
    """The text of every element of a page, and the descriptions of its figures."""
    body = re.sub(r"<style.*?</style>|<!--.*?-->", " ", page, flags=re.DOTALL)
    yield from (text for part in re.split(r"<[^>]+>", body) if (text := unescape(part).strip()))


def document_texts(document: Document) -> Iterator[tuple[str, str]]:
    """All texts of a report, those in its figures included, with their places."""
    yield "title", document.title
    yield "provenance", document.provenance
    for place, parts in (("summary", document.summary), *((each.key, each.parts) for each in document.sections)):
        for part in parts:
            for text in _part_texts(part):
                yield place, text
    for section in document.sections:
        yield section.key, section.heading


def _part_texts(part: Part) -> Iterator[str]:
    match part:
        case str():
            yield part
        case Notice():
            yield part.text
        case Listing():
            yield from part.items
        case Table():
            yield part.caption
            yield from (column.heading for column in part.columns)
            yield from (cell for row in part.rows for cell in row)
        case Picture():
            yield part.caption
            yield part.description
            yield from figure_texts(part.figure)
