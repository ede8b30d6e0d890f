"""One recording of a block that was tilted and let go, from samples to restitution."""

from dataclasses import dataclass, replace

from bench.analysis.free_rocking.fit import RockingFit, fit_rocking
from bench.analysis.free_rocking.points import Points, find_points
from bench.analysis.free_rocking.relation import Relation, amplitude_relation
from bench.analysis.free_rocking.swings import NotRocking, Seen, Swings, find_swings, mended
from sim.free_rocking import critical_angle, frequency_parameter
from sim.specimen import Specimen

POOR = 0.2
"""Share of the mean amplitude that the residual of a fit may reach before the model does not describe the motion.
Impacts that differ from one another by 1 % leave some 0.1."""

PUSH = 0.03
"""Share by which the tilt that the motion tells may differ from that in the hand when the release was one from rest."""


@dataclass(frozen=True, eq=False)
class Tilt:
    """What was found of one tilt. The `relation` is for the critical angle of the geometry, the `fit` finds its own."""

    seen: Seen
    swings: Swings
    points: Points
    relation: Relation
    fit: RockingFit

    @property
    def push(self) -> float:
        """Tilt of a release from rest that leads to this motion, over the tilt in the hand, less 1."""
        return abs(self.fit.motion.tilt / self.swings.held) - 1.0


def analysed(seen: Seen, specimen: Specimen, least: float) -> Tilt:
    """All of it, down to the swing whose largest angle is below `least` [rad].

    Raises NotRocking, saying what to do, for a recording that does not show free rocking.
    """
    alpha = critical_angle(specimen.block)
    seen = mended(seen)
    swings = find_swings(seen, least)
    # the rest is a few steps of the laser wide: the motion on both sides tells the zero better
    fit = fit_rocking(
        seen, swings, find_points(seen, swings, swings.zero), alpha, frequency_parameter(specimen.block, specimen.g)
    )
    mean = float(abs(seen.height * swings.peaks).mean())
    if fit.rms > POOR * mean:
        raise NotRocking(
            f"the exact motion leaves {1e3 * fit.rms:.2g} mm of {1e3 * mean:.3g} mm: see that the block rocks on its"
            " two edges alone, neither turning nor sliding, then repeat"
        )
    straight = replace(seen, displacement=fit.straightened(seen.displacement))
    points = find_points(straight, swings, 0.0)
    return Tilt(seen, swings, points, amplitude_relation(points, alpha), fit)
