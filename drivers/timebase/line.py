"""A straight line between two clocks."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Line:
    """Second `time` of one clock is second `seconds` of another, which passes `rate` seconds per second of the first.

    The point is near the present, so that nothing is lost to rounding on clocks that have run for weeks.
    """

    time: float
    seconds: float
    rate: float

    def seconds_at(self, time: float) -> float:
        """Second of the second clock at `time` of the first [s]."""
        return self.seconds + self.rate * (time - self.time)

    def time_at(self, seconds: float) -> float:
        """Second of the first clock at `seconds` of the second [s]."""
        return self.time + (seconds - self.seconds) / self.rate
