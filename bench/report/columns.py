"""Plain tables for the terminal."""

from collections.abc import Iterable, Sequence


def right_aligned(titles: Sequence[str], units: Sequence[str], cells: Iterable[Sequence[str]]) -> list[str]:
    """The lines of a table: titles, units, a rule, then one line for each row of cells."""
    rows = [titles, units, *cells]
    widths = [max(len(row[column]) for row in rows) for column in range(len(titles))]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    lines.insert(2, "-" * len(lines[0]))
    return lines
