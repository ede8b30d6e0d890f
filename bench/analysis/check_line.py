"""One line of the bench check: measured value, tolerance and remedy."""

from enum import StrEnum
from math import isfinite

from sim.parameters import Parameters, quantity


class Verdict(StrEnum):
    """Verdict of a line: within or outside its tolerance, without a tolerance, or not measured."""

    PASSED = "passed"
    FAILED = "failed"
    STATED = "stated"
    """Verdict for a line that has no tolerance."""
    UNTESTED = "untested"


OWN_UNIT = "any"
"""Placeholder in the declarations of a line's numbers; `unit` states their actual unit."""


class CheckLine(Parameters):
    """One line of the bench check. Its numbers are in the unit `unit`; missing values are None."""

    subject: str = quantity(..., "", "channel or part of the bench that is checked")
    what: str = quantity(..., "", "measured property")
    verdict: Verdict = quantity(..., "", "verdict of the line")
    measured: float | None = quantity(None, OWN_UNIT, "measured value, in `unit`")
    uncertainty: float | None = quantity(None, OWN_UNIT, "expanded uncertainty (k = 2), in `unit`")
    expected: float | None = quantity(None, OWN_UNIT, "expected value, in `unit`")
    lowest: float | None = quantity(None, OWN_UNIT, "lowest value that passes, in `unit`")
    highest: float | None = quantity(None, OWN_UNIT, "highest value that passes, in `unit`")
    unit: str = quantity("1", "", "unit of the numbers in this line")
    remedy: str = quantity("", "", "remedy if the line has not passed")


def judged(
    subject: str,
    what: str,
    measured: float,
    allowed: tuple[float, float],
    unit: str,
    remedy: str,
    *,
    expected: float | None = None,
    uncertainty: float | None = None,
) -> CheckLine:
    """A line that passes if the measured value is within `allowed` (lowest, highest), limits included; the highest may
    be infinite.
    """
    lowest, highest = allowed
    passed = lowest <= measured <= highest
    return CheckLine(
        subject=subject,
        what=what,
        verdict=Verdict.PASSED if passed else Verdict.FAILED,
        measured=measured,
        uncertainty=uncertainty,
        expected=expected,
        lowest=lowest,
        highest=highest if isfinite(highest) else None,
        unit=unit,
        remedy="" if passed else remedy,
    )


def stated(
    subject: str,
    what: str,
    measured: float,
    unit: str,
    *,
    expected: float | None = None,
    uncertainty: float | None = None,
) -> CheckLine:
    """A line with a measured value but no tolerance."""
    return CheckLine(
        subject=subject,
        what=what,
        verdict=Verdict.STATED,
        measured=measured,
        expected=expected,
        uncertainty=uncertainty,
        unit=unit,
    )


def passed(subject: str, what: str) -> CheckLine:
    """A line that has passed and has no number."""
    return CheckLine(subject=subject, what=what, verdict=Verdict.PASSED)


def failed(subject: str, what: str, remedy: str) -> CheckLine:
    """A line that has failed and has no number."""
    return CheckLine(subject=subject, what=what, verdict=Verdict.FAILED, remedy=remedy)


def untested(subject: str, what: str, remedy: str) -> CheckLine:
    """A line for a quantity that could not be measured, with the remedy."""
    return CheckLine(subject=subject, what=what, verdict=Verdict.UNTESTED, remedy=remedy)
