"""The grammar of typed numbers: numbers, lists and ranges, each with an optional unit.

    number   12   -0.25   1e-3   60 mm   2.5Hz
    list     12.5 15 17.5          separated by spaces
    range    12:21:4   2:4:5Hz     start:stop:count, ascending, decimal ends exact

The command line, the window's form, protocol files and numbers with units in configuration files share this notation.
A comma is never a separator: 0,25 would otherwise be 0 and 25.

pint converts units, except between frequencies in Hz and angular frequencies, which are converted explicitly with 2 pi:
pint treats the radian as a pure number.
"""

import re
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from functools import cache
from math import isfinite, tau
from typing import Any, cast


def converted(digits: str, typed: str, unit: str) -> float:
    """Convert the decimal number `digits` from the unit `typed` to the declared `unit` ("1" for a pure number).

    Raises ValueError, with a remedy, if the typed unit is unknown or has another dimension, if the value may have no
    unit (`unit` is empty), or if it exceeds the range of floating-point numbers.
    """
    if unit == "":
        raise ValueError(f"it must be a number without a unit: remove {typed!r}")
    factor = _factor(typed, unit)
    # in decimal arithmetic, so that 57 mm is exactly 0.057
    value = float(Decimal(digits) * Decimal(repr(factor)))
    if not isfinite(value):
        raise ValueError("it exceeds the range of floating-point numbers")
    return value


@cache
def _factor(typed: str, unit: str) -> float:
    factor, root = _root(typed)
    wanted, base = _root(unit)
    if root == base:
        return factor / wanted
    cycles, angular = {"1 / second"}, {"radian / second"}
    if root in cycles and base in angular and _in_hertz(typed):
        return factor * tau / wanted
    if root in angular and base in cycles and _in_hertz(unit):
        return factor / tau / wanted
    hint = {("gram", "m/s2"): " (g is the gram; the acceleration of gravity is g_0)"}.get((_name(typed), unit), "")
    what = "a pure number, or a value in %" if unit == "1" else f"a value in {unit} or in a unit of the same dimension"
    raise ValueError(f"{typed} ({root or '1'}) does not have the dimension of {unit} ({base or '1'}): use {what}{hint}")


def _root(unit: str) -> tuple[float, str]:
    """Conversion factor to base units, and the base units as a string; the radian counts as a base unit."""
    import pint

    try:
        factor, root = _registry().get_root_units(_registry().parse_units(_as_pint(unit)))
    except (pint.PintError, ValueError, TypeError, ArithmeticError, AttributeError):
        raise ValueError(f"{unit!r} is an unknown unit: use one such as mm, N/mm, m/s^2, Hz or deg") from None
    # pint's base unit of mass is the gram; SI users expect the kilogram, and the factor of 1000 cancels
    text = str(root).replace("gram", "kilogram")
    return float(factor), "" if text == "dimensionless" else text


def _name(unit: str) -> str:
    return str(_registry().parse_units(_as_pint(unit)))


def _in_hertz(unit: str) -> bool:
    return "hertz" in _name(unit)


def _as_pint(unit: str) -> str:
    """A declared or typed unit in pint's notation: V s2/m is V*s**2/m."""
    text = "" if unit == "1" else unit.strip().replace("Ω", "ohm").replace("°", "degree").replace("^", "**")
    text = re.sub(r"(?<=[A-Za-zµμ])(\d)", r"**\1", text)
    return re.sub(r"(?<=[\w)])\s+(?=[A-Za-zµμ])", "*", text)


@cache
def _registry() -> Any:
    import pint

    return cast(Any, pint.UnitRegistry())


