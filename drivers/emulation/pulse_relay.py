"""A relay that is kept closed by pulses: the retriggerable monoflop behind a heartbeat line."""

import time


class PulseRelay:
    """Closed for `timeout` seconds [s] after each rising edge; a level that stands still, high or low, opens it."""

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._high = False
        self._until = 0.0

    @property
    def closed(self) -> bool:
        """Whether the last rising edge is young enough."""
        return time.monotonic() < self._until

    def level(self, high: bool) -> None:
        """The line has this level now."""
        if high and not self._high:
            self._until = time.monotonic() + self._timeout
        self._high = high
