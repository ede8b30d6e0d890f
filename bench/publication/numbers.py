"""Numbers as a report prints them: as many digits as the uncertainty leaves, and never a bare one."""

from math import isfinite

from bench.analysis.rounding import decimals, plus_minus
from bench.publication.typography import raised

ABSENT = "–"
MINUS = "−"


def plain(value: float | None, digits: int = 4) -> str:
    """To so many significant digits; a dash where it is absent."""
    if value is None or not isfinite(value):
        return ABSENT
    text = f"{value:.{digits}g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa}·10{raised(int(exponent))}"
    return text.replace("-", MINUS)


def with_uncertainty(value: float | None, uncertainty: float | None) -> str:
    """`value` ± `uncertainty`, the latter to two significant digits and the former to the same decimal place."""
    if value is None or not isfinite(value):
        return ABSENT
    if uncertainty is None or decimals(uncertainty) is None:
        return plain(value)
    return plus_minus(value, uncertainty, "±").replace("-", MINUS)


def percent(share: float | None, places: int = 2) -> str:
    """A share in percent, with its sign."""
    if share is None or not isfinite(share):
        return ABSENT
    return f"{100.0 * share:+.{places}f}".replace("-", MINUS)


def yes_or_no(value: bool | None) -> str:
    """A truth value as a word."""
    return ABSENT if value is None else "yes" if value else "NO"
