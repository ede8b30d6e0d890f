"""How far a campaign is, and how long it still takes."""

from math import tau

from bench.events import Progress

OVERHEAD = 30.0
"""Time of a test besides its cycles: rest, start, ramps [s]."""

CYCLES = 220
"""Cycles that a test typically takes until it is steady and measured."""


class Pace:
    """Counts tests down by their expected length on the bench."""

    def __init__(self, omegas: tuple[float, ...], tests_per_omega: int) -> None:
        self._total = tests_per_omega * sum(self._expected(omega) for omega in omegas)
        self._finished = 0.0

    @staticmethod
    def _expected(omega: float) -> float:
        return OVERHEAD + CYCLES * tau / omega

    def finished(self, omega: float) -> None:
        """A test at `omega` [rad/s] has its result."""
        self._finished += self._expected(omega)

    def progress(self, activity: str, omega: float | None = None, cycles: int = 0) -> Progress:
        """Where the campaign stands, `cycles` into a test at `omega`."""
        within = 0.0 if omega is None else min(cycles / CYCLES, 0.95) * self._expected(omega)
        gone = min(self._finished + within, self._total)
        return Progress(gone / self._total, self._total - gone, activity)
