"""How a report writes what files and terminals have in plain letters: symbols, units, dates, counted words."""

import re
from datetime import datetime, timedelta

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
"""Symbols that stand by themselves, not as part of a key, a flag or a file's name."""

_UNIT = re.compile(r"(?:(?<=/s)2|(?<=/m)[23]|(?<=kg m)2)(?!\w|\.\d)")
"""Powers within a unit; m2 by itself may be a mass."""

_POWER = re.compile(r"(?<=[a-z])([23])(?!\d)")
_RAISED = {"2": "²", "3": "³"}
_DIGITS = str.maketrans("0123456789-−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁻")


def unit_text(unit: str) -> str:
    """A unit with raised powers: m/s² for `m/s2`, √Hz for `Hz^0.5`."""
    return _POWER.sub(lambda found: _RAISED[found[1]], unit).replace("Hz^0.5", "√Hz")


def typeset(text: str) -> str:
    """A line of a journal or a summary with symbols, units and signs as they are printed: α₂, Ω, m/s², ±."""
    text = _WORDS.sub(lambda found: _SYMBOLS[found[1]], text.replace("+-", "±"))
    text = re.sub(r"(?<=\d)%", " %", text)
    return _UNIT.sub(lambda found: _RAISED[found[0]], text)


def raised(power: int) -> str:
    """A power in raised digits, such as ⁻⁷."""
    return str(power).translate(_DIGITS)


def moment(iso: str) -> str:
    """Date and time of day of an ISO 8601 time, to the second, with its zone; another text as it is."""
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
    """Items in a sentence: a, b and c."""
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}" if items else ""
