"""Does with a virtual specimen what a person does at the bench."""

from dataclasses import replace
from math import atan, isfinite

from drivers.errors import RigError
from drivers.rig import Handwork
from sim.arrangement import Arrangement
from sim.errors import InvalidInput
from sim.specimen import Frame, Specimen

_CLAMPED = 400.0
"""How much stiffer the storeys are when they are clamped to the table: their modes lie 20 times higher."""


class Handyman:
    """Knows the specimen as it came, and the springs in the drawer: `spring_factor` times as stiff as they say.

    Whoever mounts a spring, takes the block away or clamps the storeys takes every hand off first, and the clamp of the
    block. The lock of the table and the aim of laser 2 stay as they are until they are asked for.
    """

    def __init__(self, specimen: Specimen, spring_factor: float = 1.0) -> None:
        self._frame = specimen.frame
        self._spring_factor = spring_factor

    def after(self, work: Handwork, amount: float | None, now: Arrangement) -> Arrangement:
        """The arrangement after `work` was done by `amount` to the one of `now`.

        Raises InvalidInput for an amount that is missing or out of its range, RigError for work that cannot be done.
        """
        match work:
            case Handwork.MOUNT_SPRING | Handwork.HOLD_BLOCK:
                return self._with_spring(work, amount, now)
            case Handwork.REMOVE_BLOCK:
                return self._standing(self._free(now).bare(), now)
            case Handwork.STAND_BLOCK_UP:
                if now.specimen.beta is None:
                    nothing = (
                        "stand block up is refused: there is no block on the table; mount a spring and block first"
                    )
                    raise RigError(nothing)
                return replace(now, tilt=0.0)
            case Handwork.LOCK_FRAME:
                stiff = {"k1": _CLAMPED * self._frame.k1, "k2": _CLAMPED * self._frame.k2}
                # made anew: a copy would keep the modes of the soft frame
                clamped = Frame.model_validate(self._frame.model_dump() | stiff)
                return self._standing(now.specimen.bare().model_copy(update={"frame": clamped}), now)
            case Handwork.UNLOCK_FRAME:
                return replace(now, specimen=self._free(now))
            case Handwork.LOCK_TABLE | Handwork.UNLOCK_TABLE:
                return replace(now, table_locked=work is Handwork.LOCK_TABLE)
            case Handwork.WATCH_BLOCK:
                height = _needed("height", amount, "watching the block needs the height of the beam in m")
                top = 2.0 * now.specimen.block.h_b
                if not 0.0 < height < top:
                    raise InvalidInput("height", height, f"the beam meets the block above 0 and below {top:g} m")
                return replace(self._standing(self._free(now).with_spring(0.0), now), watched=height)
            case Handwork.WATCH_STOREYS:
                return replace(now, watched=None)
            case Handwork.TILT_BLOCK:
                return replace(now, tilt=_tilt(amount, now))
            case Handwork.PULL_FRAME:
                return replace(now, pull=self._pull(amount, now))

    def _with_spring(self, work: Handwork, stiffness: float | None, now: Arrangement) -> Arrangement:
        """With the spring of this label and the block, free to rock or clamped."""
        label = _needed("stiffness", stiffness, "mounting a spring needs its stiffness in N/m")
        if now.watched is not None:
            elsewhere = (
                f"{work.value} is refused: laser 2 looks at the block and would not see storey 2; watch storeys first"
            )
            raise RigError(elsewhere)
        specimen = self._free(now).with_spring(self._spring_factor * label)
        return replace(self._standing(specimen, now), block_clamped=work is Handwork.HOLD_BLOCK)

    def _pull(self, amount: float | None, now: Arrangement) -> float:
        """How far storey 2 is held aside [m]."""
        if now.specimen.frame != self._frame:
            raise RigError("pull frame is refused: its storeys are clamped to the table; unlock frame first")
        pull = _needed("pull", amount, "pulling the frame needs the displacement of storey 2 in m")
        highest = now.specimen.frame.h2
        if not 0.0 < abs(pull) < highest:
            raise InvalidInput("pull", pull, f"storey 2 is held aside by more than 0 and less than its {highest:g} m")
        return pull

    def _free(self, now: Arrangement) -> Specimen:
        """The specimen with its storeys free: nobody mounts anything on a clamped frame."""
        return now.specimen.model_copy(update={"frame": self._frame})

    @staticmethod
    def _standing(specimen: Specimen, now: Arrangement) -> Arrangement:
        """Another specimen, no hand on it, its block not clamped."""
        return replace(now.let_go(), specimen=specimen, block_clamped=False)


def _tilt(amount: float | None, now: Arrangement) -> float:
    """Rotation [rad] at which the block is held."""
    if now.specimen.beta is None:
        raise RigError("tilt block is refused: there is no block on the table; watch block stands it there")
    if now.specimen.beta > 0.0 or now.block_clamped:
        raise RigError("tilt block is refused: the block does not stand alone; watch block takes its spring off")
    tilt = _needed("tilt", amount, "tilting the block needs its rotation in rad")
    block = now.specimen.block
    overturning = atan(block.b / block.h_b)
    if not 0.0 < abs(tilt) < overturning:
        raise InvalidInput("tilt", tilt, f"either side of 0, it stands up again from below {overturning:.4g} rad only")
    return tilt


def _needed(item: str, amount: float | None, why: str) -> float:
    """The amount. Raises InvalidInput where there is none."""
    if amount is None or not isfinite(amount):
        raise InvalidInput(item, amount, why)
    return amount
