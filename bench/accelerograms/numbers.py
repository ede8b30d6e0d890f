"""Reader of a block of numbers that are separated by blanks or, where they touch, by the column width."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.text import RecordText

Array = NDArray[np.float64]

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][+-]?\d+)?"
"""Pattern of a decimal number in Fortran or C format, without NaN and infinity."""

_FOREIGN = re.compile(r"[^0-9EeDd+\-.\s]")


@dataclass(frozen=True, eq=False)
class Samples:
    """Numbers in the order of the file, shape (n,), and the text of each."""

    values: Array
    texts: Sequence[str]


def numbers(text: RecordText, first: int, last: int, count: int, width: int | None = None) -> Samples:
    """The `count` numbers in the lines `first` to `last` - 1, with all rows but the last of equal length.

    `width` is the column width if the format fixes it; otherwise it is determined from the numbers. Raises InvalidInput
    naming a line with unexpected content or a wrong count.
    """
    lines = [line.rstrip() for line in text.lines[first:last]]
    while lines and not lines[-1]:
        lines.pop()
    _refuse_empty(text, first, lines)
    rows = [line.split() for line in lines]
    fields = [field for row in rows for field in row]
    if _FOREIGN.search("".join(lines)) is None:
        lengths = [len(row) for row in rows]
        found = _as_samples(fields) if len(fields) == count else None
        if found is None:
            found, lengths = _columns(lines, count, width), [len(line) for line in lines]
        if found is not None:
            _refuse_gaps(text, first, lengths)
            return found
    _refuse_junk(text, first, lines, width)
    there = sum(len(re.findall(NUMBER, line)) for line in lines)
    cause = "the file is truncated: download it again" if there < count else "the file is damaged or numbers were added"
    allowed = f"number of samples in the header: {count}, numbers up to this line: {there}; {cause}"
    raise text.refusal(first + max(len(lines) - 1, 0), allowed)


def value_of(word: str) -> float:
    """Value of a string that matches `NUMBER`; Fortran exponents may begin with D."""
    return float(word.replace("D", "E").replace("d", "e"))


def place(word: str) -> float:
    """Value of one unit in the last digit of a written number."""
    mantissa, _, exponent = re.sub("[dD]", "e", word.lower()).partition("e")
    decimals = len(mantissa.partition(".")[2])
    return 10.0 ** (int(exponent or 0) - decimals)


def _as_samples(fields: list[str]) -> Samples | None:
    try:
        values = np.array(list(map(float, fields)))
    except ValueError:
        if not any("d" in field or "D" in field for field in fields):
            return None
        return _as_samples([field.replace("D", "E").replace("d", "e") for field in fields])
    return Samples(values, fields) if np.isfinite(values).all() else None


def _columns(lines: list[str], count: int, width: int | None) -> Samples | None:
    """Numbers in columns that may touch: of the given width, or of the largest width at which every cell is a
    number.
    """
    full = len(lines[0]) if lines else 0
    for candidate in range(full, 1, -1) if width is None else (width,):
        if full % candidate or any(len(line) % candidate for line in lines):
            continue
        fields = [line[k : k + candidate].strip() for line in lines for k in range(0, len(line), candidate)]
        # every cell has one decimal point at the same position; a number cut in two has none, or has it elsewhere
        decimals = {len(field.partition(".")[2]) if "." in field else None for field in fields}
        found = _as_samples(fields) if len(fields) == count and len(decimals) == 1 and None not in decimals else None
        if found is not None:
            return found
    return None


def _refuse_empty(text: RecordText, first: int, lines: list[str]) -> None:
    for index, line in enumerate(lines):
        if not line:
            raise text.refusal(
                first + index, "it is empty but more samples follow: the record has a gap; download it again"
            )


def _refuse_gaps(text: RecordText, first: int, lengths: list[int]) -> None:
    """Raise InvalidInput for a row whose length differs from that of the first; only the last row may be shorter."""
    for index, length in enumerate(lengths[1:], 1):
        if length != lengths[0] and (index < len(lengths) - 1 or length > lengths[0]):
            raise text.refusal(first + index, "its length differs from that of the rows above: samples are missing")


def _refuse_junk(text: RecordText, first: int, lines: list[str], width: int | None) -> None:
    """Raise InvalidInput for the first line that contains anything but numbers separated by blanks, signs or column
    width.
    """
    run = re.compile(rf"(?:\s*{NUMBER}(?=[\s+-]|$))+")
    for index, line in enumerate(lines):
        fields = [] if width is None else [line[k : k + width].strip() for k in range(0, len(line), width)]
        in_columns = bool(fields) and all(re.fullmatch(NUMBER, field) for field in fields)
        if run.fullmatch(line) is None and not in_columns:
            raise text.refusal(first + index, "it must contain only numbers; the file is damaged")
        for word in re.findall(NUMBER, line):
            if not np.isfinite(value_of(word)):
                raise text.refusal(first + index, f"{word} is too large for a number; the file is damaged")
