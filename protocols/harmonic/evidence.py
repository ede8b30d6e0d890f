"""What measured cycles must show before they are used."""

from collections.abc import Sequence

import numpy as np

from bench.analysis.cycles import Cycle, mean_amplitude
from bench.analysis.signals import ACCELERATION
from sim.errors import RockbenchError

ENOUGH = 0.75
"""Share of the asked cycles that must have come with nearly all their samples."""

AUDIBLE = 5.0
"""How many standard deviations of its fit the table's acceleration must reach to count as an answer to the drive."""


class Unmeasurable(RockbenchError):
    """The signals do not show what the protocol needs to go on."""

    error_code = "not_measurable"


def need_cycles(cycles: Sequence[Cycle], asked: int) -> None:
    """Raise Unmeasurable when too many cycles lack samples."""
    if len(cycles) < ENOUGH * asked:
        raise Unmeasurable(
            f"{asked - len(cycles)} of {asked} cycles lack samples: a sensor leaves its range; move it or ask for less"
        )


def need_answer(cycles: Sequence[Cycle]) -> None:
    """Raise Unmeasurable when the table does not follow the drive."""
    moved = mean_amplitude(cycles, ACCELERATION)
    doubt = float(np.mean([cycle.noise[ACCELERATION] * np.sqrt(2.0 / cycle.samples) for cycle in cycles]))
    if not moved > AUDIBLE * doubt:
        raise Unmeasurable(
            f"the table does not answer the drive: {moved:.2g} m/s2 measured, noise {doubt:.2g} m/s2;"
            " check the amplifier, the enable line and the accelerometer"
        )
