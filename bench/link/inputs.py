"""The safety inputs as they are now, told while a run goes on."""

from contextlib import suppress

from bench.link.messages import SafetyInputs
from bench.link.outbox import Outbox
from drivers.clock import now
from drivers.rig import Rig, RigError

PERIOD = 0.5
"""Shortest time of the machine's clock between two looks [s]: the guard looks in every block by itself."""


class SafetyWatch:
    """Asks the rig, which belongs to the engine's thread: to be called there and nowhere else."""

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox
        self._rig: Rig | None = None
        self._looked = -PERIOD
        self._time = 0.0

    def watch(self, rig: Rig) -> None:
        """From now on ask this rig."""
        self._rig = rig
        self.look(0.0, at_once=True)

    def look(self, time: float | None = None, *, at_once: bool = False) -> None:
        """Tell of the inputs at bench time `time` [s], if it is time to. A rig that does not answer is left alone:
        what it failed with is told elsewhere.
        """
        with suppress(RigError):
            self.look_driven(time, at_once=at_once)

    def look_driven(self, time: float | None = None, *, at_once: bool = False) -> None:
        """As `look`, while the rig is armed: raises RigError when the inputs cannot be read. The rig has cut its
        output for that, and here is the one place that knows why.
        """
        self._time = self._time if time is None else time
        if self._rig is None or (now() - self._looked < PERIOD and not at_once):
            return
        self._looked = now()
        self._outbox.put(SafetyInputs(self._time, dict(self._rig.interlocks())))
