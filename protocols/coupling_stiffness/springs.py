"""Stiffness of springs from two frames.

With the block clamped, spring and first storey act in parallel: k_C = k1(held) - k1(bare).

Both frames are identified with the same masses, timebase and lasers. The uncertainties of masses and timebase
contribute through the difference of the two sensitivities; the linearity errors of the lasers are assumed independent,
which gives an upper bound. If the bare frame was identified previously, its stated correlation with the masses is used,
and the timebase is assumed independent.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.response import K1, K2
from bench.analysis.gain import COVERAGE
from protocols.common.decays.findings import (
    FOUND,
    MASSES,
    correlations_with,
    frame_findings,
    known_covariance,
    known_masses,
    standard_uncertainties,
    through_masses,
)
from protocols.common.decays.frame import SIGNIFICANT, FrameResult, decay_point, parts_as_json
from protocols.coupling_stiffness.protocol import SpringPoint
from sim.identified import Correlation, Finding, Identified, possible, spring_name

Array = NDArray[np.float64]

SOURCE = "shift of the frame's modes with the block held"


@dataclass(frozen=True, eq=False)
class Reference:
    """Bare frame: `values` of the quantities `names`, shape (n,), k1 and k2 first. `apart`, shape (n, n), is their
    covariance without the contributions of masses and timebase; `shift`, shape (n, 3), holds the sensitivities of the
    quantities to both masses and the timebase.
    """

    names: tuple[str, ...]
    values: Array
    apart: Array
    shift: Array


@dataclass(frozen=True, eq=False)
class SpringResult:
    """Spring with its `label`, its stiffness `k_c` [N/m], whose standard uncertainties by contribution are `parts`, and
    `beta` = k_C/k1. `across`, shape (n,), holds the covariances of k_c with the quantities of the reference; `shift`,
    shape (3,), the sensitivities of k_c to masses and timebase. `k2_apart` is the difference of k2 from the reference,
    in standard uncertainties.
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
    """Reference from the bare frame measured in the same run."""
    places = list(FOUND.values())
    shift = result.shared_shift[places]
    whole = result.frame.covariance[np.ix_(places, places)]
    return Reference(tuple(FOUND), result.frame.values[places], whole - shift @ result.shared @ shift.T, shift)


