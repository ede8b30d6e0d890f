"""How far a campaign is, and how long it still takes."""

from collections import Counter
from collections.abc import Sequence

from bench.events import Progress
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import Shaking

BETWEEN = 45.0
"""Time from one record to the next until the storeys are still, typically [s]."""


class Pace:
    """Counts down the identification, which takes so many seconds, and the records by their length on the bench."""

    def __init__(
        self, parameters: EarthquakeParameters, shakings: Sequence[Shaking], identification: float = 0.0
    ) -> None:
        self._each = {
            shaking.name: shaking.target.duration + parameters.decay + parameters.rest + BETWEEN for shaking in shakings
        }
        self._bare = parameters.passes + 1
        self._identification = identification
        self.total = identification + (self._bare + len(parameters.beta)) * sum(self._each.values())
        """Expected length of the campaign [s]."""
        self._identified = 0.0
        self._played = Counter[str]()

    def identified(self, share: float = 1.0) -> None:
        """So much of the table's identification is done."""
        self._identified = share * self._identification

    def played(self, record: str) -> None:
        """A record was played once: a pass, or with a spring."""
        self._played[record] += 1

    def learned(self, record: str) -> None:
        """The bare frame's part of a record is over: passes that it did not take are not to come."""
        self._played[record] = self._bare

    def progress(self, activity: str) -> Progress:
        """Where the campaign stands."""
        played = sum(count * self._each[record] for record, count in self._played.items())
        gone = min(self._identified + played, self.total)
        return Progress(gone / self.total, self.total - gone, activity)
