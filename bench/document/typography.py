"""Typography of a report: numbers with uncertainties, symbols, units, dates, singular and plural nouns."""

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
    "k1": "k₁",
    "k2": "k₂",
    "lambda": "λ",
    "omega": "Ω",
    "r_exp": "rₑₓₚ",
    "r_th": "rₜₕ",
    "theta": "ϑ",
    "u1": "u₁",
    "u2": "u₂",
    "xi1": "ξ₁",
    "xi2": "ξ₂",
}
_WORDS = re.compile(rf"(?<![\w.`-])({'|'.join(_SYMBOLS)})(?![\w:`]|\.\w)")
"""Stand-alone symbols, which are not part of a key, flag or file name."""

_UNIT = re.compile(r"(?:(?<=/s)2|(?<=/m)[23]|(?<=kg m)2|(?<= s)2(?=/))(?!\w|\.\d)")
"""Powers within a unit; m2 alone is excluded because it may be a mass."""

_ROOT = re.compile(r"\bsqrt\((\w+)\)")
_POWER = re.compile(r"(?<=[a-z])([23])(?!\d)")
_RAISING = re.compile(r"(?<=\w)\^([23])(?!\d)")
_RAISED = {"2": "²", "3": "³"}
_DIGITS = str.maketrans("0123456789-−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁻")

_DETAIL = (" (", "; ", ": ")
"""Separators between the first words of a description and its details."""

_NAME = re.compile(r"(?<![\w.`/\\'\"-])(?![a-z]_[a-z]{1,2}\b)[a-z][a-z0-9]*(?:_[a-z0-9]+)+(?![\w`/\\'\"=-]|\.\w)")
"""Names of channels, parameters and fields within a text, such as laser_1, but not h_b, a key or a file."""

_SUFFIX = re.compile(r"_(?:rad_s|rad|n_m|m_s2|hz)$")
"""Units at the end of the name of a field."""

_SMALL = re.compile(r"(?<=\d )u(?=[ms](?:\W|$))")
"""The letter u as the prefix micro, in micrometres and microseconds."""


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
    """A ratio in percent, with its sign; a dash if absent."""
    if share is None or not isfinite(share):
        return ABSENT
    return f"{100.0 * share:+.{places}f}".replace("-", MINUS)


def yes_or_no(value: bool | None) -> str:
    """A Boolean as the word yes or NO; a dash if absent."""
    return ABSENT if value is None else "yes" if value else "NO"


def unit_text(unit: str) -> str:
    """A unit with raised powers: m/s² for `m/s2`, √Hz for `Hz^0.5`."""
    return _POWER.sub(lambda found: _RAISED[found[1]], unit).replace("Hz^0.5", "√Hz")


def without_unit(name: str, unit: str) -> str:
    """Name of a field without the suffix that repeats its unit: `k1_n_m` in N/m becomes k1."""
    suffix = unit.lower().replace("1/", "per_").replace("/", "_").replace(" ", "_").replace("^0.5", "")
    return name.removesuffix(f"_{suffix}") if suffix not in ("", "1") else name


def typeset(text: str) -> str:
    """A line of a journal or summary with typeset symbols, units and signs (α₂, Ω, m/s², ±), and with the names of
    channels and parameters as words (laser 1).
    """
    text = _WORDS.sub(lambda found: _SYMBOLS[found[1]], text.replace("+-", "±"))
    text = _SMALL.sub("µ", _NAME.sub(lambda found: _printed(found[0]), text))
    text = re.sub(r"(?<=\d)%", " %", text).replace("Hz^0.5", "√Hz")
    text = _ROOT.sub(lambda found: f"√{found[1]}", text)
    text = _RAISING.sub(lambda found: _RAISED[found[1]], text)
    return _UNIT.sub(lambda found: _RAISED[found[0]], text)


def _printed(name: str) -> str:
    """A name as words without its unit, typeset if it is a symbol: α₂ low for `alpha_2_low`."""
    words = _SUFFIX.sub("", name)
    symbol = next((each for each in _SYMBOLS if words == each or words.startswith(f"{each}_")), "")
    return _SYMBOLS.get(symbol, "") + words[len(symbol) :].replace("_", " ")


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
    """A number with its noun in the singular or plural: 1 point, 2 points."""
    return f"{number} {one if number == 1 else more or one + 's'}"


def listed(items: list[str]) -> str:
    """Items as an enumeration: a, b and c."""
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}" if items else ""


def first_words(description: str) -> str:
    """First words of the description of a parameter, without its details."""
    ends = [at for mark in _DETAIL if (at := description.find(mark)) > 0]
    return typeset(description[: min(ends, default=len(description))])


_LETTERS = {"alpha": "α", "beta": "β", "xi": "ξ", "omega": "ω"}
_IN_NAME = re.compile(r"\b(alpha|beta|xi|omega|k|c|m)([0-9]?)\b")
_LOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def label(name: str) -> str:
    """Typeset the name of a field or channel: `alpha_2_low` becomes α₂ low, `xi1` ξ₁."""
    plain = name.removesuffix("_rad_s").replace("alpha_1", "α₁").replace("alpha_2", "α₂").replace("_", " ")
    return typeset(_IN_NAME.sub(lambda found: _LETTERS.get(found[1], found[1]) + found[2].translate(_LOW), plain))
