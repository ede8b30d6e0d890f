"""Comparison of measured and predicted gain by Monte Carlo simulation under the achieved motions of the table.

The bare and the coupled test share sensors and specimen, so each draw has one specimen, one scale of the table's
sensors and one pair of lasers for both; noise is drawn separately. If the model holds, the measured gain is
distributed as the product of the drawn predicted gain and the drawn error of the measured ratio of coupled to bare,
expressed as a factor (GUM Supplement 1).

A second set of draws, with an exactly known specimen, gives the uncertainty due to the bench alone. Contributions drawn
one at a time indicate only which is the largest. They do not add up where the response is chaotic: each one alone then
changes the gain as much as all of them together.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import SeedSequence
from numpy.typing import NDArray

from bench.analysis.draws import Draws
from bench.analysis.output_errors import late, steps
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.uncertainty import COVERAGE, NOISE, Budget
from bench.config.model import BenchConfiguration
from protocols.earthquake.draws import Predicted, predict_draws
from protocols.earthquake.observation import Observed, PeakSeen
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Specimen

Array = NDArray[np.float64]

INTERVAL = (0.025, 0.975)

HELD = 0.95
"""Coverage probability of an expanded uncertainty."""

CHAOTIC = 2.0
"""Ratio of the summed variances of single contributions to the variance of a joint draw above which they are considered
not to add up.
"""

NONE = SpecimenKnowledge().only()
"""An exactly known specimen."""

_KEPT = {
    "stiffness and damping of the frame": ("stiffness", "damping"),
    "stiffness of the spring": ("spring",),
    "restitution of the block": ("restitution",),
}
"""Contributions of the specimen's uncertainty, and the fields of `SpecimenKnowledge` that define them."""


