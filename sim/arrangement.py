"""Specimen on the table, with clamps and manual restraints: system constants and motion of the laser targets."""

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.block_face import displacement, displacement_rate
from sim.shaker import Shaker
from sim.specimen import Specimen

if TYPE_CHECKING:
    from sim.kernel.plant import Plant

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Arrangement:
    """A specimen with its clamps and manual restraints.

    `table_locked`: the table is clamped to the ground at mid stroke. `block_clamped`: the block is clamped to the
    table; block and spring end move with the table. `watched`: height [m] at which laser 2 measures the block's face;
    None if it measures storey 2. `tilt`: rotation [rad] at which the block is held by hand; 0 if it is free.
    `pull`: displacement [m] at which storey 2 is held by hand; 0 if it is free.
    """

    specimen: Specimen
    table_locked: bool = False
    block_clamped: bool = False
    watched: float | None = None
    tilt: float = 0.0
    pull: float = 0.0

    @property
    def held(self) -> bool:
        """Whether the block or the frame is held by hand until release."""
        return self.tilt != 0.0 or self.pull != 0.0

    def let_go(self) -> "Arrangement":
        """Return the same arrangement after the parts held by hand have been released."""
        return replace(self, tilt=0.0, pull=0.0)

    def storeys(self) -> tuple[float, float]:
        """Displacements (u1, u2) [m] of the storeys at rest: storey 2 is held at `pull`, storey 1 is in equilibrium."""
        f = self.specimen.frame
        return f.k2 / (f.k1 + f.k2 + self.specimen.k_c) * self.pull, self.pull

    def plant(self, shaker: Shaker, catch_angle: float) -> "Plant":
        """Constants of the moving system for `sim.kernel.table`.

        A part clamped to the ground and a storey held by hand have infinite mass. The forces on them are finite, so
        that their acceleration is exactly 0, and an impact on a locked table has exactly the restitution r of fixed
        ground.
        """
        plant = plant_of(self.specimen, shaker, catch_angle)
        if self.block_clamped:
            # the block's mass is fixed to the table
            plant = plant._replace(moving_mass=plant.moving_mass + plant.mass, mass=0.0)
        if self.table_locked:
            plant = plant._replace(moving_mass=inf)
        return plant._replace(m2=inf) if self.pull != 0.0 else plant


def plant_of(specimen: Specimen, shaker: Shaker, catch_angle: float) -> "Plant":
    """Constants of shaker and specimen without clamps and restraints."""
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


def targets(samples: Array, arrangement: Arrangement) -> Array:
    """The `samples` with the motion of laser 2's target relative to the table in place of that of storey 2; the same
    object if the target is the storey.

    The columns, shape (n, 8 or more), are x, v, u1, u2, v1, v2, theta, omega. Displacements are relative to mid range,
    which is the reading of each laser at rest; NaN where there is no block or the beam misses it.
    """
    height, specimen = arrangement.watched, arrangement.specimen
    if height is None:
        return samples
    seen = samples.copy()
    if specimen.beta is None:
        seen[:, [3, 5]] = np.nan
    else:
        theta, omega = np.ascontiguousarray(samples[:, 6:8].T)
        seen[:, 3] = displacement(theta, height, specimen.block)
        seen[:, 5] = displacement_rate(theta, height, specimen.block) * omega
    return seen


def sights(samples: Array, arrangement: Arrangement, on_ground: bool) -> Array:
    """Displacement [m] and velocity [m/s] of the target of laser 1, then of laser 2, shape (4, n), for the `samples` of
    `targets`. Lasers mounted on the ground also measure the table's motion.
    """
    x, v, u1, u2, v1, v2 = targets(samples, arrangement).T[:6]
    return np.array([u1 + x, v1 + v, u2 + x, v2 + v] if on_ground else [u1, v1, u2, v2])
