"""Units of acceleration and their spellings."""

import re

from sim.errors import InvalidInput

STANDARD_GRAVITY = 9.80665
"""1 g [m/s2], exact. Source: 3rd General Conference on Weights and Measures, 1901."""

UNITS = {"m/s2": 1.0, "cm/s2": 0.01, "mm/s2": 0.001, "gal": 0.01, "g": STANDARD_GRAVITY}
"""Value of each unit in m/s2."""

_SPELLINGS = {"g's": "g", "gals": "gal"}


def spelled(text: str) -> str | None:
    """The unit of `UNITS` denoted by `text` (`cm/sec/sec`, `CM/S^2`, `m/s**2`), or None."""
    # a superscript two in Latin-1, and in UTF-8 read as Latin-1
    word = re.sub("\u00e2\u00b2|\u00b2", "2", text.strip().lower())
    word = re.sub(r"\s+|\*\*|\^|[.,;]$", "", word).replace("sec", "s").replace("/s/s", "/s2")
    word = _SPELLINGS.get(word, word)
    return word if word in UNITS else None


def unit_of(text: str, item: str) -> str:
    """The unit specified by a user. Raises InvalidInput naming `item`."""
    unit = spelled(text)
    if unit is None:
        raise InvalidInput(item, text, f"it must be one of {', '.join(UNITS)}")
    return unit
