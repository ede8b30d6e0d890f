"""PEER `.AT2` files: a header of four lines or more, the last with NPTS and DT, then rows of samples.

Variants of that line: `NPTS= 4000, DT= .01000 SEC` (1999 to today, with or without a trailing comma) and `4000 0.0100
NPTS, DT` (Pacific Engineering and Analysis). Spectrum-compatible files have the headers of earlier processing stages
above the valid header. Samples are in 4 to 8 columns; the last row may be partial. Source: PEER Strong Motion Database,
"Data files"; PEER NGA-West2 (2013).
"""

import re

from bench.accelerograms.choices import Choices, Reading, refuse_choice
from bench.accelerograms.numbers import NUMBER, numbers, value_of
from bench.accelerograms.stated import acceleration_unit, count_in, not_acceleration
from bench.accelerograms.text import RecordText

_SIZES = (
    re.compile(rf"NPTS\s*[=:]\s*(?P<count>\d+)\D*?DT\s*[=:]\s*(?P<dt>{NUMBER})", re.IGNORECASE),
    re.compile(rf"^\s*(?P<count>\d+)[\s,]+(?P<dt>{NUMBER})[\s,]+NPTS\s*,\s*DT", re.IGNORECASE),
)
_QUANTITY = re.compile(r"\b(ACCELERATION|VELOCITY|DISPLACEMENT)\b", re.IGNORECASE)
_UNIT = re.compile(r"UNITS?\s+OF\s+([A-Z/0-9^*]+)|\(\s*([^()]+?)\s*\)", re.IGNORECASE)
_LONGEST_HEADER = 60


def recognise(text: RecordText) -> bool:
    """Whether a line near the top states NPTS and DT."""
    return _size_line(text) is not None


def read(text: RecordText, choices: Choices) -> Reading:
    """Read a PEER file. Raises InvalidInput."""
    refuse_choice(text, choices, "channel", "column")
    last = _size_line(text)
    assert last is not None
    size = _sizes(text.lines[last])
    assert size is not None
    stated = [index for index in range(last) if _QUANTITY.search(text.lines[index])]
    if not stated:
        raise text.refusal(last, "no line above it states ACCELERATION; use the .AT2 file as downloaded from PEER")
    about = stated[-1]
    quantity = str(_QUANTITY.findall(text.lines[about])[0])
    if quantity.upper() != "ACCELERATION":
        raise not_acceleration(text, about, quantity)
    unit = _UNIT.search(text.lines[about])
    samples = numbers(text, last + 1, len(text.lines), count_in(text, last, size["count"]))
    lines = [line.strip() for line in text.lines[: last + 1]]
    return Reading(
        format="PEER NGA AT2" if "NGA" in lines[0].upper() else "PEER AT2",
        values=samples.values,
        dt=value_of(size["dt"]),
        unit=None if unit is None else acceleration_unit(text, about, unit[1] or unit[2]),
        header={f"line {k}": line for k, line in enumerate(lines, 1)},
    )


def _size_line(text: RecordText) -> int | None:
    """The line with NPTS and DT: the last such line, because headers of earlier processing stages may precede the valid
    header.
    """
    found = [k for k, line in enumerate(text.lines[:_LONGEST_HEADER]) if _sizes(line) is not None]
    return found[-1] if found else None


def _sizes(line: str) -> re.Match[str] | None:
    return next((match for match in (pattern.search(line) for pattern in _SIZES) if match is not None), None)
