"""Results of the decays: points, and findings for other runs."""

from collections.abc import Sequence
from datetime import UTC, datetime

from bench.analysis.free_decay.modal import K1
from bench.analysis.gain import COVERAGE
from protocols.common.decays.findings import (
    MASSES,
    correlations_with,
    frame_findings,
    known_covariance,
    known_masses,
    standard_uncertainties,
    through_masses,
)
from protocols.common.decays.frame import SIGNIFICANT, FrameResult, decay_point, parts_as_json
from protocols.coupling_stiffness.difference import SpringResult, replaces
from protocols.coupling_stiffness.protocol import SpringPoint
from sim.identified import Correlation, Finding, Identified, possible, spring_name

SOURCE = "shift of the frame's modes with the block held"

_SHARED = (
    *("k2_n_m", "k2_uncertainty", "xi1", "xi1_uncertainty", "xi2", "xi2_uncertainty", "omega1_rad_s"),
    *("omega1_uncertainty", "omega2_rad_s", "omega2_uncertainty", "drift_peak_m", "residual_m", "birge", "decays"),
)


def bare_point(result: FrameResult, number: int) -> SpringPoint:
    """The bare frame as a point."""
    point = decay_point(result, number)
    shared = {name: getattr(point, name) for name in _SHARED}
    return SpringPoint(
        decay=number, k1_with_spring_n_m=point.k1_n_m, k1_with_spring_uncertainty=point.k1_uncertainty, **shared
    )


def spring_point(spring: SpringResult, nominal: float, number: int) -> SpringPoint:
    """A spring as a point; `nominal` [N/m] is what its label promises."""
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
    """The stiffness of each spring, and the bare frame where it is known best from this run, with all correlations.

    `known` are the quantities identified before: those that stay are correlated with the springs as well.
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
            weighed = spring.held.weighed @ spring.shift[:2]
            covariances |= {mass: value for mass, value in zip(MASSES, weighed, strict=True) if mass in made}
        for other in springs[:place]:
            # both share masses, timebase, and the bare frame as reference
            common = spring.shift @ spring.held.shared @ other.shift + spring.reference.apart[0, 0]
            covariances[spring_name(other.label)] = float(common)
        correlations += correlations_with(name, size, covariances, sizes)
    return findings, correlations


def _with_known(spring: SpringResult, known: Identified, other: str, *, measured: bool) -> float:
    """Covariance of k_c with an identified quantity: by the masses, and by k1 where it was not measured too."""
    masses = known_masses(known) is not None
    if measured:
        return through_masses(spring.shift[:2], known, other) if masses else 0.0
    held = through_masses(spring.held.mass_shift[K1], known, other) if masses else 0.0
    return held - known_covariance(known, "k1", other)
