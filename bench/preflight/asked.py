"""What the parts of a campaign ask of each limited quantity, and the demand of them all."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.preflight.forecast import Demand

LIKELY = 0.95
"""Share of the drawn specimens that a likely demand covers."""

UNKNOWN_SHAKER = {
    "force": "the moving mass is not known: give hardware.moving_mass and hardware.force_constant",
    "current": "the force constant is not known: give hardware.moving_mass and hardware.force_constant",
    "heating": "the force constant is not known: give hardware.moving_mass and hardware.force_constant",
}
"""Why the quantities of the shaker are not predicted where they are not."""


@dataclass(frozen=True, eq=False)
class Asked:
    """What one part asks of each quantity, shape (1 + draws,): as assumed first, then as drawn.

    `chance` that the block stands, where that was asked.
    """

    name: str
    values: dict[str, NDArray[np.float64]]
    chance: float | None = None


def demand(quantity: str, asked: Sequence[Asked], unknown: Mapping[str, str]) -> Demand:
    """The most that any part asks of `quantity`; what `unknown` says of it where none knows."""
    known = [each for each in asked if quantity in each.values]
    if not known:
        return Demand(quantity, None, None, unknown[quantity])
    values = np.array([each.values[quantity] for each in known])
    where, most = int(values[:, 0].argmax()), values.max(axis=0)
    likely = max(float(np.quantile(most[1:], LIKELY)), float(most[0]))
    storey = {"laser_1": "storey 1 in ", "laser_2": "storey 2 in "}.get(quantity, "")
    return Demand(quantity, float(most[0]), likely, f"{storey}{known[where].name}")
