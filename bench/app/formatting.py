"""Formatting of numbers and text for display."""

from math import floor, isfinite, log10

ABSENT = "-"
"""Placeholder for a missing value."""


def clock(seconds: float) -> str:
    """Minutes and seconds, with hours if not zero: `4:07`, `1:02:30`; `ABSENT` when not finite."""
    if not isfinite(seconds):
        return ABSENT
    minutes, rest = divmod(round(max(seconds, 0.0)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def number(value: float | None) -> str:
    """Four significant digits; `ABSENT` for None and values that are not finite."""
    return ABSENT if value is None or not isfinite(value) else f"{value:#.4g}".rstrip(".")


def setpoint(value: float | None) -> str:
    """A requested value in short form: `12.5`."""
    return ABSENT if value is None or not isfinite(value) else f"{value:g}"


def plus_minus(value: float | None, uncertainty: float | None) -> str:
    """A value and its uncertainty, rounded to the second significant digit of the uncertainty: `0.8263 ± 0.0041`."""
    if value is None or not isfinite(value) or uncertainty is None or not isfinite(uncertainty) or uncertainty <= 0:
        return number(value)
    places = min(max(1 - floor(log10(uncertainty)), 0), 6)
    return f"{value:.{places}f} ± {uncertainty:.{places}f}"


def difference(value: float | None, reference: float | None) -> str:
    """Deviation of `value` from `reference`, in per cent of the reference: `+0.4 %`."""
    if value is None or not reference or not (isfinite(value) and isfinite(reference)):
        return ABSENT
    return f"{100.0 * (value / reference - 1.0):+z.1f} %"


def measurement(value: float, uncertainty: float, unit: str) -> str:
    """A value with its uncertainty and unit: `(12.31 ± 0.04) mm`; a pure number has no unit."""
    text = plus_minus(value, uncertainty)
    if unit in ("", "1") or text == ABSENT:
        return text
    return f"({text}) {unit}" if "±" in text else f"{text} {unit}"


def as_typed(value: object) -> str:
    """A value in the notation of the command line."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def one_line(text: str) -> str:
    """The text without line breaks and control characters, which would disturb a terminal or a log."""
    return "".join(character for character in " ".join(text.split()) if character.isprintable())
