"""What a report consists of. Built once; HTML and PDF say the same."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Column:
    """A column of a table: its heading, its unit ("" for texts and pure numbers), and whether it holds words."""

    title: str
    unit: str = ""
    words: bool = False

    @property
    def heading(self) -> str:
        """The title with the unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title


@dataclass(frozen=True)
class Table:
    """Cells as they are printed; the first column names the row. Raises ValueError for rows of another length."""

    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[str]]

    def __post_init__(self) -> None:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"table {self.caption}: every row must have {len(self.columns)} cells")


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure: `caption` stands below it, `description` says what it shows to whoever cannot see it."""

    figure: "Figure"
    caption: str
    description: str


@dataclass(frozen=True)
class Listing:
    """Short lines, one below the other."""

    items: Sequence[str]


@dataclass(frozen=True)
class Notice:
    """A paragraph that must not be overlooked."""

    text: str


Part = str | Notice | Listing | Table | Picture
"""A paragraph is a plain text."""


@dataclass(frozen=True, eq=False)
class Section:
    """A heading and what stands under it; `key` is its anchor, a word of letters and hyphens."""

    key: str
    heading: str
    parts: Sequence[Part]


@dataclass(frozen=True, eq=False)
class Document:
    """A whole report. `summary` stands under the title; `made` says when and with what."""

    title: str
    summary: Sequence[Part]
    sections: Sequence[Section]
    made: str


class Numbers:
    """Counts tables and figures, each by itself."""

    def __init__(self) -> None:
        self._tables = self._figures = 0

    def next(self, part: Part) -> str:
        """The name of a part, such as "Table 3"; empty for what has no caption."""
        if isinstance(part, Table):
            self._tables += 1
            return f"Table {self._tables}"
        if isinstance(part, Picture):
            self._figures += 1
            return f"Fig. {self._figures}"
        return ""
