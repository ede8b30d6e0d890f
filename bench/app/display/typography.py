"""Typography of the displays: symbols, names of fields, and displayed units."""

import re

from bench.document import typography
from bench.document.typography import unit_text


def typeset(text: str) -> str:
    """Typeset text from files and journals for the window: ω, α₂, ±, m/s²."""
    return typography.typeset(text).replace("Ω", "ω")


_NAME = re.compile(r"(?<=[A-Za-z0-9])_(?=[A-Za-z0-9])")


def spaced(text: str) -> str:
    """Typeset text that contains names of fields or channels, with spaces instead of underscores."""
    return typeset(_NAME.sub(" ", text))


_SCREEN = {"m": (1e3, "mm"), "um": (1.0, "µm")}


def in_screen_unit(unit: str) -> tuple[float, str]:
    """Displayed units per SI `unit`, and the displayed unit, typeset: millimetres for lengths."""
    factor, shown = _SCREEN.get(unit, (1.0, unit))
    return factor, unit_text(shown)
