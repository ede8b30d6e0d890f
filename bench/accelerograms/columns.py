"""Plain columns separated by commas, semicolons, tabs or blanks: `t,a`, `a`, or several components.

Comments (lines that begin with % or #) and one line of headings like `t [s], NS [cm/s2]` may precede them. A first
column that rises steadily is the time [s] and determines the step. Nothing else is inferred: the unit if no heading
states it, the step if there is no time, and one of several columns must be specified. Comments are kept as the header;
a step or unit in them must not contradict the specified one.
"""

import re
from dataclasses import dataclass
from math import isclose

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.choices import Choices, Reading, also_required, refuse_choice
from bench.accelerograms.numbers import NUMBER, place, value_of
from bench.accelerograms.text import RecordText
from bench.accelerograms.units import UNITS, spelled
from sim.errors import InvalidInput

Array = NDArray[np.float64]


_STEP = re.compile(rf"\bdt\s*[=:]\s*({NUMBER})\s*(ms|msec|milliseconds)?(?![\d./])", re.IGNORECASE)
_UNIT = re.compile(
    r"\b[cm]?m/s(?:ec)?(?:(?:\^|\*\*)?2\b|/s(?:ec)?\b)|\bgals?\b|(?<=[\[(])\s*g\s*(?=[\])])|(?<=\bin )g\b",
    re.IGNORECASE,
)


def check_comments(text: RecordText, count: int, choices: Choices) -> None:
    """Compare the specified step and unit with those stated in the first `count` lines. Raises InvalidInput naming a
    line that contradicts them.
    """
    for index, line in enumerate(text.lines[:count]):
        step = _STEP.search(line)
        if step is not None and choices.dt is not None:
            seconds = value_of(step[1]) * (1e-3 if step[2] else 1.0)
            if not isclose(seconds, choices.dt, rel_tol=1e-6):
                said = step[0].strip()
                raise text.refusal(index, f"it states {said}, but dt={choices.dt:g} was specified; correct one of them")
        # a line may mention several units, as of a conversion
        stated = [unit for found in _UNIT.findall(line) if (unit := spelled(found)) is not None]
        given = None if choices.unit is None else spelled(choices.unit)
        if stated and given is not None and UNITS[given] not in [UNITS[unit] for unit in stated]:
            named = " and ".join(dict.fromkeys(stated))
            raise text.refusal(index, f"it states {named}, but unit={given} was specified; correct one of them")


_COMMENT = ("%", "#")
_HEADING = re.compile(r"^(?P<name>.*?)\s*[\[(]\s*(?P<unit>[^\])]+?)\s*[\])]\s*$")
_OTHER = re.compile(r"\s*[cm]?m(?:/s(?:ec)?)?\s*", re.IGNORECASE)
"""Units of displacement and velocity; other remarks in brackets may be no units at all."""
_RISING = 0.9
"""Fraction of rising steps from which the first column counts as time; its steps must then all be equal."""

_EQUAL = 1e-6
"""Relative tolerance for rounding errors in the comparison of time steps."""


@dataclass(frozen=True, eq=False)
class _Table:
    """Columns of a file: `values` has shape (rows, columns); its first row is in the line with index `first`."""

    values: Array
    headings: list[str]
    first: int
    separator: str | None


def recognise(text: RecordText) -> bool:
    """Whether the file begins with comments, if any, at most one line of headings, and a row of numbers."""
    first = _first_row(text)
    return first is not None and first - _comments(text) <= 1


def read(text: RecordText, choices: Choices) -> Reading:
    """Read plain columns. Raises InvalidInput."""
    refuse_choice(text, choices, "channel")
    table = _table(text)
    check_comments(text, table.first - bool(table.headings), choices)
    count = table.values.shape[1]
    time = _is_time(table.values)
    column = _column(text, choices, table, time)
    name, unit = _heading(table.headings[column]) if table.headings else ("", None)
    if unit is not None and spelled(unit) is None and (choices.unit is None or _OTHER.fullmatch(unit)):
        raise text.refusal(
            table.first - 1, f"column {column + 1} is in {unit}, which is not a known unit of acceleration"
        )
    comments = {f"line {k}": line.strip() for k, line in enumerate(text.lines[: table.first], 1)}
    return Reading(
        format="columns" if count > 1 else "one column",
        values=np.ascontiguousarray(table.values[:, column]),
        dt=_step(text, table) if time else None,
        unit=None if unit is None else spelled(unit),
        header=comments | ({"column": f"{column + 1} {name}".strip()} if count > 1 else {}),
        part=f"c{column + 1}" if count - time > 1 else "",
    )


def _comments(text: RecordText) -> int:
    """Number of comment or empty lines at the top."""
    return next((k for k, line in enumerate(text.lines) if line.strip() and not line.startswith(_COMMENT)), 0)


def _first_row(text: RecordText) -> int | None:
    """Line index of the first row of numbers, at most one line below the comments; None if there is none."""
    row = re.compile(rf"\s*{NUMBER}(?:[\s,;]+{NUMBER})*[\s,;]*")
    start = _comments(text)
    return next((k for k in range(start, min(start + 2, len(text.lines))) if row.fullmatch(text.lines[k])), None)


