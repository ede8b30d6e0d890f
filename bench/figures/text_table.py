"""Text tables for the terminal: columns as wide as their cells, independent of the output's width."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

UNLIMITED = 1_000_000
"""Page width passed to rich, so that no cell is truncated or wrapped."""


@dataclass(frozen=True)
class TextColumn:
    """Column: title, unit below it ("" for none), and whether its cells are words and therefore left-aligned."""

    title: str
    unit: str = ""
    words: bool = False


def text_table(columns: Sequence[TextColumn], rows: Iterable[Sequence[str]]) -> str:
    """Lines of a table: titles, units if any column has one, a rule, then one line per row of cells.

    Replaces unprintable characters, such as an escape sequence in a file name, by "�". Raises
    ValueError for a row of another length.
    """
    from rich.box import Box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    # a rule below the header only; rich draws one character of it between two columns
    box = Box("    \n    \n -- \n    \n    \n    \n    \n    \n", ascii=True)
    table = Table(box=box, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0), collapse_padding=True)
    units = any(column.unit for column in columns)
    for column in columns:
        unit = f"[{column.unit}]" if column.unit else ""
        heading = f"{column.title}\n{unit}" if units else column.title
        table.add_column(Text(heading), justify="left" if column.words else "right", no_wrap=True)
    cells = [[_printable(cell) for cell in row] for row in rows]
    if any(len(row) != len(columns) for row in cells):
        raise ValueError(f"a table of {len(columns)} columns has rows of {sorted({len(row) for row in cells})} cells")
    if cells:
        # rich renders one multi-line cell per column much faster than one cell per row
        table.add_row(*(Text("\n".join(column)) for column in zip(*cells, strict=True)))
    console = Console(width=UNLIMITED, color_system=None, force_terminal=False, legacy_windows=False)
    with console.capture() as captured:
        console.print(table)
    return "\n".join(line.rstrip() for line in captured.get().splitlines())


def _printable(cell: str) -> str:
    return cell if cell.isprintable() else "".join(each if each.isprintable() else "\ufffd" for each in cell)
