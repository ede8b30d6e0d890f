"""The grammar of numbers that a person types: numbers, lists and ranges, each with a unit if wanted.

    number   12   -0.25   1e-3   60 mm   2.5Hz
    list     12.5 15 17.5          separated by spaces
    range    12:21:4   2:4:5Hz     start:stop:count, ascending, decimal ends taken exactly

Command line, form, configuration and protocol files read every number through this module, so that none of them
understands a text that another refuses. A comma never separates anything: 0,25 would otherwise be 0 and 25.
"""

import re
from collections.abc import Sequence
from fractions import Fraction
from math import isfinite

MOST_VALUES = 10_000
"""Values of a range: more is a slip of the finger."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?(?![\d.])", re.ASCII)
_WHOLE = re.compile(r"[+-]?\d+", re.ASCII)
_UNIT = re.compile(r"(1/)?[A-Za-zµμΩ°%][\w/*^.µμΩ°% -]*")
_COMMA = re.compile(r"([+-]?\d*),(\d+)((?:[eE][+-]?\d+)?)", re.ASCII)

_RANGE = f"a range is start:stop:count, two different numbers and a count of 2 to {MOST_VALUES}"


def spaced(start: str, stop: str, count: int) -> tuple[float, ...]:
    """`count` (2 or more) equally spaced numbers; decimal ends are taken exactly, so 0.1 to 1.2 has 0.3 in it.

    Raises ValueError for text that is no finite number.
    """
    first, last = Fraction(start), Fraction(stop)
    return tuple(float(first + (last - first) * k / (count - 1)) for k in range(count))


def read_number(text: str, unit: str = "1", *, whole: bool = False) -> float:
    """One number in the SI `unit`, converted where the text carries another; an int when `whole`.

    Raises ValueError that says what to write instead; without a message where the text is nothing like a number.
    """
    digits, typed = _parted(text)
    value = _plain(digits) if not typed else _converted(digits, typed, unit)
    if not whole:
        return value
    if typed and value == round(value):
        return round(value)
    if _WHOLE.fullmatch(digits) is None:
        raise ValueError
    return int(digits)


def read_values(text: str, unit: str = "1", *, whole: bool = False) -> list[float]:
    """The values of one item of a list, in the SI `unit`: a number, or those of a range. Raises ValueError likewise."""
    if ":" not in text:
        return [read_number(text, unit, whole=whole)]
    start, stop, count, *more = (*(part.strip() for part in text.split(":")), "", "")
    count, typed = _parted(count) if _NUMBER.match(count) else (count, "")
    ends = start, stop
    if any((found := _NUMBER.match(end)) and _UNIT.fullmatch(end[found.end() :].strip()) for end in ends):
        raise ValueError(f"{_RANGE}; its unit stands at the end: 2:4:5Hz")
    if any(more) or any(_NUMBER.fullmatch(end) is None for end in ends) or _WHOLE.fullmatch(count) is None:
        for part in (start, stop, count):
            _refuse_comma(part)
        raise ValueError(_RANGE)
    first, last, n = _plain(start), _plain(stop), int(count)
    if not 2 <= n <= MOST_VALUES or first == last:
        raise ValueError(_RANGE)
    if first > last:
        raise ValueError(f"the range descends: write {stop}:{start}:{count}{typed}")
    if typed:
        return [_converted(repr(value), typed, unit) for value in spaced(start, stop, n)]
    values = list(spaced(start, stop, n))
    if whole:
        if any(value != round(value) for value in values):
            raise ValueError("not all values of this range are whole numbers")
        return [round(value) for value in values]
    return values


def items_of(tokens: Sequence[str]) -> list[str]:
    """The items of a list as it was typed, each a number or a range with its unit; an empty token is an empty item.

    Spaces separate items within a token too, except in front of a unit: "2.5 Hz 3 Hz" has two.
    """
    items: list[str] = []
    for token in tokens:
        own: list[str] = []
        for word in token.split():
            if own and _UNIT.fullmatch(word) and _NUMBER.match(own[-1]) and not carries_unit(own[-1]):
                own[-1] = f"{own[-1]} {word}"
            else:
                own.append(word)
        items += own or [""]
    return items


def require_units_alike(items: Sequence[str]) -> None:
    """Raise ValueError when some items of a list carry a unit and others do not."""
    given = [carries_unit(item) for item in items if _NUMBER.match(item)]
    if any(given) and not all(given):
        raise ValueError("give every value its unit, or none of them")


def read_band(text: str, unit: str = "Hz") -> tuple[float, float]:
    """Two ascending positive numbers LOW:HIGH in `unit`, with a unit at the end if wanted. Raises ValueError."""
    low, colon, high = text.partition(":")
    digits, typed = _parted(high.strip())
    for part in (low, digits):
        _refuse_comma(part)
    ends = [read_number(f"{part.strip()}{typed}", unit) for part in (low, digits)]
    if not colon or not 0.0 < ends[0] < ends[1]:
        raise ValueError
    return ends[0], ends[1]


def carries_unit(text: str) -> bool:
    """Whether a text is a number, or a range, with a unit behind it."""
    last = text.rpartition(":")[2].strip()
    return (found := _NUMBER.match(last)) is not None and _UNIT.fullmatch(last[found.end() :].strip()) is not None


def _parted(text: str) -> tuple[str, str]:
    """Digits and unit of a text. Raises ValueError, with what to write instead where that can be told."""
    text = text.strip()
    if not text:
        raise ValueError("there is no value: leave it out, or give a number")
    _refuse_comma(text)
    if (found := _NUMBER.match(text)) is None:
        raise ValueError
    unit = text[found.end() :].strip()
    if re.fullmatch(r"[eE][+-]?\d+", unit):
        raise ValueError("it is beyond what a number can be")
    if re.fullmatch(r"[+-]?(0[xXbBoO]\w+|\d+([_ ]\d\w*)+)", text, re.ASCII):
        raise ValueError("write a decimal number: digits, a point, and an exponent such as e-3")
    if unit and _UNIT.fullmatch(unit) is None:
        raise ValueError
    return found[0], unit


def _refuse_comma(text: str) -> None:
    if "," not in text:
        return
    found = _COMMA.match(text.strip())
    if found is None:
        raise ValueError("a comma separates nothing here: separate values by spaces")
    raise ValueError(f"write {found[1] or '0'}.{found[2]}{found[3]}; separate values by spaces")


def _plain(digits: str) -> float:
    value = float(digits)
    if not isfinite(value):
        raise ValueError("it is beyond what a number can be")
    return value


def _converted(digits: str, typed: str, unit: str) -> float:
    if typed == unit:
        return _plain(digits)
    # pint takes most of a second to load: only for a value that carries another unit than its own
    from bench.config.units import converted

    return converted(digits, typed, unit)
