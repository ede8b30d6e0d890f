"""What stands on the table, what is clamped or held by hand, and the constants of the moving system that this makes."""

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING

from sim.shaker import Shaker
from sim.specimen import Specimen

if TYPE_CHECKING:
    from sim.kernel.plant import Plant


@dataclass(frozen=True)
class Arrangement:
    """A specimen and what was done to it by hand.

    table_locked : the table is clamped to the ground at mid stroke.
    block_clamped : the block is clamped to the table: it rides, and the spring is grounded on it.
    watched : height [m] at which laser 2 looks at the block's face; None: it looks at storey 2.
    tilt : rotation [rad] at which the block is held by hand; 0 when nobody holds it.
    pull : displacement [m] at which storey 2 is held by hand; 0 when nobody holds it.
    """

    specimen: Specimen
    table_locked: bool = False
    block_clamped: bool = False
    watched: float | None = None
    tilt: float = 0.0
    pull: float = 0.0

    @property
    def held(self) -> bool:
        """Whether somebody holds the block or the frame, and will let go."""
        return self.tilt != 0.0 or self.pull != 0.0

    def let_go(self) -> "Arrangement":
        """The same with nobody's hand on it."""
        return replace(self, tilt=0.0, pull=0.0)

    def storeys(self) -> tuple[float, float]:
        """Displacements (u1, u2) [m] of the storeys at rest: u1 follows u2 as under a force on storey 2."""
        f = self.specimen.frame
        return f.k2 / (f.k1 + f.k2 + self.specimen.k_c) * self.pull, self.pull

    def plant(self, shaker: Shaker, catch_angle: float) -> "Plant":
        """The constants of the moving system as `sim.kernel.table` takes them.

        What is clamped to the ground, and the storey in a firm hand, has an infinite mass: the forces on it are finite,
        so its acceleration is exactly 0, and an impact on a locked table keeps the share r of fixed ground exactly.
        """
        plant = plant_of(self.specimen, shaker, catch_angle)
        if self.block_clamped:
            # a mass on the table that nothing lifts
            plant = plant._replace(moving_mass=plant.moving_mass + plant.mass, mass=0.0)
        if self.table_locked:
            plant = plant._replace(moving_mass=inf)
        return plant._replace(m2=inf) if self.pull != 0.0 else plant


def plant_of(specimen: Specimen, shaker: Shaker, catch_angle: float) -> "Plant":
    """The constants of shaker and specimen when nothing is clamped or held."""
    from sim.kernel.plant import Plant

    f, k, (c1, c2) = specimen.frame, specimen.block, specimen.frame.dashpots
    standing = specimen.beta is not None
    return Plant(
        m1=f.m1,
        m2=f.m2,
        k1=f.k1,
        k2=f.k2,
        c1=c1,
        c2=c2,
        h1=f.h1,
        k_c=specimen.k_c,
        d=specimen.d,
        b=k.b,
        h_b=k.h_b,
        mass=k.mass if standing else 0.0,
        inertia=k.inertia,
        restitution=k.restitution,
        g=specimen.g,
        catch_angle=catch_angle,
        moving_mass=shaker.moving_mass,
        k_s=shaker.k_s,
        c_s=shaker.c_s,
        friction=shaker.friction,
        friction_velocity=shaker.friction_velocity,
        half_stroke=shaker.half_stroke,
        stop_stiffness=shaker.stop_stiffness,
        stop_damping=shaker.stop_damping,
        bl=shaker.bl,
        resistance=shaker.resistance,
        holds_current=1.0 if shaker.amplifier == "current" else 0.0,
        voltage_limit=shaker.voltage_limit,
        current_limit=shaker.current_limit,
        lag=shaker.amplifier_lag,
    )
