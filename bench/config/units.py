"""Conversion of values with a unit to the SI unit in which a parameter is declared, by pint.

Angles keep their unit: a frequency in Hz given to an angular frequency, or the other way, is converted by 2 pi
explicitly, where pint itself takes the radian for a pure number.
"""

import re
from decimal import Decimal
from functools import cache
from math import isfinite, tau
from typing import Any, cast


def converted(digits: str, typed: str, unit: str) -> float:
    """The decimal number `digits` in the unit `typed`, in the declared `unit` ("1" for a pure number).

    Raises ValueError naming both for a unit of another dimension, and for one that is not known.
    """
    if unit == "":
        raise ValueError(f"it has no unit: leave {typed!r} out")
    factor = _factor(typed, unit)
    # in decimals, so that 57 mm is the same number as 0.057
    value = float(Decimal(digits) * Decimal(repr(factor)))
    if not isfinite(value):
        raise ValueError("it is beyond what a number can be")
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
    what = "a pure number, or in %" if unit == "1" else f"in {unit}, or in a unit of its dimension"
    raise ValueError(f"{typed} ({root or '1'}) is not of the dimension of {unit} ({base or '1'}): give it {what}{hint}")


def _root(unit: str) -> tuple[float, str]:
    """Factor to base units, and these as text; the radian is one of them."""
    import pint

    try:
        factor, root = _registry().get_root_units(_registry().parse_units(_as_pint(unit)))
    except (pint.PintError, ValueError, TypeError, ArithmeticError, AttributeError):
        raise ValueError(f"{unit!r} is no unit that is known: write it as mm, N/mm, m/s^2, Hz or deg") from None
    # pint's root of mass is the gram; a reader of SI expects the kilogram, and the factor cancels
    text = str(root).replace("gram", "kilogram")
    return float(factor), "" if text == "dimensionless" else text


def _name(unit: str) -> str:
    return str(_registry().parse_units(_as_pint(unit)))


def _in_hertz(unit: str) -> bool:
    return "hertz" in _name(unit)


def _as_pint(unit: str) -> str:
    """A unit as it is declared here or written by hand, in pint's words: V s2/m is V*s**2/m."""
    text = "" if unit == "1" else unit.strip().replace("Ω", "ohm").replace("°", "degree").replace("^", "**")
    text = re.sub(r"(?<=[A-Za-zµμ])(\d)", r"**\1", text)
    return re.sub(r"(?<=[\w)])\s+(?=[A-Za-zµμ])", "*", text)


@cache
def _registry() -> Any:
    import pint

    return cast(Any, pint.UnitRegistry())
