"""One line of the check: what was measured, what is allowed, and what to do when it is not so."""

from enum import StrEnum
from math import isfinite

from sim.parameters import Parameters, quantity


class Verdict(StrEnum):
    """What became of a line."""

    PASSED = "passed"
    FAILED = "failed"
    STATED = "stated"
    """There is nothing to compare it with."""
    UNTESTED = "untested"


_OWN_UNIT = "any"
"""Each row names its own unit."""


class CheckLine(Parameters):
    """One line; numbers are in the unit that the line names. What does not exist is absent (None)."""

    subject: str = quantity(..., "", "channel or part of the bench")
    what: str = quantity(..., "", "what was measured of it")
    verdict: Verdict = quantity(..., "", "whether it passed")
    measured: float | None = quantity(None, _OWN_UNIT, "measured value, in `unit`")
    uncertainty: float | None = quantity(None, _OWN_UNIT, "expanded uncertainty (k = 2), in `unit`")
    expected: float | None = quantity(None, _OWN_UNIT, "expected value, in `unit`")
    lowest: float | None = quantity(None, _OWN_UNIT, "lowest value that passes, in `unit`")
    highest: float | None = quantity(None, _OWN_UNIT, "highest value that passes, in `unit`")
    unit: str = quantity("1", "", "unit of the numbers of this line")
    remedy: str = quantity("", "", "what to do when it has not passed")


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
    """A line that passes when the measured value lies within `allowed`, ends included; the upper may be infinite."""
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


def stated(subject: str, what: str, measured: float, unit: str, *, uncertainty: float | None = None) -> CheckLine:
    """A line that only says what was measured."""
    return CheckLine(
        subject=subject,
        what=what,
        verdict=Verdict.STATED,
        measured=measured,
        uncertainty=uncertainty,
        unit=unit,
    )


def passed(subject: str, what: str) -> CheckLine:
    """A line that passed without a number."""
    return CheckLine(subject=subject, what=what, verdict=Verdict.PASSED)


def failed(subject: str, what: str, remedy: str) -> CheckLine:
    """A line that failed without a number."""
    return CheckLine(subject=subject, what=what, verdict=Verdict.FAILED, remedy=remedy)


def untested(subject: str, what: str, remedy: str) -> CheckLine:
    """A line that could not be measured."""
    return CheckLine(subject=subject, what=what, verdict=Verdict.UNTESTED, remedy=remedy)
