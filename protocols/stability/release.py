"""Release of a held motion: a deflection along the dominant pair of multipliers, and the free cycles after it."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from math import hypot, isnan

import numpy as np
from numpy.typing import NDArray

from bench.analysis.multiplier import BOUND, Multiplier, dominant_multiplier, linear_part
from bench.analysis.signals import DRIFT
from bench.control.stabiliser import BLEND, observed
from bench.engine.steps import Dwell, Measured, Outcome, Publish, SetHarmonics, Step
from bench.events import StepStarted
from protocols.common.sine.holding import Hold, HoldCycle
from protocols.common.sine.settling import TableState
from sim.cycle_map import CycleMap

Array = NDArray[np.float64]

DEFLECTION = 8
"""Number of cycles in which the motion is deflected. At least half as many controls as the table and the specimen
have states are required to leave the other multipliers unexcited; a larger number permits smaller controls.
"""

START, LEAST = 0.35, 0.02
"""START: largest deviation at the release, relative to `BOUND`, for an orbit predicted to be stable; it may grow all
the same. LEAST: smallest deviation, relative to the orbit, for an unstable one, whose deviation then grows.
"""

LOST = 2.0
"""Deviation at which the observation ends, relative to the largest deviation of a linear motion."""


@dataclass(frozen=True, eq=False)
class Released:
    """Cycles after a release: their coefficients, shape (n, m), and those of the orbit, shape (m,). The block may have
    `fallen` after them.
    """

    series: Array
    orbit: Array
    fallen: bool = False

    @property
    def multiplier(self) -> Multiplier | None:
        """Dominant multiplier of the cycles in which the motion is linear."""
        return dominant_multiplier(self.series[linear_part(self.series, self.orbit)])


def deflection(found: CycleMap, cycles: int, authority: float) -> NDArray[np.complex128]:
    """Controls of the cycles before a release, shape (DEFLECTION,), of at most `authority`.

    The deviation at the release is chosen so that the motion remains linear for about `cycles` cycles.
    """
    controls, effect = found.excitation(DEFLECTION)
    share = np.clip(abs(found.slowest) ** -float(cycles), LEAST / BOUND, START)
    return controls * min(float(share) * BOUND / effect, authority)


def release(
    run: Hold, found: CycleMap, table: TableState, beta: float, largest: float, cycles: int, authority: float
) -> Generator[Step, Outcome, Released]:
    """Deflect the motion held by `run` along the dominant pair of the map `found`, release it, and observe up to
    `cycles` cycles without control.

    The observation ends early when the deviation is no longer linear or the drift exceeds `largest` [m].
    """
    sine, count = run.sine, run.monitor.cycles
    orbit = np.mean([observed(cycle, table.turn) for cycle in run.used], axis=0)
    size = float(np.linalg.norm(orbit))
    controls = (*deflection(found, cycles, authority), 0j)
    yield Publish(StepStarted(f"beta = {beta:g} at {sine.omega:g} rad/s: deflecting, then observing the deviation"))
    rows = list[Array]()
    first, *others = run.shares
    for number in range(len(controls) + 1 + cycles):
        if number < len(controls):
            control = complex(controls[number])
            yield SetHarmonics((first + control / table.answer, *others), count + 1 + number, BLEND)
        outcome = yield Dwell(1)
        if not isinstance(outcome, Measured):
            return Released(np.array(rows).reshape(-1, orbit.size), orbit, fallen=True)
        # a control that is set before a cycle takes effect in the following cycle
        played = abs(controls[number - 1]) if 0 < number <= len(controls) else 0.0
        for cycle in outcome.cycles:
            y = observed(cycle, table.turn)
            deviation, drift = float(np.linalg.norm(y - orbit)) / size, float(cycle.extreme[DRIFT])
            yield Publish(HoldCycle(sine.omega, beta, count + number + 1, drift, deviation, float(played)))
            if number > len(controls):
                rows.append(y)
            if deviation > LOST * BOUND or drift > largest:
                return Released(np.array(rows).reshape(-1, orbit.size), orbit)
        if not outcome.cycles and number > len(controls):
            # the fit requires consecutive cycles
            break
    return Released(np.array(rows).reshape(-1, orbit.size), orbit)


def parts_of(found: Multiplier, slopes: Sequence[float], table_scale: float) -> dict[str, float]:
    """Standard uncertainties of the modulus by contribution, largest first: scatter of the cycles, pairs of multipliers
    that are not fitted, and amplitude of the table with the relative standard uncertainty `table_scale`. The `slopes`
    are d|mu|/d ln A and its standard uncertainty; NaN for an unknown one, which does not contribute.
    """
    parts = {
        "scatter of the cycles": found.modulus_uncertainty,
        "pairs that are not fitted": found.modulus_other,
        "amplitude of the table": known_norm(slopes) * table_scale,
    }
    return dict(sorted(parts.items(), key=lambda part: -part[1]))


def known_norm(values: Sequence[float]) -> float:
    """Square root of the sum of squares of the known `values`, which are not NaN."""
    return hypot(*(value for value in values if not isnan(value)))


def combined(parts: dict[str, float]) -> float:
    """Combined standard uncertainty of independent contributions."""
    return hypot(*parts.values())
