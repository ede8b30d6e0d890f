"""Long-term motions of the coupled specimen on the table, where the periodic rocking motion is unstable."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, nan

import numpy as np
from numpy.typing import NDArray

from bench.datafile.tables import Column, Table
from bench.prediction.requests import AttractorRequest
from bench.prediction.steady import predict_spectra
from bench.progress import Progress, counting, silent
from sim.attractor import KEPT, Attractor, attractor
from sim.gain import Branch
from sim.knowledge import SpecimenKnowledge
from sim.linear import steady_peaks
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import NoOrbit
from sim.sweep import in_threads
from sim.table_orbit import table_orbit

SEED = 1
"""Seed of the drawn specimens, fixed so that predictions are reproducible."""

CYCLES = 1500

MEMBERS, MEMBER_CYCLES = 39, 600
"""Number of drawn specimens, and largest number of cycles for which the motion of each is followed, about as long as a
test. A further specimen lies between the smallest and the largest of n with the probability (n - 1) / (n + 1), whatever
their distribution: 95 % for 39.
"""

PEAKS = "gain of the largest drift within one period, over all positions of the period"
"""Beginning of the descriptions of least, mean and greatest peak."""


@dataclass(frozen=True, eq=False)
class LongTerm:
    """Long-term motion with the spring `beta` at `omega` [rad/s]. `orbit` is the gain of the rocking orbit at this
    point.

    If the orbit on the table is `stable`, the motion is the orbit. The motion repeats after `repeats` cycles; 0 if it
    does not repeat, or if the block falls. `gains`, shape (n,), are the gains of the peaks of the last cycles, without
    entries if the block falls, which happens after `fallen` cycles. `least`, `mean` and `greatest` are the gains of the
    largest drift within a period that slides over these cycles, NaN if the block falls. `low` and `high`, shape (3,),
    are the smallest and largest values of these three gains among the `counted` drawn specimens, NaN with fewer than
    two: all but those whose block falls within the number of cycles that describe a motion; of one that falls later,
    the cycles before count. `falls` is the fraction of drawn specimens whose block falls, NaN without any.
    """

    omega: float
    beta: float
    orbit: float
    stable: bool
    gains: NDArray[np.float64]
    least: float
    mean: float
    greatest: float
    repeats: int
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    counted: int = 0
    fallen: int | None = None
    falls: float = nan


def long_term(
    branch: Branch,
    known: SpecimenKnowledge,
    shaker: Shaker,
    harmonics: int,
    *,
    cycles: int = CYCLES,
    members: int = MEMBERS,
) -> LongTerm:
    """Long-term motion, `cycles` cycles after a start near the rocking orbit of `branch`, for its specimen and, after
    at most `MEMBER_CYCLES`, for `members` specimens drawn from `known`; the orbit itself if it is stable on the table.

    The amplitude of the table's acceleration and its harmonics up to number `harmonics` are held at those of the orbit.
    Raises NoOrbit if there is no such orbit on the table.
    """
    fixed = branch.orbit
    orbit, beta = table_orbit(fixed, shaker, harmonics), fixed.specimen.label or 0.0
    if orbit.stable:
        gain, absent = branch.alpha_2, np.full(3, nan)
        return LongTerm(fixed.omega, beta, gain, True, np.array([gain]), gain, gain, gain, 1, absent, absent)

    def motions(case: tuple[Specimen, int]) -> tuple[float, Attractor]:
        specimen, length = case
        bare = steady_peaks(specimen.bare(), fixed.omega, fixed.amplitude).drift
        return bare, attractor(specimen, shaker, orbit, length)

    drawn = known.draws(fixed.specimen, members, np.random.default_rng(SEED))
    shorter = min(cycles, MEMBER_CYCLES)
    (bare, motion), *others = in_threads(motions, [(fixed.specimen, cycles), *((each, shorter) for each in drawn)])
    kept = np.array([np.array(other.within) / each for each, other in others if isfinite(other.within[0])])
    low, high = (kept.min(axis=0), kept.max(axis=0)) if len(kept) > 1 else np.full((2, 3), nan)
    falls = sum(other.fallen is not None for _, other in others) / len(others) if others else nan
    least, mean, most = (each / bare if motion.fallen is None else nan for each in motion.within)
    return LongTerm(
        fixed.omega,
        beta,
        branch.alpha_2,
        stable=False,
        gains=motion.peaks[:, 1] / bare,
        least=least,
        mean=mean,
        greatest=most,
        repeats=motion.repeats,
        low=low,
        high=high,
        counted=len(kept),
        fallen=motion.fallen,
        falls=falls,
    )


def long_terms(
    specimen: Specimen,
    known: SpecimenKnowledge,
    shaker: Shaker,
    request: AttractorRequest,
    progress: Progress = silent,
) -> list[LongTerm]:
    """Long-term motions at all requested points at which there is a rocking orbit on the table."""
    branches = [each.rocking for each in predict_spectra(specimen, request, progress) if each.rocking is not None]
    done = counting(progress, "simulating the long-term motions")
    found: list[LongTerm] = []
    for branch in branches:
        done(len(found), len(branches))
        try:
            motion = long_term(branch, known, shaker, request.harmonics, cycles=request.cycles, members=request.members)
        except NoOrbit:
            continue
        found.append(motion)
    return found


def attractors_table(found: Sequence[LongTerm]) -> Table:
    """Table with one row per long-term motion."""

    def numbers(values: Sequence[float], unit: str, description: str) -> Column:
        return Column(np.array(values, dtype=np.float64), unit, description)

    repeats = "number of cycles after which the motion repeats; 0 if it does not repeat, or if the block falls"
    return {
        "beta": numbers([each.beta for each in found], "1", "stiffness ratio k_C/k1 of the coupling spring"),
        "omega_rad_s": numbers([each.omega for each in found], "rad/s", "circular frequency of the base motion"),
        "alpha_2": numbers([each.orbit for each in found], "1", "gain of the peak drift on the orbit"),
        "stable": Column(
            np.array([each.stable for each in found], dtype=bool), "", "whether the orbit on the table is stable"
        ),
        "repeats_cycles": Column(np.array([each.repeats for each in found], dtype=np.int64), "1", repeats),
        "alpha_2_least": numbers([each.least for each in found], "1", f"{PEAKS}: smallest"),
        "alpha_2_mean": numbers([each.mean for each in found], "1", f"{PEAKS}: mean"),
        "alpha_2_greatest": numbers([each.greatest for each in found], "1", f"{PEAKS}: largest"),
        **{
            f"{name}_{end}": numbers(
                [values[k] for values in ends],
                "1",
                f"{side} value of alpha_2_{name} among the specimens whose block does not fall within {KEPT} cycles",
            )
            for k, name in enumerate(("least", "mean", "greatest"))
            for end, side, ends in (
                ("low", "smallest", [each.low for each in found]),
                ("high", "largest", [each.high for each in found]),
            )
        },
        "falls": numbers([each.falls for each in found], "1", "fraction of the drawn specimens whose block falls"),
    }
