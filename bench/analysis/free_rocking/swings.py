"""Segmentation of a recording of free rocking: rest, initial tilt and every half swing."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import bridged
from sim import block_face
from sim.errors import RockbenchError
from sim.specimen import Block

Array = NDArray[np.float64]

REST = 1.0
"""Duration at the end of a recording during which the block must be at rest [s]."""

GAP = 0.005
"""Longest gap without valid samples [s] that is interpolated."""

STILL = 2e-4
"""Standard deviation [m] of the displacement up to which the block counts as at rest; it allows for a laser's noise."""

_HELD = 0.5
"""Duration at the beginning of a recording over which the initial tilt is averaged [s]."""

_SHARE = 0.25
"""Fraction of the smallest usable angle that a sample must exceed to count as a tilt to one side."""


class NotRocking(RockbenchError):
    """Error: the recording does not show the free rocking of a tilted block."""

    error_code = "not_measurable"


@dataclass(frozen=True, eq=False)
class Recording:
    """Signal of the laser: `displacement` [m], shape (n,), NaN where invalid, at `sample_rate` [1/s], of the face
    of `block` at `height` [m]. The zero of the displacement is arbitrary.
    """

    displacement: Array
    sample_rate: float
    block: Block
    height: float

    @property
    def times(self) -> Array:
        """Time [s] since the first sample, shape (n,)."""
        return np.arange(self.displacement.size) / self.sample_rate

    def angle(self, zero: float) -> Array:
        """Rotation of the block [rad], shape (n,), if the laser reads `zero` [m] with the block at rest."""
        return block_face.rotation(self.displacement - zero, self.height, self.block)


@dataclass(frozen=True, eq=False)
class Swings:
    """The half swings of a recording that are large enough to be used.

    `zero` [m] is the laser's reading at rest, `held` [rad] the initial tilt. `crossings` [s], shape (n,), are the
    approximate times of the impacts; `peaks` [rad], shape (n,), the largest angles after each, signed.
    """

    zero: float
    held: float
    crossings: Array
    peaks: Array


def without_gaps(seen: Recording) -> Recording:
    """The recording with gaps of up to `GAP` interpolated linearly. Raises NotRocking for a longer gap."""
    known = np.flatnonzero(np.isfinite(seen.displacement))
    gaps = np.diff(known, prepend=-1, append=seen.displacement.size) - 1
    longest = int(np.argmax(gaps))
    if gaps[longest] > GAP * seen.sample_rate:
        at = (known[longest - 1] + 1) / seen.sample_rate if longest > 0 else 0.0
        raise NotRocking(
            f"the laser has no valid reading at {at:.2f} s: check that the block stays within the laser's range, "
            "then repeat the tilt"
        )
    return replace(seen, displacement=bridged(seen.displacement))


def find_swings(seen: Recording, least: float) -> Swings:
    """The half swings before the first one whose largest angle is below `least` [rad].

    Raises NotRocking, with a remedy, if the block was not tilted or not released, or did not come to rest.
    """
    n = round(REST * seen.sample_rate)
    end = seen.displacement[-n:]
    if float(end.std()) > STILL:
        raise NotRocking("the block did not come to rest within the recording: release it earlier, or tilt it less")
    zero = float(end.mean())
    angle = seen.angle(zero)
    if not np.isfinite(angle).all():
        raise NotRocking("no rotation of the block explains the laser's reading: check its height and its target")
    held = float(np.median(angle[: round(_HELD * seen.sample_rate)]))
    if abs(held) < least:
        raise NotRocking(
            f"the tilt of the block at the beginning is too small, {held:+.4f} rad: tilt it farther, then repeat"
        )
    side = np.where(np.abs(angle) > _SHARE * least, np.sign(angle), 0.0)
    known = np.flatnonzero(side)
    turned = np.flatnonzero(np.diff(side[known]) != 0.0)
    before, after = known[turned], known[turned + 1]
    if turned.size == 0:
        raise NotRocking("the block was not released, or was lowered by hand: release it during the recording")
    crossings = np.array([_crossing(angle, *pair) for pair in zip(before, after, strict=True)])
    ends = np.append(after[1:], angle.size)
    peaks = np.array([_largest(angle[low:high]) for low, high in zip(after, ends, strict=True)])
    small = np.flatnonzero(np.abs(peaks) < least)
    count = int(small[0]) if small.size else peaks.size
    if count == 0:
        raise NotRocking(
            f"the block was lowered by hand, and swung to {peaks[0]:+.4f} rad only: let it go, then repeat"
        )
    return Swings(zero, held, crossings[:count] / seen.sample_rate, peaks[:count])


def _crossing(angle: Array, before: int, after: int) -> float:
    """Position [samples] of the zero crossing of a straight line between two samples of opposite sign."""
    return before + (after - before) * float(angle[before] / (angle[before] - angle[after]))


def _largest(angle: Array) -> float:
    return float(angle[np.argmax(np.abs(angle))])
