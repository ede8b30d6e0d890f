"""Tables of numbers for the terminal whose units are given in brackets."""

from collections.abc import Iterable, Sequence

from bench.report.text_table import TextColumn, text_table


def right_aligned(titles: Sequence[str], units: Sequence[str], cells: Iterable[Sequence[str]]) -> list[str]:
    """The lines of a table: titles, units, a rule, then one line for each row of cells."""
    columns = [TextColumn(title, unit.strip("[]")) for title, unit in zip(titles, units, strict=True)]
    return text_table(columns, cells).splitlines()
