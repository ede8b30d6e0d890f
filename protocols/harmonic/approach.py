"""Second start of a model-free hold, which ends close to an unstable orbit.

The identification needs cycles near the orbit, but the free motion may never come close to it. The second start pauses
where the orbit is stable, until the motion has approached it, and then sweeps to the point within a few cycles.
"""

import numpy as np

from bench.control.oscillator import Segment
from bench.control.starts import Start
from protocols.common.sine.settling import Settled
from sim.gain import predict_gain
from sim.specimen import Specimen

STEP, REACH = 0.25, 1.0
"""Step of the search for a stable orbit above the frequency of the point, and its range [rad/s]."""

DECAYS = 0.98
"""Largest predicted modulus of the multipliers of an orbit that is taken for stable: with a larger one, that of a
specimen within the uncertainty may be unstable.
"""

PAUSE = 60.0
"""Duration of the pause [s]."""

RATE = 0.5
"""Rate of the last sweep [rad/s per s]."""

FAR = 0.15
"""Half the range of the peaks of a free motion, relative to their middle, above which the motion is started again."""


def far(settled: Settled) -> bool:
    """Whether a free motion is far from a periodic one."""
    if settled.motion is None:
        return False
    least, greatest = settled.motion.peaks.least.drift, settled.motion.peaks.greatest.drift
    return greatest - least > FAR * (greatest + least)


def stable_above(specimen: Specimen, omega: float, amplitude: float) -> float | None:
    """Nearest frequency above `omega` [rad/s] at which the rocking orbit is stable; None if there is none in reach."""
    for near in omega + np.arange(STEP, REACH + 0.5 * STEP, STEP):
        branch = predict_gain(specimen, float(near), amplitude).rocking
        if branch is not None and branch.multiplier < DECAYS:
            return float(near)
    return None


def with_pause(start: Start, pause: float | None) -> tuple[Segment, ...]:
    """Segments of `start` with a pause at the frequency `pause` [rad/s], if it sweeps through that frequency."""
    last = start.segments[-1]
    for k in range(1, len(start.segments)):
        before, chirp = start.segments[k - 1 : k + 1]
        if pause is not None and before.omega > pause > chirp.omega:
            part = (before.omega - pause) / (before.omega - chirp.omega)
            return (
                *start.segments[:k],
                Segment(part * chirp.duration, chirp.amplitude, pause),
                Segment(PAUSE, last.amplitude, pause),
                Segment((pause - last.omega) / RATE, last.amplitude, last.omega),
            )
    return start.segments
