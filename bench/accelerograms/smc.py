"""U.S. Geological Survey `.smc` files: 11 lines of text, 48 integers, 50 reals, comments, then samples in cm/s2.

Integer 16 is the number of comment lines, integer 17 that of samples; real 2 is the sampling rate [Hz], reals 30 and 32
are the largest and the smallest sample. Columns are 10 characters wide (15 for the reals) and may touch. Source: USGS
National Strong-Motion Program, "SMC-format data files", sections 3 and 4.
"""

import re

from bench.accelerograms.choices import Choices, Reading, refuse_choice
from bench.accelerograms.numbers import numbers
from bench.accelerograms.stated import check_peak, count_in, not_acceleration
from bench.accelerograms.text import RecordText

_TEXT, _INTEGERS, _REALS, _COMMENTS = 11, 17, 27, 27
"""Line indices at which the text, the integers and the reals end and the comments begin."""

_WIDTH, _REAL_WIDTH = 10, 15
_TYPE = re.compile(r"^\s*([0-6])\s+([A-Z][A-Z ]+)")
_UNKNOWN = 1e30
"""Limit above which a real denotes an unknown value; the files use 1.7e38."""

_KINDS = {"1": "uncorrected accelerogram", "2": "corrected accelerogram"}


def recognise(text: RecordText) -> bool:
    """Whether the file begins with an SMC type and has the 48 integers."""
    if _TYPE.match(text.lines[0]) is None or len(text.lines) <= _COMMENTS:
        return False
    return all(re.fullmatch(r"[\s\d-]{80}\s*", line.ljust(80)) for line in text.lines[_TEXT:_INTEGERS])


def read(text: RecordText, choices: Choices) -> Reading:
    """Read an SMC file. Raises InvalidInput."""
    refuse_choice(text, choices, "channel", "column")
    kind = _TYPE.match(text.lines[0])
    assert kind is not None
    if kind[1] not in _KINDS:
        raise not_acceleration(text, 0, kind[2].strip())
    comments = _comments(text)
    first = _COMMENTS + comments
    for index in range(_COMMENTS, first):
        if index >= len(text.lines) or not text.lines[index].startswith("|"):
            raise text.refusal(
                min(index, len(text.lines) - 1),
                f"a comment line must begin with |; comment lines announced by the file: {comments}",
            )
    count = count_in(text, _TEXT + 2, _field(text, _TEXT, 17))
    reals = numbers(text, _INTEGERS, _REALS, 50, _REAL_WIDTH)
    rate = float(reals.values[1])
    if not 0.0 < rate < _UNKNOWN:
        raise text.refusal(
            _INTEGERS,
            "the second number, the sampling rate, is unknown: the step may vary; use a record with a constant step",
        )
    samples = numbers(text, first, len(text.lines), count, _WIDTH)
    known = [k for k in (29, 31) if abs(reals.values[k]) < _UNKNOWN]
    if len(known) == 2:
        largest = max(known, key=lambda k: abs(float(reals.values[k])))
        check_peak(text, _INTEGERS + largest // 5, reals.texts[largest], samples)
    lines = [line.strip() for line in text.lines[:_TEXT]] + [line[1:].strip() for line in text.lines[_COMMENTS:first]]
    return Reading(
        format=f"SMC, {_KINDS[kind[1]]}",
        values=samples.values,
        dt=1.0 / rate,
        unit="cm/s2",
        header={f"line {k}": line for k, line in enumerate(lines, 1) if line.strip("*")},
    )


def _comments(text: RecordText) -> int:
    """Number of comment lines, integer 16. Raises InvalidInput if it is not a non-negative integer."""
    word = _field(text, _TEXT, 16).strip()
    if re.fullmatch(r"\d+", word) is None:
        raise text.refusal(
            _TEXT + 1,
            "its last number, that of comment lines, must be an integer of at least 0; download the file again",
        )
    return int(word)


def _field(text: RecordText, first: int, number: int) -> str:
    """Text of integer `number`, counted from 1, in the block that begins at line index `first`, eight per line."""
    row, column = divmod(number - 1, 8)
    return text.lines[first + row][_WIDTH * column : _WIDTH * (column + 1)]
