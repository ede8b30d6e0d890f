"""Typography of the displays: symbols, names of fields, and displayed units."""

import re

from bench.document import typography
from bench.document.typography import unit_text


def typeset(text: str) -> str:
    """Typeset text from files and journals for the window: ω, α₂, ±, m/s²."""
    return typography.typeset(text).replace("Ω", "ω")


_LETTERS = {"alpha": "α", "beta": "β", "xi": "ξ", "omega": "ω"}
_SYMBOL = re.compile(r"\b(alpha|beta|xi|omega|k|c|m)([0-9]?)\b")
_LOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_NAME = re.compile(r"(?<=[A-Za-z0-9])_(?=[A-Za-z0-9])")


def spaced(text: str) -> str:
    """Typeset text that contains names of fields or channels, with spaces instead of underscores."""
    return typeset(_NAME.sub(" ", text))


def label(name: str) -> str:
    """Typeset the name of a field or channel for the window: `alpha_2_low` becomes α₂ low, `xi1` ξ₁."""
    plain = name.removesuffix("_rad_s").replace("alpha_1", "α₁").replace("alpha_2", "α₂").replace("_", " ")
    return typeset(_SYMBOL.sub(lambda found: _LETTERS.get(found[1], found[1]) + found[2].translate(_LOW), plain))


_SCREEN = {"m": (1e3, "mm"), "um": (1.0, "µm")}


def in_screen_unit(unit: str) -> tuple[float, str]:
    """Displayed units per SI `unit`, and the displayed unit, typeset: millimetres for lengths."""
    factor, shown = _SCREEN.get(unit, (1.0, unit))
    return factor, unit_text(shown)
