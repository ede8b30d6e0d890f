"""How many digits a value deserves: those of its uncertainty, which has two (GUM:2008, 7.2.6)."""

from math import floor, isfinite, log10


def decimals(uncertainty: float) -> int | None:
    """Decimal places up to the second digit of an uncertainty; None for one that says nothing."""
    if not (isfinite(uncertainty) and uncertainty > 0.0):
        return None
    return max(1 - floor(log10(uncertainty)), 0)


def plus_minus(value: float, uncertainty: float, sign: str = "+-") -> str:
    """A value with its uncertainty, as in 213.44 +- 0.32; the value alone, where that says nothing."""
    places = decimals(uncertainty)
    return f"{value:.6g}" if places is None else f"{value:.{places}f} {sign} {uncertainty:.{places}f}"


def in_brackets(value: float, uncertainty: float) -> str:
    """A value with its uncertainty in units of the last digits, as in 213.44(16); alone, where that says nothing."""
    places = decimals(uncertainty)
    return f"{value:.6g}" if places is None else f"{value:.{places}f}({round(uncertainty * 10.0**places):d})"
