"""Measured against predicted gain: a Monte Carlo through the model, with the motions that the table achieved.

Both tests share the sensors and the specimen, so each draw has one specimen, one scale of the table's sensors and one
pair of lasers for both; the noise is drawn for each. A draw of the measurement, coupled over bare, times a draw of the
prediction over the predicted gain is what may be measured where the model holds (GUM Supplement 1).
"""

import json
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import import_module
from math import nan

import numpy as np
from numpy.typing import NDArray

from bench.analysis.gain import COVERAGE
from bench.analysis.transient_base import BaseMotion
from bench.config.model import BenchConfiguration
from bench.control.starts import CATCH_ANGLE
from protocols.earthquake.observed import Observed
from protocols.earthquake.sensors import drift_errors, u1_errors
from sim.excitation import SampledRecord
from sim.rocking import Status, simulate
from sim.specimen import Specimen
from sim.uncertainty import SpecimenUncertainty

Array = NDArray[np.float64]

TOLERANCE = 1e-8
"""Of the drawn simulations."""

INTERVAL = (0.025, 0.975)

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
    """A measured gain beside its prediction; `low` and `high` hold 95 % of what may be measured.

    `parts` are standard uncertainties of alpha_2, the largest first.
    """

    alpha_1: float
    alpha_1_uncertainty: float
    alpha_1_predicted: float | None
    alpha_2: float
    alpha_2_uncertainty: float
    alpha_2_predicted: float | None
    low: float | None
    high: float | None
    agrees: bool | None
    parts: dict[str, float]
    chance: float

    @property
    def dominating(self) -> str:
        """The largest part."""
        return next(iter(self.parts), "")

    @property
    def bench(self) -> float:
        """Expanded uncertainty of measured minus predicted as far as the bench leaves it open, not the specimen."""
        return COVERAGE * sum(value**2 for name, value in self.parts.items() if name not in _KEPT) ** 0.5

    @property
    def parts_as_json(self) -> str:
        """All parts, for a file."""
        return json.dumps({name: float(f"{value:.3g}") for name, value in self.parts.items()})


def predict_draws(
    bare: BaseMotion,
    coupled: BaseMotion,
    specimen: Specimen,
    uncertainty: SpecimenUncertainty,
    n: int,
    seed: int,
    *,
    table_scale: float = 0.0,
    noisy: bool = True,
) -> Predicted:
    """Gains of `n` specimens that `specimen` may be, under motions that the measured ones may be."""
    import_module("sim.kernel.rocking")  # compiled once, before the threads start
    drawn = uncertainty.draws(specimen, n, np.random.default_rng(seed))
    scales = 1.0 + table_scale * np.random.default_rng(seed + 1).standard_normal(n)
    seeds = np.random.SeedSequence(seed).spawn(n)

    def motion(base: BaseMotion, k: int, random: np.random.Generator) -> SampledRecord:
        return base.draw(random, scales[k]) if noisy else SampledRecord(scales[k] * base.acceleration, base.dt)

    def one(k: int) -> tuple[float, float, float]:
        random = np.random.default_rng(seeds[k])
        return gains(drawn[k], motion(bare, k, random), motion(coupled, k, random))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = np.array(list(pool.map(one, range(n)))).reshape(n, 3)
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
    accuracy, ranges = configuration.analysis, configuration.laser_ranges
    drifts, firsts = (bare.drift, coupled.drift), (bare.u1, coupled.u1)
    noise, lasers = drift_errors(drifts, accuracy, ranges, n, seed)
    grounded = configuration.laser_reference == "ground"
    measured_2 = _ratio(noise + lasers)
    measured_1 = _ratio(u1_errors(firsts, accuracy, ranges, grounded, n, seed + 1))
    alpha_2 = coupled.drift.peak.value / bare.drift.peak.value
    alpha_1 = coupled.u1.peak.value / bare.u1.peak.value

    def predicted(uncertainty: SpecimenUncertainty, count: int, scale: float, noisy: bool) -> Predicted:
        return predict_draws(
            bare.base, coupled.base, specimen, uncertainty, count, seed, table_scale=scale, noisy=noisy
        )

    everything = predicted(configuration.uncertainty, n, accuracy.table_scale, True)
    may_be = everything.alpha_2 * measured_2
    stood = may_be[np.isfinite(may_be)]
    low, high = (float(np.quantile(stood, q)) for q in INTERVAL) if stood.size else (None, None)
    parts = {
        "noise of the peaks": alpha_2 * float(_ratio(noise).std()),
        "lasers": alpha_2 * float(_ratio(lasers).std()),
    }
    parts |= _parts(predicted, configuration.uncertainty, n // 4, accuracy.table_scale)
    return Compared(
        alpha_1=alpha_1,
        alpha_1_uncertainty=COVERAGE * alpha_1 * float(measured_1.std()),
        alpha_1_predicted=_known(everything.nominal[0]),
        alpha_2=alpha_2,
        alpha_2_uncertainty=COVERAGE * alpha_2 * float(measured_2.std()),
        alpha_2_predicted=_known(everything.nominal[1]),
        low=low,
        high=high,
        agrees=None if low is None or high is None else low <= alpha_2 <= high,
        parts=dict(sorted(parts.items(), key=lambda part: -part[1])),
        chance=everything.chance,
    )


def _parts(
    predicted: Callable[[SpecimenUncertainty, int, float, bool], Predicted],
    uncertainty: SpecimenUncertainty,
    n: int,
    table_scale: float,
) -> dict[str, float]:
    """Standard deviation of the predicted alpha_2 by each part of the model's inputs alone."""
    none = SpecimenUncertainty(**dict.fromkeys(SpecimenUncertainty.model_fields, 0.0))
    runs = {
        "noise of the table's motion": predicted(none, n, 0.0, True),
        "scale of the table's sensors": predicted(none, n, table_scale, False),
    }
    for name, kept in _KEPT.items():
        only = none.model_copy(update={width: getattr(uncertainty, width) for width in kept})
        runs[name] = predicted(only, n, 0.0, False)
    return {name: float(np.nanstd(run.alpha_2)) if run.chance < 1.0 else 0.0 for name, run in runs.items()}


def _ratio(errors: Array) -> Array:
    """Coupled over bare, from relative errors of both, shape (2, n)."""
    return (1.0 + errors[1]) / (1.0 + errors[0])


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
