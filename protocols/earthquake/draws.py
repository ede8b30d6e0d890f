"""Gains of specimens and table motions that are drawn at random within their uncertainties.

The bare frame is linear. If a draw differs from the known frame and the measured motion only by the scale of the
motion, its peaks are those of a single run, multiplied by the scale.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from math import nan

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray

from bench.analysis.transient_base import BaseMotion
from bench.control.starts import CATCH_ANGLE
from protocols.earthquake.measurement import TOLERANCE
from sim.knowledge import SpecimenKnowledge
from sim.record_runs import RecordRuns
from sim.rocking import Peaks, Status
from sim.specimen import Specimen
from sim.sweep import in_threads

Array = NDArray[np.float64]

CHUNK = 10
"""Number of successive draws that a thread computes with the same work arrays."""


@dataclass(frozen=True)
class Predicted:
    """Predicted gains under the motions of a bare and a coupled test.

    `nominal` contains alpha_1 and alpha_2 of the nominal specimen, NaN if its block topples. `alpha_1` and `alpha_2`,
    shape (n,), are the gains of the draws, NaN where the block topples; `times` [s] are the times of overturning in
    these draws.
    """

    nominal: tuple[float, float]
    alpha_1: Array
    alpha_2: Array
    times: Array

    @property
    def chance(self) -> float:
        """Predicted probability of toppling."""
        return float(np.mean(np.isnan(self.alpha_2)))


def predict_draws(
    bare: BaseMotion,
    coupled: BaseMotion,
    specimen: Specimen,
    uncertainty: SpecimenKnowledge,
    n: int,
    seed: int | SeedSequence,
    *,
    table_scale: float = 0.0,
    noisy: bool = True,
) -> Predicted:
    """Gains of `n` draws of the specimen and of the table motions within their uncertainties.

    `table_scale` is the relative standard uncertainty of the motions' common scale; their noise is drawn if `noisy`.
    """
    import_module("sim.kernel.rocking")  # compiled once, before the threads start
    root = seed if isinstance(seed, SeedSequence) else SeedSequence(seed)
    specimens, scale, *seeds = root.spawn(2 + n)
    drawn = uncertainty.draws(specimen, n, np.random.default_rng(specimens))
    scales = (1.0 + table_scale * np.random.default_rng(scale).standard_normal(n)).tolist()
    known = _Runs(bare, coupled)
    free = known.bare(specimen, bare.acceleration)
    nominal = known.gains(specimen, coupled.acceleration, lambda: free)

    def chunk(first: int) -> list[tuple[float, float, float]]:
        runs = _Runs(bare, coupled)
        return [one(runs, k) for k in range(first, min(first + CHUNK, n))]

    def one(runs: _Runs, k: int) -> tuple[float, float, float]:
        member = drawn[k]
        if noisy:
            random = np.random.default_rng(seeds[k])
            base, moved = bare.draw(random, scales[k]), coupled.draw(random, scales[k])
            return runs.gains(member, moved.acceleration, lambda: runs.bare(member, base.acceleration))
        if scales[k] == 1.0 and member == specimen:
            # a contribution without uncertainty
            return nominal
        moved = scales[k] * coupled.acceleration
        if member.frame == specimen.frame:
            return runs.gains(member, moved, lambda: _scaled(free, scales[k]))
        return runs.gains(member, moved, lambda: runs.bare(member, scales[k] * bare.acceleration))

    found = np.array([row for rows in in_threads(chunk, range(0, n, CHUNK)) for row in rows]).reshape(n, 3)
    return Predicted(nominal[:2], found[:, 0], found[:, 1], found[np.isnan(found[:, 1]), 2])


class _Runs:
    """Simulated runs of both tests; their work arrays may be used by one thread only."""

    def __init__(self, bare: BaseMotion, coupled: BaseMotion) -> None:
        self._coupled = RecordRuns(coupled.acceleration.size, coupled.dt)
        alike = (bare.acceleration.size, bare.dt) == (coupled.acceleration.size, coupled.dt)
        self._bare = self._coupled if alike else RecordRuns(bare.acceleration.size, bare.dt)

    def bare(self, specimen: Specimen, acceleration: Array) -> Peaks:
        """Peaks of the bare frame."""
        return self._bare.run(specimen.bare(), acceleration, tolerance=TOLERANCE).peaks

    def gains(self, specimen: Specimen, acceleration: Array, bare: Callable[[], Peaks]) -> tuple[float, float, float]:
        """alpha_1, alpha_2 and the time of overturning [s]: the gains are NaN if the block topples, else the time."""
        moved = self._coupled.run(specimen, acceleration, tolerance=TOLERANCE, overturning_angle=CATCH_ANGLE)
        if moved.status is not Status.COMPLETED:
            return nan, nan, moved.end_time
        free = bare()
        return moved.peaks.u1 / free.u1, moved.peaks.drift / free.drift, nan


def _scaled(peaks: Peaks, scale: float) -> Peaks:
    """Peaks of a linear motion under `scale` times the record."""
    return Peaks(*(abs(scale) * peak for peak in (peaks.u1, peaks.drift, peaks.theta)))