def identified_reference(known: Identified | None) -> Reference | None:
    """Reference from the previously identified bare frame; None if there is none.

    Its sensitivity to the masses follows from its covariance with m1 and m2; it is zero without them.
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
    """Text stating the differences of k1 and k2 from the identified frame; None if neither is significant (99 %)."""
    before = identified_reference(known)
    if before is None:
        return None
    now = measured_reference(bare)
    off: Array = now.shift[:2] - before.shift[:2]
    variance = np.diag(now.apart)[:2] + np.diag(before.apart)[:2] + np.diag(off @ bare.shared @ off.T)
    apart = (now.values[:2] - before.values[:2]) / np.sqrt(variance)
    if np.all(np.abs(apart) <= SIGNIFICANT):
        return None
    return f"k1 has changed by {apart[0]:+.1f} and k2 by {apart[1]:+.1f} standard uncertainties of the difference"


def replaces(bare: FrameResult, known: Identified) -> bool:
    """Whether this run's frame replaces the previously identified one, because the latter is incomplete, the frame has
    changed, or the new uncertainty is smaller.

    Uncertainties are compared by the determinant of the covariance of k1, k2, xi1 and xi2.
    """
    if not set(FOUND) <= set(known.names) or frame_change(bare, known) is not None:
        return True
    places = list(FOUND.values())
    now = float(np.linalg.det(_relative(bare.frame.covariance[np.ix_(places, places)], bare.frame.values[places])))
    values = np.array([finding.value for name in FOUND if (finding := known.finding(name)) is not None])
    return now < float(np.linalg.det(_relative(known.covariance(tuple(FOUND)), values)))


def spring_result(label: float, held: FrameResult, reference: Reference) -> SpringResult:
    """Stiffness of the spring labelled `label`: k1 of the frame `held`, with the spring, minus k1 of `reference`."""
    k1, shared = float(reference.values[0]), held.shared
    shift = held.shared_shift[K1] - reference.shift[0]
    parts = {
        "decays with the spring": sqrt(max(_own_variance(held, K1), 0.0)),
        "bare frame": sqrt(max(float(reference.apart[0, 0]), 0.0)),
        "masses": sqrt(max(float(shift[:2] @ held.masses_covariance @ shift[:2]), 0.0)),
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
    k2_variance = _own_variance(held, K2) + float(reference.apart[1, 1] + off @ shared @ off)
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


def bare_point(result: FrameResult, number: int) -> SpringPoint:
    point = decay_point(result, number)
    shared = {name: value for name, value in point if name in SpringPoint.model_fields}
    return SpringPoint(k1_with_spring_n_m=point.k1_n_m, k1_with_spring_uncertainty=point.k1_uncertainty, **shared)


def spring_point(spring: SpringResult, nominal: float, number: int) -> SpringPoint:
    """Point of a spring; `nominal` [N/m] is the stiffness on its label, `number` that of the decay (0: all decays)."""
    return SpringPoint(
        **bare_point(spring.held, number).model_dump(exclude_none=True, exclude={"k_c_parts"}),
        beta=spring.label,
        k_c_n_m=spring.k_c,
        k_c_parts=parts_as_json(spring.parts),
        k_c_uncertainty=COVERAGE * spring.uncertainty,
        k_c_nominal_n_m=nominal,
        beta_mounted=spring.beta,
        beta_uncertainty=COVERAGE * spring.beta_uncertainty,
        k2_agrees=bool(abs(spring.k2_apart) <= SIGNIFICANT),
    )


def spring_findings(
    bare: FrameResult | None, springs: Sequence[SpringResult], known: Identified
) -> tuple[list[Finding], list[Correlation]]:
    """Findings with all correlations: the stiffness of each spring, and the bare frame unless the previously identified
    one remains valid. `known` are the previously identified quantities; those that are kept are correlated with the
    springs as well.
    """
    framed = bare is not None and replaces(bare, known)
    findings, correlations = frame_findings(bare, known) if bare is not None and framed else ([], [])
    date = datetime.now(UTC).replace(microsecond=0)
    made = {spring_name(spring.label) for spring in springs} | {finding.name for finding in findings}
    kept = [name for name in known.names if name not in made]
    sizes = standard_uncertainties(known)
    for place, spring in enumerate(springs):
        name, size = spring_name(spring.label), spring.uncertainty
        if not possible(name, spring.k_c):
            continue
        findings.append(Finding(name=name, value=spring.k_c, standard_uncertainty=size, source=SOURCE, date=date))
        sizes |= {finding.name: finding.standard_uncertainty for finding in findings}
        covariances = {other: _with_known(spring, known, other, measured=bare is not None) for other in kept}
        if framed:
            covariances |= dict(zip(spring.reference.names, spring.across, strict=True))
            weighed = spring.held.masses_covariance @ spring.shift[:2]
            covariances |= {mass: value for mass, value in zip(MASSES, weighed, strict=True) if mass in made}
        for other in springs[:place]:
            # both springs share the masses, the timebase, and the bare frame as reference
            common = spring.shift @ spring.held.shared @ other.shift + spring.reference.apart[0, 0]
            covariances[spring_name(other.label)] = float(common)
        correlations += correlations_with(name, size, covariances, sizes)
    return findings, correlations


def _with_known(spring: SpringResult, known: Identified, other: str, *, measured: bool) -> float:
    """Covariance of k_c with a previously identified quantity, through the masses and, unless k1 was measured in this
    run, through k1.
    """
    masses = known_masses(known) is not None
    if measured:
        return through_masses(spring.shift[:2], known, other) if masses else 0.0
    held = through_masses(spring.held.mass_shift[K1], known, other) if masses else 0.0
    return held - known_covariance(known, "k1", other)


def _relative(covariance: Array, values: Array) -> Array:
    return covariance / np.outer(values, values)


def _own_variance(held: FrameResult, place: int) -> float:
    """Variance of the quantity with index `place`, without the contributions of masses and timebase."""
    shift = held.shared_shift[place]
    return float(held.frame.covariance[place, place] - shift @ held.shared @ shift)
