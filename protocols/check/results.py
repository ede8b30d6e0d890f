# pyright: reportUnknownMemberType=false
"""The lines of a check as text, as one line of a log, and as a figure of their margins.

matplotlib's keyword arguments have no types, hence the first line.
"""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from bench.analysis.check_line import CheckLine, Verdict
from bench.report.style import BLUE, GREY, VERMILLION, new_figure, set_grid
from bench.report.text_table import TextColumn, text_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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

_OUTSIDE = 1.5
"""Position at which a line far beyond its limits is drawn."""


def lines_table(lines: Sequence[CheckLine]) -> str:
    """One row for each line with its remedy below it, and how many passed; "-" stands where a value is absent."""
    title, rule, *rows = text_table(_COLUMNS, map(_cells, lines)).splitlines()
    text = [title, rule]
    for line, row in zip(lines, rows, strict=True):
        text.append(row)
        if line.remedy:
            text += textwrap.wrap(line.remedy, WIDTH, initial_indent="    -> ", subsequent_indent="       ")
    counted = [sum(line.verdict is verdict for line in lines) for verdict in Verdict]
    summary = ", ".join(f"{number} {verdict}" for number, verdict in zip(counted, Verdict, strict=True) if number)
    return "\n".join([*text, "", f"{summary or 'nothing was checked'}."])


def log_line(line: CheckLine) -> str:
    """A line of the check as one line of a log."""
    text = f"{_MARK[line.verdict]}: {line.subject}, {line.what}"
    if line.measured is not None:
        unit = "" if line.unit == "1" else f" {line.unit}"
        text += f": {line.measured:.4g}{unit}"
        text += f", allowed {_range(line)}{unit}" if line.lowest is not None else ""
    return text + (f" ({line.remedy})" if line.remedy else "")


def margins(lines: Sequence[CheckLine]) -> "Figure":
    """Each judged line from its lowest (-1) to its highest allowed value (+1)."""
    judged = [(line, place) for line in lines if (place := _place(line)) is not None]
    figure = new_figure(8.0, 1.2 + 0.24 * len(judged))
    panel = figure.subplots()
    panel.axvspan(-1.0, 1.0, color=BLUE, alpha=0.08, linewidth=0.0)
    for row, (line, place) in enumerate(judged):
        passed = line.verdict is Verdict.PASSED
        panel.plot(place, row, "o" if passed else "X", color=BLUE if passed else VERMILLION, markersize=6)
    labels = [f"{line.subject}: {line.what}" for line, _ in judged]
    panel.set_yticks(range(len(judged)), labels, fontsize=7)
    panel.set_xlim(-1.1 * _OUTSIDE, 1.1 * _OUTSIDE)
    panel.set_xticks([-1.0, 0.0, 1.0], ["lowest", "middle", "highest"])
    panel.set_xlabel("place within what is allowed; circles passed, crosses failed", color=GREY)
    panel.invert_yaxis()
    set_grid(panel)
    return figure


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


def _place(line: CheckLine) -> float | None:
    """The measured value on a scale from -1 to 1 between its limits, cut beyond; None where it is not judged."""
    if line.measured is None or line.lowest is None or line.highest is None:
        return None
    middle, half = 0.5 * (line.lowest + line.highest), 0.5 * (line.highest - line.lowest)
    if half == 0.0:
        return 0.0 if line.measured == middle else _OUTSIDE
    return min(max((line.measured - middle) / half, -_OUTSIDE), _OUTSIDE)
