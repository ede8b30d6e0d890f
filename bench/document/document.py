"""The content of a report, rendered as HTML and PDF by one template each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, assert_never

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Column:
    """A table column: title, unit ("" for text and pure numbers), and whether its cells are words, which are
    left-aligned.
    """

    title: str
    unit: str = ""
    words: bool = False

    @property
    def heading(self) -> str:
        """The title with the unit in brackets."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title


@dataclass(frozen=True)
class Table:
    """A table of formatted cells; the first column names the row. Raises ValueError for rows of another length."""

    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[str]]

    def __post_init__(self) -> None:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"table {self.caption}: every row must have {len(self.columns)} cells")


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure with its `caption`; `description` is for screen readers."""

    figure: "Figure"
    caption: str
    description: str


@dataclass(frozen=True)
class Listing:
    """A list of short lines."""

    items: Sequence[str]


@dataclass(frozen=True)
class Notice:
    """A highlighted paragraph."""

    text: str


Part = str | Notice | Listing | Table | Picture
"""Parts of a section; a paragraph is a plain string."""


@dataclass(frozen=True, eq=False)
class Section:
    """A heading and its parts; `key` is the anchor, of letters and hyphens."""

    key: str
    heading: str
    parts: Sequence[Part]


@dataclass(frozen=True, eq=False)
class Document:
    """A complete report. `provenance` is the line below the title: date, program, definitions; `summary` follows it."""

    title: str
    summary: Sequence[Part]
    sections: Sequence[Section]
    provenance: str


def template_content(document: Document, draw: Callable[[Picture, int], Any]) -> dict[str, Any]:
    """Returns title, provenance, summary and sections (key, heading, parts) for a template.

    A part is a dictionary whose `kind` is "text", "notice", "listing", "table" or "picture". Tables and figures are
    numbered separately: their `name` is "Table 3" or "Fig. 2". `draw` receives a picture and its number and returns its
    `drawing` for the template.
    """
    counts = {"Table": 0, "Fig.": 0}

    def number(kind: str) -> int:
        counts[kind] += 1
        return counts[kind]

    def content(part: Part) -> dict[str, Any]:
        match part:
            case str():
                return {"kind": "text", "text": part}
            case Notice():
                return {"kind": "notice", "text": part.text}
            case Listing():
                return {"kind": "listing", "items": [*part.items]}
            case Table():
                columns = [{"heading": column.heading, "words": column.words} for column in part.columns]
                rows = [[*row] for row in part.rows]
                name = f"Table {number('Table')}"
                return {"kind": "table", "name": name, "caption": part.caption, "columns": columns, "rows": rows}
            case Picture():
                count = number("Fig.")
                texts = {"name": f"Fig. {count}", "caption": part.caption, "description": part.description}
                return {"kind": "picture", **texts, "drawing": draw(part, count)}
            case _:
                assert_never(part)

    return {
        "title": document.title,
        "provenance": document.provenance,
        "summary": [content(part) for part in document.summary],
        "sections": [
            {"key": each.key, "heading": each.heading, "parts": [content(part) for part in each.parts]}
            for each in document.sections
        ],
    }
