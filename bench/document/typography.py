"""Typography of a report: numbers with uncertainties, symbols, units, dates, counted nouns."""

import re
from datetime import datetime, timedelta
from math import isfinite

from bench.analysis.uncertainty import decimals, plus_minus

ABSENT = "–"
MINUS = "−"

_SYMBOLS = {
    "alpha_1": "α₁",
    "alpha_2": "α₂",
    "beta": "β",
    "lambda": "λ",
    "omega": "Ω",
    "theta": "ϑ",
    "u1": "u₁",
    "u2": "u₂",
}
_WORDS = re.compile(rf"(?<![\w.`-])({'|'.join(_SYMBOLS)})(?![\w:`]|\.\w)")
"""Stand-alone symbols, which are not part of a key, flag or file name."""

_UNIT = re.compile(r"(?:(?<=/s)2|(?<=/m)[23]|(?<=kg m)2)(?!\w|\.\d)")
"""Powers within a unit; m2 alone is excluded because it may be a mass."""

_POWER = re.compile(r"(?<=[a-z])([23])(?!\d)")
_RAISED = {"2": "²", "3": "³"}
_DIGITS = str.maketrans("0123456789-−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁻")

_DETAIL = (" (", "; ", ": ")
"""Separators between the first words of a description and its details."""

_NAME = re.compile(r"(?<=[a-z]{4})_(?=[a-z]{3})")
"""Underscores in names of parameters within a description, such as heating_time, but not in h_b."""


def plain(value: float | None, digits: int = 4) -> str:
    """A number with the given number of significant digits; a dash if absent."""
    if value is None or not isfinite(value):
        return ABSENT
    text = f"{value:.{digits}g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa}·10{str(int(exponent)).translate(_DIGITS)}"
    return text.replace("-", MINUS)


def with_uncertainty(value: float | None, uncertainty: float | None) -> str:
    """`value` ± `uncertainty`, the latter to two significant digits and the former to the same decimal place."""
    if value is None or not isfinite(value):
        return ABSENT
    if uncertainty is None or decimals(uncertainty) is None:
        return plain(value)
    return plus_minus(value, uncertainty, "±").replace("-", MINUS)


def percent(share: float | None, places: int = 2) -> str:
    """A ratio in percent, with its sign."""
    if share is None or not isfinite(share):
        return ABSENT
    return f"{100.0 * share:+.{places}f}".replace("-", MINUS)


def yes_or_no(value: bool | None) -> str:
    """A Boolean as a word."""
    return ABSENT if value is None else "yes" if value else "NO"


def unit_text(unit: str) -> str:
    """A unit with raised powers: m/s² for `m/s2`, √Hz for `Hz^0.5`."""
    return _POWER.sub(lambda found: _RAISED[found[1]], unit).replace("Hz^0.5", "√Hz")


def without_unit(name: str, unit: str) -> str:
    """Name of a field without the suffix that repeats its unit: `k1_n_m` in N/m becomes k1."""
    suffix = unit.lower().replace("1/", "per_").replace("/", "_").replace(" ", "_").replace("^0.5", "")
    return name.removesuffix(f"_{suffix}") if suffix not in ("", "1") else name


def typeset(text: str) -> str:
    """A line of a journal or a summary with typeset symbols, units and signs: α₂, Ω, m/s², ±."""
    text = _WORDS.sub(lambda found: _SYMBOLS[found[1]], text.replace("+-", "±"))
    text = re.sub(r"(?<=\d)%", " %", text)
    return _UNIT.sub(lambda found: _RAISED[found[0]], text)


def moment(iso: str) -> str:
    """Date and time of an ISO 8601 string, to the second, with time zone; any other string unchanged."""
    try:
        found = datetime.fromisoformat(iso)
    except ValueError:
        return iso
    text, zone = found.strftime("%Y-%m-%d %H:%M:%S"), found.strftime("%z")
    if not zone:
        return text
    return f"{text} UTC" if found.utcoffset() == timedelta(0) else f"{text} UTC{zone[:3]}:{zone[3:5]}"


def counted(number: int, one: str, more: str = "") -> str:
    """A number with its noun: 1 point, 2 points."""
    return f"{number} {one if number == 1 else more or one + 's'}"


def listed(items: list[str]) -> str:
    """Items as an enumeration: a, b and c."""
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}" if items else ""


def first_words(description: str) -> str:
    """First words of the description of a parameter, without its details."""
    ends = [at for mark in _DETAIL if (at := description.find(mark)) > 0]
    return typeset(_NAME.sub(" ", description[: min(ends, default=len(description))]))