MOST_VALUES = 10_000
"""Largest number of values in a range; a larger number is treated as a typing error."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?(?![\d.])", re.ASCII)
_WHOLE = re.compile(r"[+-]?\d+", re.ASCII)
_UNIT = re.compile(r"(1/)?[A-Za-zµμΩ°%][\w/*^.µμΩ°% -]*")
_COMMA = re.compile(r"([+-]?\d*),(\d+)((?:[eE][+-]?\d+)?)", re.ASCII)

_RANGE = f"a range is start:stop:count, two different numbers and a count of 2 to {MOST_VALUES}"


def spaced(start: str, stop: str, count: int) -> tuple[float, ...]:
    """`count` (2 or more) equally spaced numbers; decimal ends are exact, so 0.1 to 1.2 can contain exactly 0.3.

    Raises ValueError for text that is not a finite number.
    """
    first, last = Fraction(start), Fraction(stop)
    return tuple(float(first + (last - first) * k / (count - 1)) for k in range(count))


def read_number(text: str, unit: str = "1", *, whole: bool = False) -> float:
    """One number in the SI `unit`, converted from the unit in the text, if any; an int if `whole`.

    Raises ValueError, with a remedy if the cause is recognised and otherwise without a message.
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
    """The values of one list item, a number or a range, in the SI `unit`. Raises ValueError like `read_number`."""
    if ":" not in text:
        return [read_number(text, unit, whole=whole)]
    start, stop, count, *more = (*(part.strip() for part in text.split(":")), "", "")
    count, typed = _parted(count) if _NUMBER.match(count) else (count, "")
    ends = start, stop
    if any((found := _NUMBER.match(end)) and _UNIT.fullmatch(end[found.end() :].strip()) for end in ends):
        raise ValueError(f"{_RANGE}; its unit goes at the end: 2:4:5Hz")
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
            raise ValueError("not all values of this range are integers")
        return [round(value) for value in values]
    return values


def items_of(tokens: Sequence[str]) -> list[str]:
    """The items of a typed list, each a number or a range with its unit, if any; an empty token gives an empty item.

    Spaces also separate items within a token, except before a unit: "2.5 Hz 3 Hz" has two items.
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
    """Raise ValueError if only some items of a list have a unit."""
    given = [carries_unit(item) for item in items if _NUMBER.match(item)]
    if any(given) and not all(given):
        raise ValueError("add a unit to every value, or to none")


def read_band(text: str, unit: str = "Hz") -> tuple[float, float]:
    """Two ascending positive numbers LOW:HIGH in `unit`, with an optional unit at the end. Raises ValueError for
    any other text.
    """
    low, colon, high = text.partition(":")
    digits, typed = _parted(high.strip())
    for part in (low, digits):
        _refuse_comma(part)
    ends = [read_number(f"{part.strip()}{typed}", unit) for part in (low, digits)]
    if not colon or not 0.0 < ends[0] < ends[1]:
        raise ValueError
    return ends[0], ends[1]


def carries_unit(text: str) -> bool:
    """Whether a text is a number or a range followed by a unit."""
    last = text.rpartition(":")[2].strip()
    return (found := _NUMBER.match(last)) is not None and _UNIT.fullmatch(last[found.end() :].strip()) is not None


def _parted(text: str) -> tuple[str, str]:
    """Digits and unit of a typed number. Raises ValueError, with a remedy if the cause is recognised."""
    text = text.strip()
    if not text:
        raise ValueError("there is no value: remove the item, or enter a number")
    _refuse_comma(text)
    if (found := _NUMBER.match(text)) is None:
        raise ValueError
    unit = text[found.end() :].strip()
    if re.fullmatch(r"[eE][+-]?\d+", unit):
        raise ValueError("it exceeds the range of floating-point numbers")
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
        raise ValueError("a comma is not a separator: separate values by spaces")
    raise ValueError(f"write {found[1] or '0'}.{found[2]}{found[3]}; separate values by spaces")


def _plain(digits: str) -> float:
    value = float(digits)
    if not isfinite(value):
        raise ValueError("it exceeds the range of floating-point numbers")
    return value


def _converted(digits: str, typed: str, unit: str) -> float:
    if typed == unit:
        return _plain(digits)
    # only if the units differ, because pint is slow to load
    return converted(digits, typed, unit)
