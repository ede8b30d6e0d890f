"""Specimen handling: operator actions carried out on a virtual specimen."""

from dataclasses import replace
from math import atan, isfinite

from drivers.errors import RigError
from drivers.rig import OperatorTask
from sim.arrangement import Arrangement
from sim.errors import InvalidInput
from sim.specimen import Frame, Specimen

_CLAMPED = 400.0
"""Factor on the stiffness of storeys clamped to the table, which raises their natural frequencies by a factor of 20."""


class SpecimenHandling:
    """Operator actions on the original specimen, with springs `spring_factor` times as stiff as their labels.

    Mounting a spring, removing the block, placing it as the target of laser 2 and clamping the storeys first release
    any part held by hand and the clamp of the block. The lock of the table and the target of laser 2 are changed only
    by their own tasks.
    """

    def __init__(self, specimen: Specimen, spring_factor: float = 1.0) -> None:
        self._frame = specimen.frame
        self._spring_factor = spring_factor

    def after(self, work: OperatorTask, amount: float | None, now: Arrangement) -> Arrangement:
        """The arrangement after `work` with `amount` has been carried out on the present arrangement `now`.

        Raises InvalidInput for an amount that is missing or out of range, RigError for an impossible task.
        """
        match work:
            case OperatorTask.MOUNT_SPRING | OperatorTask.HOLD_BLOCK:
                return self._with_spring(work, amount, now)
            case OperatorTask.REMOVE_BLOCK:
                return self._standing(self._free(now).bare(), now)
            case OperatorTask.STAND_BLOCK_UP:
                if now.specimen.beta is None:
                    nothing = (
                        "stand block up is refused: there is no block on the table; mount a spring and block first"
                    )
                    raise RigError(nothing)
                return replace(now, tilt=0.0)
            case OperatorTask.LOCK_FRAME:
                stiff = {"k1": _CLAMPED * self._frame.k1, "k2": _CLAMPED * self._frame.k2}
                # a new object, since a copy would keep the cached modes of the unclamped frame
                clamped = Frame.model_validate(self._frame.model_dump() | stiff)
                return self._standing(now.specimen.bare().model_copy(update={"frame": clamped}), now)
            case OperatorTask.UNLOCK_FRAME:
                return replace(now, specimen=self._free(now))
            case OperatorTask.LOCK_TABLE | OperatorTask.UNLOCK_TABLE:
                return replace(now, table_locked=work is OperatorTask.LOCK_TABLE)
            case OperatorTask.WATCH_BLOCK:
                height = _needed("height", amount, "watching the block requires the height of the beam in m")
                top = 2.0 * now.specimen.block.h_b
                if not 0.0 < height < top:
                    raise InvalidInput(
                        "height", height, f"the beam hits the block only at heights above 0 and below {top:g} m"
                    )
                return replace(self._standing(self._free(now).with_spring(0.0), now), watched=height)
            case OperatorTask.WATCH_STOREYS:
                return replace(now, watched=None)
            case OperatorTask.TILT_BLOCK:
                return replace(now, tilt=_tilt(amount, now))
            case OperatorTask.PULL_FRAME:
                return replace(now, pull=self._pull(amount, now))

    def _with_spring(self, work: OperatorTask, stiffness: float | None, now: Arrangement) -> Arrangement:
        """The arrangement with the block, free to rock or clamped, and the spring labelled `stiffness` [N/m]."""
        label = _needed("stiffness", stiffness, "mounting a spring requires its stiffness in N/m")
        if now.watched is not None:
            elsewhere = (
                f"{work.value} is refused: laser 2 measures the block, not storey 2; carry out watch storeys first"
            )
            raise RigError(elsewhere)
        specimen = self._free(now).with_spring(self._spring_factor * label)
        return replace(self._standing(specimen, now), block_clamped=work is OperatorTask.HOLD_BLOCK)

    def _pull(self, amount: float | None, now: Arrangement) -> float:
        """Displacement at which storey 2 is held [m]."""
        if now.specimen.frame != self._frame:
            raise RigError("pull frame is refused: the storeys are clamped to the table; carry out unlock frame first")
        pull = _needed("pull", amount, "pulling the frame requires the displacement of storey 2 in m")
        highest = now.specimen.frame.h2
        if not 0.0 < abs(pull) < highest:
            raise InvalidInput("pull", pull, f"the magnitude must be above 0 and below {highest:g} m")
        return pull

    def _free(self, now: Arrangement) -> Specimen:
        """The present specimen with the storeys unclamped."""
        return now.specimen.model_copy(update={"frame": self._frame})

    @staticmethod
    def _standing(specimen: Specimen, now: Arrangement) -> Arrangement:
        """The arrangement with another specimen, no part of which is held by hand, and with the block unclamped."""
        return replace(now.let_go(), specimen=specimen, block_clamped=False)


def _tilt(amount: float | None, now: Arrangement) -> float:
    """Rotation [rad] at which the block is held."""
    if now.specimen.beta is None:
        raise RigError(
            "tilt block is refused: there is no block on the table; carry out watch block first, to place it there"
        )
    if now.specimen.beta > 0.0 or now.block_clamped:
        raise RigError(
            "tilt block is refused: the block does not stand alone; carry out watch block first, to remove its spring"
        )
    tilt = _needed("tilt", amount, "tilting the block requires its rotation in rad")
    block = now.specimen.block
    overturning = atan(block.b / block.h_b)
    if not 0.0 < abs(tilt) < overturning:
        raise InvalidInput("tilt", tilt, f"it must not be 0, and its magnitude must be below {overturning:.4g} rad")
    return tilt


def _needed(item: str, amount: float | None, why: str) -> float:
    """`amount`. Raises InvalidInput for `item` if it is missing or not finite."""
    if amount is None or not isfinite(amount):
        raise InvalidInput(item, amount, why)
    return amount
