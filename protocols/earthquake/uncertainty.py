"""Measured against predicted gain: a Monte Carlo through the model, with the motions that the table achieved.

Both tests share the sensors and the specimen, so each draw has one specimen, one scale of the table's sensors and one
pair of lasers for both; the noise is drawn for each. A draw of the measurement, coupled over bare, times a draw of the
prediction over the predicted gain is what may be measured where the model holds (GUM Supplement 1).

The same is drawn with the specimen taken as exactly known: what the bench alone leaves open. Parts that are drawn one
by one say which counts most, and no more: where the response is chaotic each of them alone moves the gain as far as all
together do.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from math import nan

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray

from bench.analysis.budget import COVERAGE, Budget
from bench.analysis.transient_base import BaseMotion
from bench.config.model import BenchConfiguration
from bench.control.starts import CATCH_ANGLE
from protocols.earthquake.observed import Observed
from protocols.earthquake.sensors import drift_errors, u1_errors
from sim.excitation import SampledRecord
from sim.knowledge import SpecimenKnowledge
from sim.rocking import Status, simulate
from sim.specimen import Specimen
from sim.sweep import in_threads

Array = NDArray[np.float64]

TOLERANCE = 1e-8
"""Of the drawn simulations."""

INTERVAL = (0.025, 0.975)

HELD = 0.95
"""Share of the draws that an expanded uncertainty holds."""

CHAOTIC = 2.0
"""Variance of all parts drawn one by one over that of one joint draw from which on they do not add up."""

NONE = SpecimenKnowledge().only()
"""A specimen that is exactly known."""

_KEPT = {
    "stiffness and damping of the frame": ("stiffness", "damping"),
    "stiffness of the spring": ("spring",),
    "restitution of the block": ("restitution",),
}
"""Parts of the specimen's uncertainty, and the widths that make them."""


@dataclass(frozen=True)
class Predicted:
    """What the model says of a pair of motions; gains are NaN where the block topples with the specimen as assumed.

    `alpha_1` and `alpha_2`, shape (n,), are those drawn, NaN where they toppled; `times` [s] are those of overturning.
    """

    nominal: tuple[float, float]
    alpha_1: Array
    alpha_2: Array
    times: Array

    @property
    def chance(self) -> float:
        """Chance of toppling."""
        return float(np.mean(np.isnan(self.alpha_2)))


@dataclass(frozen=True)
class Compared:
    """Measured gains beside their predictions; `low` and `high` hold 95 % of what may be measured of alpha_2,
    `alpha_1_low` and `alpha_1_high` of alpha_1.

    `bench` holds 95 % of the magnitudes of measured minus predicted alpha_2 that the bench leaves open, were the
    specimen known exactly; None where that specimen topples. `budget` has standard uncertainties of alpha_2, each drawn
    alone, the largest first; `chaotic` says that they do not add up.
    """

    alpha_1: float
    alpha_1_uncertainty: float
    alpha_1_predicted: float | None
    alpha_1_low: float | None
    alpha_1_high: float | None
    alpha_2: float
    alpha_2_uncertainty: float
    alpha_2_predicted: float | None
    low: float | None
    high: float | None
    bench: float | None
    budget: Budget
    chaotic: bool
    chance: float

    @property
    def agrees(self) -> bool | None:
        """Whether alpha_2 is what may be measured; None where the model leaves nothing to compare with."""
        return _within(self.alpha_2, self.low, self.high)

    @property
    def alpha_1_agrees(self) -> bool | None:
        """The same of alpha_1."""
        return _within(self.alpha_1, self.alpha_1_low, self.alpha_1_high)


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
    """Gains of `n` specimens that `specimen` may be, under motions that the measured ones may be."""
    import_module("sim.kernel.rocking")  # compiled once, before the threads start
    root = seed if isinstance(seed, SeedSequence) else SeedSequence(seed)
    specimens, scale, *seeds = root.spawn(2 + n)
    drawn = uncertainty.draws(specimen, n, np.random.default_rng(specimens))
    scales = 1.0 + table_scale * np.random.default_rng(scale).standard_normal(n)

    def motion(base: BaseMotion, k: int, random: np.random.Generator) -> SampledRecord:
        return base.draw(random, scales[k]) if noisy else SampledRecord(scales[k] * base.acceleration, base.dt)

    def one(k: int) -> tuple[float, float, float]:
        random = np.random.default_rng(seeds[k])
        return gains(drawn[k], motion(bare, k, random), motion(coupled, k, random))

    found = np.array(in_threads(one, range(n))).reshape(n, 3)
    nominal = gains(specimen, bare.record, coupled.record)
    return Predicted(nominal[:2], found[:, 0], found[:, 1], found[np.isnan(found[:, 1]), 2])


