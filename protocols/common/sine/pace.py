"""Progress of a campaign, from the expected durations of its tests."""

from math import tau

from bench.events import Progress

OVERHEAD = 30.0
"""Typical duration of a test in addition to its cycles [s]: rest, start and ramps."""

CYCLES = 220
"""Typical number of cycles of a test, including settling."""


class Pace:
    """Progress of a campaign, computed from the expected durations of all tests and of the finished ones.

    The completed fraction never decreases; the remaining time increases where more is to be done than was planned, such
    as after a fall or in a bisection.
    """

    def __init__(self, omegas: tuple[float, ...], tests_per_omega: int) -> None:
        self._total = tests_per_omega * sum(self._expected(omega) for omega in omegas)
        self._finished = self._fraction = 0.0

    @staticmethod
    def _expected(omega: float) -> float:
        return OVERHEAD + CYCLES * tau / omega

    def add(self, omega: float) -> None:
        """Add a test at `omega` [rad/s] that was not planned."""
        self._total += self._expected(omega)

    def finished(self, omega: float) -> None:
        """Count a finished test at `omega` [rad/s]."""
        self._finished += self._expected(omega)

    def progress(self, activity: str, omega: float | None = None, cycles: int = 0) -> Progress:
        """Progress of the campaign after `cycles` cycles of a test at `omega` [rad/s]."""
        within = 0.0 if omega is None else min(cycles / CYCLES, 0.95) * self._expected(omega)
        gone = min(self._finished + within, self._total)
        self._fraction = max(self._fraction, gone / self._total)
        return Progress(self._fraction, self._total - gone, activity)
