"""The lines of a check as text for the terminal."""

import textwrap
from collections.abc import Sequence

from protocols.check.line import CheckLine, Verdict

WIDTH = 118

_MARK = {Verdict.PASSED: "passed", Verdict.FAILED: "FAILED", Verdict.STATED: "stated", Verdict.UNTESTED: "untested"}
_TITLES = ("verdict", "of", "what", "measured", "U (k=2)", "expected", "allowed", "unit")
_LEFT = (True, True, True, False, False, False, False, True)


def lines_table(lines: Sequence[CheckLine]) -> str:
    """One row for each line with its remedy below it, and how many passed; "-" stands where a value is absent."""
    rows = [_TITLES, *(_cells(line) for line in lines)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_TITLES))]
    text = [_aligned(_TITLES, widths), "-" * (sum(widths) + 2 * (len(widths) - 1))]
    for line, cells in zip(lines, rows[1:], strict=True):
        text.append(_aligned(cells, widths))
        if line.remedy:
            text += textwrap.wrap(line.remedy, WIDTH, initial_indent="    -> ", subsequent_indent="       ")
    counted = [sum(line.verdict is verdict for line in lines) for verdict in Verdict]
    said = ", ".join(f"{number} {verdict}" for number, verdict in zip(counted, Verdict, strict=True) if number)
    return "\n".join([*text, "", f"{said or 'nothing was checked'}."])


def sentence(line: CheckLine) -> str:
    """A line of the check as one line of a log."""
    said = f"{_MARK[line.verdict]}: {line.subject}, {line.what}"
    if line.measured is not None:
        unit = "" if line.unit == "1" else f" {line.unit}"
        said += f": {line.measured:.4g}{unit}"
        said += f", allowed {_range(line)}{unit}" if line.lowest is not None else ""
    return said + (f" ({line.remedy})" if line.remedy else "")


def _cells(line: CheckLine) -> tuple[str, ...]:
    return (
        _MARK[line.verdict],
        line.subject,
        line.what,
        _number(line.measured),
        _number(line.uncertainty, 2),
        _number(line.expected),
        _range(line),
        "" if line.measured is None or line.unit == "1" else line.unit,
    )


def _range(line: CheckLine) -> str:
    if line.lowest is None:
        return "-"
    if line.highest is None:
        return f"{_number(line.lowest, 3)} .."
    if line.lowest == line.highest:
        return _number(line.lowest)
    return f"{_number(line.lowest, 3)} .. {_number(line.highest, 3)}"


def _number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def _aligned(cells: Sequence[str], widths: Sequence[int]) -> str:
    placed = [
        cell.ljust(width) if left else cell.rjust(width) for cell, width, left in zip(cells, widths, _LEFT, strict=True)
    ]
    return "  ".join(placed).rstrip()
