"""The restitution as a finding that other runs load."""

from datetime import UTC, datetime

from bench.analysis.free_rocking.findings import Findings
from sim.free_rocking import theoretical_restitution
from sim.identified import Finding, Identified
from sim.specimen import Block


def identified_of(found: Findings, tilts: int, block: Block, known: Identified | None) -> Identified:
    """What is known of the specimen with the restitution of `block`, over that of its sides as configured.

    The factor holds with these sides only, so the finding says them, and the restitution itself.
    """
    theory, r = theoretical_restitution(block), found.restitution
    by = "sizes of the swings" if found.by_amplitudes else "exact motion"
    sides = f"2b = {2.0 * block.b:.6g} m, 2h_b = {2.0 * block.h_b:.6g} m"
    finding = Finding(
        name="restitution_factor",
        value=r.value / theory,
        standard_uncertainty=r.uncertainty / theory,
        source=f"free rocking, {tilts} tilts, by the {by}: r_exp = {r.value:.6f} of a block of {sides}",
        date=datetime.now(UTC).replace(microsecond=0),
    )
    return (known or Identified()).extended([finding])