def gains(specimen: Specimen, bare: SampledRecord, coupled: SampledRecord) -> tuple[float, float, float]:
    """alpha_1, alpha_2, and the time at which the block overturned [s]: NaN each where there is none."""
    moved = simulate(specimen, coupled, tolerance=TOLERANCE, overturning_angle=CATCH_ANGLE)
    if moved.status is not Status.COMPLETED:
        return nan, nan, moved.end_time
    free = simulate(specimen.bare(), bare, tolerance=TOLERANCE)
    return moved.peaks.u1 / free.peaks.u1, moved.peaks.drift / free.peaks.drift, nan


def compare(
    bare: Observed, coupled: Observed, specimen: Specimen, configuration: BenchConfiguration, n: int, seed: int
) -> Compared:
    """The gains of two tests with one specimen, which has its spring in the second."""
    sensors = configuration.sensors
    drifts, firsts = (bare.drift, coupled.drift), (bare.u1, coupled.u1)
    of_drift, of_u1, of_all, of_bench, of_parts = SeedSequence(seed).spawn(5)
    errors = drift_errors(drifts, sensors, n, of_drift)
    grounded = configuration.laser_reference == "ground"
    measured_2 = _ratio(np.sum(list(errors.values()), axis=0))
    measured_1 = _ratio(u1_errors(firsts, sensors, grounded, n, of_u1))
    alpha_2 = coupled.drift.peak.value / bare.drift.peak.value
    alpha_1 = coupled.u1.peak.value / bare.u1.peak.value

    def predicted(
        uncertainty: SpecimenKnowledge, count: int, scale: float, noisy: bool, stream: SeedSequence
    ) -> Predicted:
        return predict_draws(
            bare.base, coupled.base, specimen, uncertainty, count, stream, table_scale=scale, noisy=noisy
        )

    everything = predicted(configuration.known, n, sensors.table_scale, True, of_all)
    stood = _stood(everything.alpha_2 * measured_2)
    known = predicted(NONE, n // 2, sensors.table_scale, True, of_bench)
    off = np.abs(_stood(known.alpha_2 * measured_2[: n // 2]) - known.nominal[1])
    low, high = _interval(stood)
    low_1, high_1 = _interval(_stood(everything.alpha_1 * measured_1))
    parts = {name: alpha_2 * float(_ratio(each).std()) for name, each in errors.items()}
    parts |= _parts(predicted, configuration.known, n // 4, sensors.table_scale, of_parts)
    apart = sum(value**2 for value in parts.values())
    return Compared(
        alpha_1=alpha_1,
        alpha_1_uncertainty=COVERAGE * alpha_1 * float(measured_1.std()),
        alpha_1_predicted=_known(everything.nominal[0]),
        alpha_1_low=low_1,
        alpha_1_high=high_1,
        alpha_2=alpha_2,
        alpha_2_uncertainty=COVERAGE * alpha_2 * float(measured_2.std()),
        alpha_2_predicted=_known(everything.nominal[1]),
        low=low,
        high=high,
        bench=_known(float(np.quantile(off, HELD))) if off.size else None,
        budget=Budget(parts),
        chaotic=bool(stood.size) and apart > CHAOTIC * float(np.var(stood)),
        chance=everything.chance,
    )


def _parts(
    predicted: Callable[[SpecimenKnowledge, int, float, bool, SeedSequence], Predicted],
    uncertainty: SpecimenKnowledge,
    n: int,
    table_scale: float,
    seed: SeedSequence,
) -> dict[str, float]:
    """Standard deviation of the predicted alpha_2 by each part of the model's inputs alone."""
    of_noise, of_scale, *streams = seed.spawn(2 + len(_KEPT))
    runs = {
        "noise of the table's motion": predicted(NONE, n, 0.0, True, of_noise),
        "scale of the table's sensors": predicted(NONE, n, table_scale, False, of_scale),
    }
    for (name, kept), stream in zip(_KEPT.items(), streams, strict=True):
        runs[name] = predicted(uncertainty.only(*kept), n, 0.0, False, stream)
    return {name: float(np.nanstd(run.alpha_2)) if run.chance < 1.0 else 0.0 for name, run in runs.items()}


def _ratio(errors: Array) -> Array:
    """Coupled over bare, from relative errors of both, shape (2, n)."""
    return (1.0 + errors[1]) / (1.0 + errors[0])


def _stood(gains: Array) -> Array:
    """Without the draws that toppled."""
    return gains[np.isfinite(gains)]


def _interval(stood: Array) -> tuple[float | None, float | None]:
    """Where 95 % of the draws lie."""
    if not stood.size:
        return None, None
    low, high = np.quantile(stood, INTERVAL)
    return float(low), float(high)


def _within(value: float, low: float | None, high: float | None) -> bool | None:
    return None if low is None or high is None else low <= value <= high


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
