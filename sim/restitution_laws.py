"""Laws of restitution of a rocking block from the conservation of angular momentum, in addition to Housner's.

The base extends from x = -b to b, the centre of mass is at the height h_b above its middle. A block that rotates with
omega about the point x = p of the base has the angular momentum M (c + p q) omega about the point x = q, with
c = h_b^2 + (b^2 + h_b^2) / 3. An impulse at q does not change it, and afterwards the block rotates about p':

    omega+ / omega- = (c + p q) / (c + p' q).

Housner's law (p = -b, q = p' = b) assumes that the impulse acts at the corner, which gives the greatest loss.

Kalliontzis, Sritharan and Schultz (2016, Improved coefficient of restitution estimation for free rocking members,
Journal of Structural Engineering, 06016002) assume that the block rocks over a contact region, so that the impulse acts
nearer the middle: q = k b with 0 < k < 1. Ther and Kollár (2016, Refinement of Housner's model on rocking blocks,
Bulletin of Earthquake Engineering) assume consecutive impacts because of unevenness or grains; the simplest case is an
impact at the middle (p' = q = 0), then one at the corner. The formulas here are derived from these assumptions, not
taken from the papers.
"""

from collections.abc import Callable
from dataclasses import dataclass

from sim.specimen import Block, Specimen

FACE = 1.0 / 3.0
"""Distance k of the impulse from the middle of a plane base, relative to b, if the impulse per length is proportional
to the velocity of approach, x + b: the integral of x (x + b) divided by b times that of x + b. It is an assumption, not
a value of the paper.
"""


@dataclass(frozen=True)
class RestitutionLaw:
    """Law of restitution: short `name`, description `words`, and the ratio of angular velocities as a function of the
    block.
    """

    name: str
    words: str
    restitution: Callable[[Block], float]

    def applied(self, specimen: Specimen) -> Specimen:
        """Return `specimen` with the restitution of this law; its previous `restitution_factor` has no effect."""
        block = specimen.block
        theoretical = block.model_copy(update={"restitution_factor": 1.0}).restitution
        factor = {"restitution_factor": self.restitution(block) / theoretical}
        return specimen.model_copy(update={"block": Block(**(block.model_dump() | factor))})


def passed(block: Block, before: float, impulse: float, after: float) -> float:
    """Ratio of angular velocities of a block that rotates about x = `before` b, receives an impulse at x = `impulse` b,
    and then rotates about x = `after` b.
    """
    c = (block.h_b**2 + (block.b**2 + block.h_b**2) / 3.0) / block.b**2
    return (c + before * impulse) / (c + after * impulse)


def consecutive(block: Block) -> float:
    """Restitution of an impact at the middle of the base, followed by one at the corner."""
    return passed(block, -1.0, 0.0, 0.0) * passed(block, 0.0, 1.0, 1.0)


def laws(offset: float | None = None) -> tuple[RestitutionLaw, ...]:
    """The laws in addition to Housner's; `offset` is the distance k of the impulse of the contact region (by default,
    FACE).
    """
    k = FACE if offset is None else offset
    return (
        RestitutionLaw("consecutive", "consecutive impacts at middle and corner", consecutive),
        RestitutionLaw("contact", "impulse in a contact region", lambda block: passed(block, -1.0, k, 1.0)),
    )
