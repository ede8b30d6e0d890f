"""How far a campaign is, and how long it still takes."""

from collections.abc import Sequence

from bench.events import Progress
from protocols.earthquake.parameters import EarthquakeParameters
from protocols.earthquake.records import Shaking

BETWEEN = 45.0
"""Time from one record to the next until the storeys are still, typically [s]."""

IDENTIFICATION = 360.0
"""Time that the identification of the table takes [s]."""


class Pace:
    """Counts the records down by their length on the bench."""

    def __init__(self, parameters: EarthquakeParameters, shakings: Sequence[Shaking]) -> None:
        self._each = {
            shaking.name: shaking.target.duration + parameters.decay + parameters.rest + BETWEEN for shaking in shakings
        }
        plays = parameters.passes + 1 + len(parameters.beta)
        self.total = IDENTIFICATION + plays * sum(self._each.values())
        """Expected length of the campaign [s]."""
        self._finished = 0.0

    def identified(self) -> None:
        """The table is known."""
        self._finished += IDENTIFICATION

    def finished(self, record: str, plays: int = 1) -> None:
        """A record was played, or as many times as it might have been."""
        self._finished += plays * self._each[record]

    def progress(self, activity: str) -> Progress:
        """Where the campaign stands."""
        gone = min(self._finished, self.total)
        return Progress(0.0, gone / self.total, self.total - gone, activity)
