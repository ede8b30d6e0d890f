"""Uncertainty band of a predicted alpha_2 due to the uncertainty of the specimen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.gain import COVERAGE
from sim.ensemble import record_gains, steady_gains
from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.gain import Branch
from sim.knowledge import SPRING, SpecimenKnowledge
from sim.sensitivity import Sensitivity, budget, sensitivities
from sim.specimen import Specimen
from sim.steady import NoOrbit, Orbit
from sim.sweep import Done

INTERVAL = (0.025, 0.975)
"""Quantiles that enclose 95 % of the members of a Monte Carlo simulation."""

SEED = 20260101
"""Seed of the members: the same for every point, so that a band is as smooth as its curve."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Bands:
    """Bands of alpha_2 of n motions, arrays of shape (n,); NaN where no band can be stated.

    `uncertainty` is expanded (k = 2); `low` and `high` enclose 95 %; `share` is the fraction of the members that have
    a finite gain (1 for a first-order band).
    """

    uncertainty: Floats
    low: Floats
    high: Floats
    share: Floats


def bands(
    orbits: Sequence[Orbit],
    alpha_2: Sequence[float] | Floats,
    known: SpecimenKnowledge,
    members: int = 0,
    done: Done | None = None,
    scheduler: str | None = None,
) -> Bands:
    """Band around each `alpha_2`, shape (n,), of the motions `orbits`.

    With `members` > 0, the band is from a Monte Carlo simulation with that number of draws. Otherwise it is of first
    order: the gain is computed at one standard uncertainty on both sides along each independent direction (GUM 5.1.4,
    note 2), and the band is symmetric but not below zero. Where the motion exists on only one side, the result of that
    side is used for both.
    """
    best = np.asarray(alpha_2, dtype=np.float64)
    of: dict[Specimen, list[Specimen]] = {}
    for orbit in orbits:
        if orbit.specimen not in of:
            of[orbit.specimen] = _members(orbit.specimen, known, members)
    # pad with the specimen itself: if a quantity is exact for only some of the springs, the numbers of members differ
    most = max(map(len, of.values()), default=0)
    own = [of[orbit.specimen] + [orbit.specimen] * (most - len(of[orbit.specimen])) for orbit in orbits]
    gains = steady_gains(orbits, own, done=done, scheduler=scheduler)[:, :, 1]
    return _drawn(gains) if members else _first_order(best, gains)


def record_bands(
    specimens: Sequence[Specimen],
    record: SampledRecord,
    known: SpecimenKnowledge,
    members: int,
    scheduler: str | None = None,
) -> Bands:
    """Bands of alpha_2 of n `specimens` under `record`, started from rest, by Monte Carlo simulation with `members`
    draws for each specimen.

    A first-order band does not apply here, because toppling and the times of impacts do not vary smoothly with the
    parameters.
    """
    drawn = [_members(specimen, known, members) for specimen in specimens]
    gains = record_gains([one for own in drawn for one in own], record, scheduler)[:, 1]
    return _drawn(gains.reshape(len(specimens), members))


def _members(specimen: Specimen, known: SpecimenKnowledge, members: int) -> list[Specimen]:
    if members:
        return known.draws(specimen, members, np.random.default_rng(SEED))
    return [one for pair in known.deviations(specimen) for one in pair]


def _first_order(best: Floats, gains: Floats) -> Bands:
    sides = gains.reshape(len(best), gains.shape[1] // 2, 2) - best[:, None, None]
    lost = np.isnan(sides)
    # replace a missing side by the mirror image of the other
    one, other = (np.where(lost[:, :, k], -sides[:, :, 1 - k], sides[:, :, k]) for k in (0, 1))
    size = COVERAGE * np.sqrt(np.sum((0.5 * (one - other)) ** 2, axis=1))
    return Bands(size, np.maximum(best - size, 0.0), best + size, np.ones(best.size))


def _drawn(gains: Floats) -> Bands:
    n = len(gains)
    share = np.isfinite(gains).mean(axis=1)
    size, low, high = np.full(n, np.nan), np.full(n, np.nan), np.full(n, np.nan)
    some = share * gains.shape[1] > 1.0
    if some.any():
        size[some] = COVERAGE * np.nanstd(gains[some], axis=1, ddof=1)
        low[some], high[some] = np.nanquantile(gains[some], INTERVAL, axis=1)
    return Bands(size, low, high, share)


def expanded_uncertainty(branch: Branch, known: SpecimenKnowledge) -> float | None:
    """Expanded uncertainty (k = 2) of the predicted alpha_2 of a steady motion, to first order.

    Computed from the sensitivities of the steady motion and the covariance of its inputs. The uncertainty of a spring
    is that of its k_C, so that beta = k_C / k1 is anticorrelated with k1. None if the motion cannot be differentiated.
    """
    orbit = branch.orbit
    specimen = orbit.specimen
    try:
        slopes = sensitivities(specimen, orbit.omega, orbit.amplitude, orbit.branch, orbit)
    except (NoOrbit, InvalidInput):
        return None
    beta, k1 = slopes["beta"], slopes["k1"]
    each = {
        **slopes,
        "k1": Sensitivity(
            k1.value,
            alpha_1=k1.alpha_1 - beta.value / k1.value * beta.alpha_1,
            alpha_2=k1.alpha_2 - beta.value / k1.value * beta.alpha_2,
        ),
        SPRING: Sensitivity(specimen.k_c, beta.alpha_1 / k1.value, beta.alpha_2 / k1.value),
    }
    sizes = {name: size * each[name].value for name, size in known.relative(specimen).items()}
    return COVERAGE * budget(each, sizes, known.correlations(specimen)).alpha_2