@dataclass(frozen=True)
class Compared:
    """Measured and predicted gains; `low` and `high` bound the 95 % interval of a measured alpha_2, `alpha_1_low` and
    `alpha_1_high` that of a measured alpha_1.

    `bench` is the 95 % quantile of |measured - predicted| alpha_2 for an exactly known specimen; None if that specimen
    topples. `budget` holds the standard uncertainties of alpha_2 by contribution, each drawn alone, largest first;
    `chaotic` is set if their variances do not add up. `chance` is the predicted probability of toppling.
    `rough` has a remark on each laser whose linearity error is not smooth, according to its check.
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
    rough: tuple[str, ...] = ()

    @property
    def agrees(self) -> bool | None:
        """Whether alpha_2 is within its interval; None if there is no interval."""
        return _within(self.alpha_2, self.low, self.high)

    @property
    def alpha_1_agrees(self) -> bool | None:
        """Whether alpha_1 is within its interval; None if there is no interval."""
        return _within(self.alpha_1, self.alpha_1_low, self.alpha_1_high)


def compare(
    bare: Observed,
    coupled: Observed,
    specimen: Specimen,
    configuration: BenchConfiguration,
    n: int,
    seed: int,
    checked: SensorUncertainty | None = None,
) -> Compared:
    """Compare the gains measured in two tests, bare and coupled, with the predicted gains of `n` draws; `checked` are
    the sensors of the `configuration` with what is known of the lasers, if anything.
    """
    sensors = configuration.sensors if checked is None else checked
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
    stood = _standing(everything.alpha_2 * measured_2)
    known = predicted(NONE, n // 2, sensors.table_scale, True, of_bench)
    off = np.abs(_standing(known.alpha_2 * measured_2[: n // 2]) - known.nominal[1])
    low, high = _interval(stood)
    low_1, high_1 = _interval(_standing(everything.alpha_1 * measured_1))
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
        rough=sensors.rough(sensors.shapes([_sighting(each) for each in drifts])),
    )


def _parts(
    predicted: Callable[[SpecimenKnowledge, int, float, bool, SeedSequence], Predicted],
    uncertainty: SpecimenKnowledge,
    n: int,
    table_scale: float,
    seed: SeedSequence,
) -> dict[str, float]:
    """Standard deviation of the predicted alpha_2 due to each contribution alone: motion, table scale, specimen."""
    of_noise, of_scale, *streams = seed.spawn(2 + len(_KEPT))
    runs = {
        "noise of the table's motion": predicted(NONE, n, 0.0, True, of_noise),
        "scale of the table's sensors": predicted(NONE, n, table_scale, False, of_scale),
    }
    for (name, kept), stream in zip(_KEPT.items(), streams, strict=True):
        runs[name] = predicted(uncertainty.only(*kept), n, 0.0, False, stream)
    return {name: float(np.nanstd(run.alpha_2)) if run.chance < 1.0 else 0.0 for name, run in runs.items()}


def _ratio(errors: Array) -> Array:
    """Factor by which the relative errors of bare and coupled peaks, shape (2, n), change their ratio; shape (n,)."""
    return (1.0 + errors[1]) / (1.0 + errors[0])


def _standing(gains: Array) -> Array:
    """Gains of the draws in which the block does not topple."""
    return gains[np.isfinite(gains)]


def _interval(stood: Array) -> tuple[float | None, float | None]:
    """Central 95 % interval of the draws; (None, None) without draws."""
    if not stood.size:
        return None, None
    low, high = np.quantile(stood, INTERVAL)
    return float(low), float(high)


def _within(value: float, low: float | None, high: float | None) -> bool | None:
    return None if low is None or high is None else low <= value <= high


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


Array = NDArray[np.float64]

CHOICE = "choice of the largest peak"
"""Name of the contribution due to other peaks of almost the same size."""


def drift_errors(
    peaks: tuple[PeakSeen, PeakSeen], sensors: SensorUncertainty, n: int, seed: int | SeedSequence
) -> dict[str, Array]:
    """Drawn relative errors of the drift peaks, bare and coupled, by contribution, shape (2, n) each.

    For lasers whose errors were found, checked or calibrated they include the choice of the largest peak among several
    of almost the same size, whose linearity errors differ. Otherwise, the most unfavourable shape covers it.
    """
    random = np.random.default_rng(seed)
    noise = np.array([_noise(peak, random, n) for peak in peaks])
    others = [(test, other) for test, peak in enumerate(peaks) for other in peak.others] if sensors.shapes_known else []
    seen = [*peaks, *(other for _, other in others)]
    drifts = np.array([[each.peak.value] for each in seen])
    errors = sensors.drift_errors([_sighting(each) for each in seen], Draws(random, n))
    parts = {NOISE: noise} | {name: each[:2] / drifts[:2] for name, each in errors.items()}
    if others:
        true = drifts - np.sum(list(errors.values()), axis=0)
        largest = true[:2].copy()
        for (test, _), each in zip(others, true[2:], strict=True):
            largest[test] = np.maximum(largest[test], each)
        parts[CHOICE] = (true[:2] - largest) / drifts[:2]
    return parts


def with_better_zero(
    bare: Observed, coupled: Observed, sensors: SensorUncertainty, n: int, seed: int
) -> tuple[Observed, Observed]:
    """Both tests, their drifts relative to that zero, at rest or from momentum, with which the ratio of the drifts has
    the smaller uncertainty: at rest each laser has a rounding error, in motion the mean linearity error of all places.
    """
    if bare.centred is None or coupled.centred is None:
        return bare, coupled
    moved = replace(bare, drift=bare.centred), replace(coupled, drift=coupled.centred)

    def spread(tests: tuple[Observed, Observed]) -> float:
        errors = drift_errors((tests[0].drift, tests[1].drift), sensors, n, seed)
        return float(_ratio(np.sum(list(errors.values()), axis=0)).std())

    return min((bare, coupled), moved, key=spread)


def u1_errors(
    peaks: tuple[PeakSeen, PeakSeen], sensors: SensorUncertainty, grounded: bool, n: int, seed: int | SeedSequence
) -> Array:
    """Drawn relative errors of the peaks of u1, shape (2, n); with lasers on the ground they include the errors of the
    displacement sensor.
    """
    random = np.random.default_rng(seed)
    seen = [_sighting(peak) for peak in peaks]
    sides = np.array([[each.sign] for each in seen])
    draws = Draws(random, n)
    table = [each.sign * peak.table if grounded else 0.0 for each, peak in zip(seen, peaks, strict=True)]
    errors = sides * sensors.u1_linearity(seen, table, draws)
    if grounded:
        errors += np.outer([peak.table for peak in peaks], sensors.table_scale * random.standard_normal(n))
    for row, each in zip(errors, seen, strict=True):
        row += late(each, 0, sensors.accuracy, draws) + steps(each, 0, sensors.accuracy, draws)
    errors /= np.array([[peak.peak.value] for peak in peaks])
    return errors + np.array([_noise(peak, random, n) for peak in peaks])


def _noise(seen: PeakSeen, random: np.random.Generator, n: int) -> Array:
    peak = seen.peak
    return (peak.uncertainty * random.standard_normal(n) + peak.bias * random.uniform(-1.0, 1.0, n)) / peak.value


def _sighting(seen: PeakSeen) -> PeakReadings:
    """Readings of the lasers at a peak, relative to those at rest."""
    sign = float(seen.peak.sign)
    return PeakReadings(
        drift=seen.peak.value,
        sign=sign,
        lasers=(sign * seen.lasers[0], sign * seen.lasers[1]),
        speeds=seen.speeds,
        zero=np.zeros((2, 1)) if seen.zero is None else seen.zero,
        swings=seen.swings,
        at_rest=seen.zero is None,
    )
