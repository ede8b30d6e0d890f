"""The lines of a check as text for the terminal."""

import textwrap
from collections.abc import Sequence

from bench.analysis.check_line import CheckLine, Verdict
from bench.report.text_table import TextColumn, text_table

WIDTH = 118

_MARK = {Verdict.PASSED: "passed", Verdict.FAILED: "FAILED", Verdict.STATED: "stated", Verdict.UNTESTED: "untested"}
_COLUMNS = (
    TextColumn("verdict", words=True),
    TextColumn("of", words=True),
    TextColumn("what", words=True),
    TextColumn("measured"),
    TextColumn("U (k=2)"),
    TextColumn("expected"),
    TextColumn("allowed"),
    TextColumn("unit", words=True),
)


def lines_table(lines: Sequence[CheckLine]) -> str:
    """One row for each line with its remedy below it, and how many passed; "-" stands where a value is absent."""
    title, rule, *rows = text_table(_COLUMNS, map(_cells, lines)).splitlines()
    text = [title, rule]
    for line, row in zip(lines, rows, strict=True):
        text.append(row)
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
