"""Whether what stands on the table is what the model describes: a free specimen, seen by both lasers, from rest."""

from bench.events import SpecimenMounted
from drivers.rig import Handwork
from sim.specimen import Specimen

_BEGINS = {
    Handwork.LOCK_FRAME: "the frame is locked",
    Handwork.LOCK_TABLE: "the table is locked",
    Handwork.HOLD_BLOCK: "the block is held",
    Handwork.WATCH_BLOCK: "the laser of storey 2 looks at the block",
    Handwork.TILT_BLOCK: "the block is let go from a tilt",
    Handwork.PULL_FRAME: "the frame is let go from aside",
}
"""Works after which the model does not describe the test, and why."""

_MOUNTED = (Handwork.HOLD_BLOCK, Handwork.TILT_BLOCK, Handwork.PULL_FRAME)
_ENDS = {
    Handwork.UNLOCK_FRAME: (Handwork.LOCK_FRAME,),
    Handwork.UNLOCK_TABLE: (Handwork.LOCK_TABLE,),
    Handwork.WATCH_STOREYS: (Handwork.WATCH_BLOCK,),
    Handwork.MOUNT_SPRING: _MOUNTED,
    Handwork.REMOVE_BLOCK: _MOUNTED,
}
"""Works that bring what others before have ended."""


class Standing:
    """Follows the hand work."""

    def __init__(self) -> None:
        self._mounted: Specimen | None = None
        self._against: set[Handwork] = set()

    def follow(self, event: SpecimenMounted) -> None:
        """Take note of a work."""
        self._mounted = event.specimen
        self._against.difference_update(_ENDS.get(event.work, ()))
        if event.work in _BEGINS:
            self._against.add(event.work)

    @property
    def specimen(self) -> Specimen | None:
        """What the model may describe; None while nothing is known to stand there, or `why_not` says why."""
        return None if self._against else self._mounted

    @property
    def why_not(self) -> str:
        """Why the model does not describe what stands there; empty when it does."""
        return "; ".join(_BEGINS[work] for work in _BEGINS if work in self._against)
