"""Ground motions for a model that is smaller than its prototype, on a table that has the prototype's gravity.

Gravity decides when a block lifts off: acceleration is kept. With lambda_L = model length over prototype length,

    lambda_a = 1,    lambda_t = lambda_v = lambda_L^(1/2),    lambda_d = lambda_L,    frequency / lambda_L^(1/2).

The rocking of model and prototype is then the same motion in scaled time, theta(t / lambda_t), as long as these
numbers are the same (`RockingNumbers`): slenderness, restitution, the coupling spring's stiffness and the frame's
frequencies in units of the block's frequency parameter p = (M g R / J)^(1/2), the masses' and lengths' ratios, and the
damping ratios. p itself goes with lambda_L^(-1/2): a small block topples more easily because its p is large against the
frequencies of the ground, unless the record's time is scaled as here.
Source: Housner, Bull. Seism. Soc. Am. 53, 1963 (p); Makris, Earthquake Eng. Struct. Dyn. 43, 2014 (size effect).
"""

from dataclasses import dataclass
from math import ceil, hypot, isfinite, sqrt

import numpy as np

from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.specimen import Specimen

ROUNDING = 1e-9
"""Of a ratio of two steps, relative."""


@dataclass(frozen=True)
class RockingNumbers:
    """What model and prototype must share; `p` [1/s] is the scale of their time and not among it.

    `slenderness` h_b/b; `restitution`; `coupling` k_C/(M p^2); `frequencies` of the bare frame over p; `masses` m1/M
    and m2/M; `height` h1/h_b of the spring; `spring` d/b, its free length.
    """

    p: float
    slenderness: float
    restitution: float
    coupling: float
    frequencies: tuple[float, float]
    masses: tuple[float, float]
    height: float
    spring: float

    @staticmethod
    def of(specimen: Specimen) -> "RockingNumbers":
        """Those of a specimen."""
        frame, block = specimen.frame, specimen.block
        p = sqrt(block.mass * specimen.g * hypot(block.b, block.h_b) / block.inertia)
        lower, upper = frame.natural_frequencies
        return RockingNumbers(
            p=p,
            slenderness=block.slenderness,
            restitution=block.restitution,
            coupling=specimen.k_c / (block.mass * p * p),
            frequencies=(lower / p, upper / p),
            masses=(frame.m1 / block.mass, frame.m2 / block.mass),
            height=frame.h1 / block.h_b,
            spring=specimen.d / block.b,
        )


def scaled(record: SampledRecord, length_ratio: float) -> SampledRecord:
    """`record` for a model of lambda_L = `length_ratio`: the same accelerations, the step times lambda_L^(1/2).

    Raises InvalidInput unless the ratio is positive.
    """
    if not (isfinite(length_ratio) and length_ratio > 0.0):
        raise InvalidInput("length_ratio", length_ratio, "model over prototype length must be a positive number")
    return SampledRecord(record.acceleration, record.dt * sqrt(length_ratio))


def resampled(record: SampledRecord, dt: float) -> SampledRecord:
    """`record` at a step of `dt` [s], not longer than its own, each new sample on its straight lines.

    Where `dt` divides the record's step the motion is the same; elsewhere the corners are cut by chords. Where it does
    not divide the duration, a last sample of zero is added beyond the end. Raises InvalidInput for a longer step: what
    lies between the samples would be lost or folded into lower frequencies.
    """
    if not 0.0 < dt <= record.dt * (1.0 + ROUNDING):
        raise InvalidInput("dt", dt, f"it must be above 0 and at most the record's step, {record.dt:g} s")
    steps = record.duration / dt
    count = ceil(steps * (1.0 - ROUNDING))
    # in steps of the record: a whole number of new steps ends exactly on its last sample
    place = np.arange(count + 1) * (dt / record.dt)
    if abs(count - steps) <= ROUNDING * steps:
        place[-1] = record.acceleration.size - 1
    values = np.interp(place, np.arange(record.acceleration.size), record.acceleration, right=0.0)
    return SampledRecord(values, dt)