def _table(text: RecordText) -> _Table:
    first = _first_row(text)
    assert first is not None
    line = text.lines[first]
    separator = ";" if ";" in line else "," if "," in line else None
    lines = text.lines[first:]
    if separator == "," and not any("." in line for line in lines):
        raise text.refusal(first, "its commas may be decimal commas; write decimals with a point")
    values = _parsed(text, first, separator)
    above = text.lines[first - 1] if first > _comments(text) else ""
    headings = [
        cell.strip() for cell in (above.split(separator) if separator else re.split(r"\t|\s{2,}", above.strip()))
    ]
    return _Table(values, headings if len(headings) == values.shape[1] and above else [], first, separator)


def _parsed(text: RecordText, first: int, separator: str | None) -> Array:
    """The numbers, shape (rows, columns). Raises InvalidInput naming the first line that cannot be read."""
    lines = text.lines[first:]
    try:
        if "" not in lines:
            values = np.loadtxt(lines, delimiter=separator, comments=None, ndmin=2, dtype=np.float64)
            if len(values) == len(lines) and np.isfinite(values).all():
                return values
    except ValueError:
        # numpy does not report the line reliably: the loop below finds it
        pass
    width = len(text.lines[first].split(separator))
    for index, line in enumerate(lines, first):
        cells = line.split(separator)
        if not line.strip():
            raise text.refusal(index, "it is empty but more samples follow: the record has a gap")
        if len(cells) != width:
            raise text.refusal(
                index, f"its number of columns, {len(cells)}, differs from that of the lines above, {width}"
            )
        for cell in cells:
            if re.fullmatch(NUMBER, cell.strip()) is None or not np.isfinite(value_of(cell.strip())):
                raise text.refusal(index, f"{cell.strip()!r} is not a finite decimal number")
    raise text.refusal(first, "these columns cannot be read; write them like 0.01,-0.0012")


def _is_time(values: Array) -> bool:
    """Whether the first of several columns rises steadily, as times do but ground accelerations do not."""
    if values.shape[1] < 2 or len(values) < 3:
        return False
    steps = np.diff(values[:, 0])
    return bool((steps > 0.0).mean() >= _RISING or ((steps >= 0.0).all() and steps.any()))


def _step(text: RecordText, table: _Table) -> float:
    """The constant step of the first column [s], to within the rounding of its digits."""
    if table.headings:
        name, unit = _heading(table.headings[0])
        if unit is not None and unit.lower() not in ("s", "sec", "seconds"):
            raise text.refusal(table.first - 1, f"its first column, {name}, is in {unit}; give the time in s")
    time = table.values[:, 0]
    steps = np.diff(time)
    usual = float(np.median(steps))
    ends = (table.first, table.first + 1, table.first + steps.size)
    digit = max(place(text.lines[k].split(table.separator)[0].strip()) for k in ends)
    # two rounded times may each be off by half a unit of the last digit; a tolerance of more than half a step could
    # hide a gap
    exact = _EQUAL * usual
    rounding = max(digit * (1.0 + _EQUAL), exact) if digit <= 0.5 * usual else exact
    dt = float(time[-1] - time[0]) / steps.size
    wrong = np.flatnonzero(np.abs(steps - usual) > rounding)
    drift = np.abs(time - time[0] - dt * np.arange(time.size))
    if wrong.size or drift.max() > rounding:
        at = int(wrong[0]) + 1 if wrong.size else int(drift.argmax())
        problem = f"the times up to this one do not have a constant step of {usual:g} s"
        raise text.refusal(table.first + at, f"{problem}: there is a gap, or the times have too few digits")
    # restore the intended step: 0.01 instead of 0.00999999999
    meant = float(f"{dt:.9g}")
    return meant if abs(meant - dt) * steps.size <= max(digit, 4.0 * float(np.spacing(abs(time[-1])))) else dt


def _column(text: RecordText, choices: Choices, table: _Table, time: bool) -> int:
    """Index of the chosen column, from 0. Raises InvalidInput."""
    count = table.values.shape[1]
    names = [_heading(cell)[0] for cell in table.headings]
    offered = [f"{k + 1} ({names[k]})" if names else f"{k + 1}" for k in range(int(time), count)]
    item, wanted = f"column of {text.path.name}", choices.column
    if wanted is None:
        if len(offered) > 1:
            stated = bool(names) and all(_heading(cell)[1] for cell in table.headings[int(time) :])
            also = also_required(step=choices.dt is None and not time, unit=choices.unit is None and not stated)
            raise InvalidInput(
                item, None, f"the file has several columns; select one with @column=NUMBER: {', '.join(offered)}{also}"
            )
        return int(time)
    found = [k for k, name in enumerate(names) if name == wanted]
    if re.fullmatch(r"\d{1,6}", wanted):
        found = [int(wanted) - 1]
    if len(found) != 1 or not int(time) <= found[0] < count:
        allowed = f"it must be one of {', '.join(offered)}"
        raise InvalidInput(item, wanted, f"{allowed}; column 1 is the time" if time else allowed)
    return found[0]


def _heading(cell: str) -> tuple[str, str | None]:
    """Name and unit of a heading like `NS [cm/s2]`."""
    match = _HEADING.match(cell.strip().strip('"'))
    return (cell.strip().strip('"'), None) if match is None else (match["name"].strip(), match["unit"])
