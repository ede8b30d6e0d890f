"""Does with a virtual specimen what a person does at the bench."""

from drivers.errors import RigError
from drivers.rig import Handwork
from sim.errors import InvalidInput
from sim.specimen import Frame, Specimen

_CLAMPED = 400.0
"""How much stiffer the storeys are when they are clamped to the table: their modes lie 20 times higher."""


class Handyman:
    """Knows the specimen as it came, and the springs in the drawer: `spring_factor` times as stiff as they say."""

    def __init__(self, specimen: Specimen, spring_factor: float = 1.0) -> None:
        self._frame = specimen.frame
        self._spring_factor = spring_factor

    def after(self, work: Handwork, stiffness: float | None, specimen: Specimen) -> Specimen:
        """What stands on the table after `work` was done to `specimen`, with a spring of `stiffness` [N/m].

        Raises InvalidInput for a spring without stiffness, RigError for work that cannot be done.
        """
        match work:
            case Handwork.MOUNT_SPRING:
                if stiffness is None:
                    raise InvalidInput("stiffness", stiffness, "mounting a spring needs its stiffness in N/m")
                return self._free(specimen).coupled(self._spring_factor * stiffness / self._frame.k1)
            case Handwork.REMOVE_BLOCK:
                return self._free(specimen).bare()
            case Handwork.STAND_BLOCK_UP:
                if specimen.beta is None:
                    nothing = (
                        "stand block up is refused: there is no block on the table; mount a spring and block first"
                    )
                    raise RigError(nothing)
                return specimen
            case Handwork.LOCK_FRAME:
                stiff = {"k1": _CLAMPED * self._frame.k1, "k2": _CLAMPED * self._frame.k2}
                # made anew: a copy would keep the modes of the soft frame
                clamped = Frame.model_validate(self._frame.model_dump() | stiff)
                return specimen.bare().model_copy(update={"frame": clamped})
            case Handwork.UNLOCK_FRAME:
                return specimen.model_copy(update={"frame": self._frame})

    def _free(self, specimen: Specimen) -> Specimen:
        """The specimen with its storeys free: nobody mounts anything on a clamped frame."""
        return specimen.model_copy(update={"frame": self._frame})
