"""The spring from two frames: with the block held, spring and first storey act side by side.

    k_C = k1(held) - k1(bare)

Both are found with the same masses, timebase and lasers. What masses and timebase add is that of the difference of
their shifts; the linearity of the lasers is taken as if it were another one each time, which is more than it can be.
Where the bare frame was identified before, its correlation with the masses is used as it is stated, and the timebase is
taken as another one.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.modal import K1, K2
from protocols.common.decays.findings import FOUND
from protocols.common.decays.frame import SIGNIFICANT, FrameResult
from sim.identified import Identified

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Reference:
    """The bare frame: `values` of the quantities `names`, shape (n,), k1 and k2 first.

    `apart`, shape (n, n), is their covariance but for masses and timebase, which they follow by `shift`, shape (n, 3).
    """

    names: tuple[str, ...]
    values: Array
    apart: Array
    shift: Array


@dataclass(frozen=True, eq=False)
class SpringResult:
    """A spring: `label` as written on it, `k_c` [N/m] with its standard uncertainty by part, `beta` = k_C/k1.

    `across`, shape (n,), are the covariances of k_c with the quantities of the reference; `shift`, shape (3,), is how
    k_c follows masses and timebase. `k2_apart` is the difference of k2 to the reference's over its standard
    uncertainty.
    """

    label: float
    k_c: float
    parts: dict[str, float]
    beta: float
    beta_uncertainty: float
    reference: Reference
    across: Array
    shift: Array
    held: FrameResult
    k2_apart: float

    @property
    def uncertainty(self) -> float:
        """Standard uncertainty of k_c [N/m]."""
        return sqrt(sum(part**2 for part in self.parts.values()))


def measured_reference(result: FrameResult) -> Reference:
    """The bare frame as it was measured in the same run."""
    places = list(FOUND.values())
    shift = result.shared_shift[places]
    whole = result.frame.covariance[np.ix_(places, places)]
    return Reference(tuple(FOUND), result.frame.values[places], whole - shift @ result.shared @ shift.T, shift)


def identified_reference(known: Identified | None) -> Reference | None:
    """The bare frame as it was identified before; None where it was not.

    How it follows the masses is what its covariance with m1 and m2 says; not at all where that says nothing.
    """
    if known is None or not {"k1", "k2"} <= set(known.names):
        return None
    names = tuple(name for name in FOUND if name in known.names)
    values = np.array([finding.value for name in names if (finding := known.finding(name)) is not None])
    whole, shift = known.covariance(names), np.zeros((len(names), 3))
    if {"m1", "m2"} <= set(known.names):
        joint = known.covariance((*names, "m1", "m2"))
        shift[:, :2] = joint[:-2, -2:] @ np.linalg.pinv(joint[-2:, -2:])
        whole = whole - shift[:, :2] @ joint[-2:, -2:] @ shift[:, :2].T
    return Reference(names, values, whole, shift)


def frame_change(bare: FrameResult, known: Identified | None) -> str | None:
    """Significant differences (99 %) of k1 and k2 from the identified frame, as text; None where there are none."""
    before = identified_reference(known)
    if before is None:
        return None
    now = measured_reference(bare)
    off: Array = now.shift[:2] - before.shift[:2]
    variance = np.diag(now.apart)[:2] + np.diag(before.apart)[:2] + np.diag(off @ bare.shared @ off.T)
    apart = (now.values[:2] - before.values[:2]) / np.sqrt(variance)
    if np.all(np.abs(apart) <= SIGNIFICANT):
        return None
    return f"k1 is {apart[0]:+.1f}, k2 {apart[1]:+.1f} standard uncertainties of the difference off"


def replaces(bare: FrameResult, known: Identified) -> bool:
    """Whether the frame of this run takes the place of the one that is known: it has changed, or is known better now.

    Better is by the determinant of the covariance: one number for k1, k2, xi1 and xi2, which belong together.
    """
    if not set(FOUND) <= set(known.names) or frame_change(bare, known) is not None:
        return True
    places = list(FOUND.values())
    now = float(np.linalg.det(_relative(bare.frame.covariance[np.ix_(places, places)], bare.frame.values[places])))
    values = np.array([finding.value for name in FOUND if (finding := known.finding(name)) is not None])
    return now < float(np.linalg.det(_relative(known.covariance(tuple(FOUND)), values)))


def spring_result(label: float, held: FrameResult, reference: Reference) -> SpringResult:
    """The spring that makes the difference."""
    k1, shared = float(reference.values[0]), held.shared
    shift = held.shared_shift[K1] - reference.shift[0]
    parts = {
        "decays with the spring": sqrt(max(_apart(held, K1), 0.0)),
        "bare frame": sqrt(max(float(reference.apart[0, 0]), 0.0)),
        "masses": sqrt(max(float(shift[:2] @ held.weighed @ shift[:2]), 0.0)),
        "timebase": abs(float(shift[2])),
    }
    across = reference.shift @ shared @ shift - reference.apart[:, 0]
    k_c = float(held.frame.values[K1]) - k1
    own = reference.shift[0]
    joint = np.array(
        [
            [sum(part**2 for part in parts.values()), across[0]],
            [across[0], reference.apart[0, 0] + own @ shared @ own],
        ]
    )
    slope = np.array([1.0, -k_c / k1]) / k1
    off = held.shared_shift[K2] - reference.shift[1]
    k2_variance = _apart(held, K2) + float(reference.apart[1, 1] + off @ shared @ off)
    k2_off = float(held.frame.values[K2] - reference.values[1])
    return SpringResult(
        label=label,
        k_c=k_c,
        parts=parts,
        beta=k_c / k1,
        beta_uncertainty=sqrt(max(float(slope @ joint @ slope), 0.0)),
        reference=reference,
        across=across,
        shift=shift,
        held=held,
        k2_apart=k2_off / sqrt(k2_variance) if k2_variance > 0.0 else 0.0,
    )


def _relative(covariance: Array, values: Array) -> Array:
    return covariance / np.outer(values, values)


def _apart(held: FrameResult, place: int) -> float:
    """Variance of a quantity but for masses and timebase."""
    shift = held.shared_shift[place]
    return float(held.frame.covariance[place, place] - shift @ held.shared @ shift)
