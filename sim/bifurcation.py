"""Where a branch of steady motions loses or regains its stability, and in which of the three generic ways.

A Floquet multiplier leaves the unit circle at +1 (fold: the orbit meets another one), at -1 (period doubling), or as a
complex pair (Neimark-Sacker: the motion becomes modulated, with two frequencies). Source: Kuznetsov, Elements of
Applied Bifurcation Theory, 2004, chapter 4.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np

from sim.errors import InvalidInput
from sim.specimen import Specimen
from sim.steady import Orbit, rocking_orbit

PRECISION = 1e-8
"""Distance of the leading multiplier from the unit circle at which a bifurcation counts as located."""

MOST_SECANTS = 60
"""More would not move the parameters any further in double precision."""


class BifurcationType(StrEnum):
    """How stability is lost."""

    FOLD = "fold"
    PERIOD_DOUBLING = "period doubling"
    NEIMARK_SACKER = "Neimark-Sacker"


@dataclass(frozen=True, eq=False)
class Bifurcation:
    """A change of stability between two orbits of a branch.

    `angle` [rad], 0 to pi: argument of the multiplier on the unit circle; 2 pi / angle periods of the drive make one
    beat. `orbit`: the orbit there. `gains_stability`: whether the branch becomes stable in its own direction.
    """

    type: BifurcationType
    angle: float
    orbit: Orbit
    gains_stability: bool


def leading_type(orbit: Orbit) -> tuple[BifurcationType, float]:
    """How `orbit` loses, or would first lose, its stability: by its leading multiplier, and that one's angle [rad]."""
    leading = orbit.multipliers[np.abs(orbit.multipliers).argmax()]
    angle = float(abs(np.angle(leading)))
    # eigenvalues of a real matrix are exactly real or exact pairs
    if leading.imag != 0.0:
        return BifurcationType.NEIMARK_SACKER, angle
    return (BifurcationType.FOLD if leading.real > 0.0 else BifurcationType.PERIOD_DOUBLING), angle


def bifurcations(branch: Sequence[Orbit]) -> list[Bifurcation]:
    """Every change of stability between neighbours of a branch of rocking orbits, in the branch's order.

    Neighbours may differ in frequency, amplitude and stiffness ratio together. Two changes between the same
    neighbours undo each other and are not seen: the branch must be finer than its windows.

    Raises InvalidInput for neighbours that differ in anything else, NoOrbit when one between them is not found.
    """
    return [_located(before, after) for before, after in pairwise(branch) if before.stable is not after.stable]


def _located(before: Orbit, after: Orbit) -> Bifurcation:
    """The orbit between two with its leading multiplier on the unit circle, by secants (Illinois rule)."""
    if _with_beta(before.specimen, 0.0) != _with_beta(after.specimen, 0.0):
        raise InvalidInput("branch", "neighbours of different specimens", "only beta, omega and amplitude may change")
    # [place, multiplier - 1] at both ends, on the two sides of the circle
    ends = [[0.0, before.multiplier - 1.0], [1.0, after.multiplier - 1.0]]
    orbit, last = before, -1
    for _ in range(MOST_SECANTS):
        (low, low_excess), (high, high_excess) = ends
        place = low + (high - low) * low_excess / (low_excess - high_excess)
        orbit = _between(before, after, place, orbit)
        excess = orbit.multiplier - 1.0
        if abs(excess) < PRECISION:
            break
        moved = 1 if (excess > 0.0) == (high_excess > 0.0) else 0
        ends[moved] = [place, excess]
        if moved == last:
            ends[1 - moved][1] *= 0.5
        last = moved
    kind, angle = leading_type(orbit)
    return Bifurcation(kind, angle, orbit, gains_stability=after.stable)


def _between(before: Orbit, after: Orbit, place: float, guess: Orbit) -> Orbit:
    def mixed(start: float, end: float) -> float:
        return start + place * (end - start)

    beta = mixed(before.specimen.beta or 0.0, after.specimen.beta or 0.0)
    omega, amplitude = mixed(before.omega, after.omega), mixed(before.amplitude, after.amplitude)
    return rocking_orbit(_with_beta(before.specimen, beta), omega, amplitude, guess)


def _with_beta(specimen: Specimen, beta: float) -> Specimen:
    """The specimen with a spring of that stiffness ratio, whatever is written on it."""
    return specimen.model_copy(update={"beta": beta, "spring_label": None})
