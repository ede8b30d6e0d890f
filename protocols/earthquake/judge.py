"""The point that a record makes: measured, overturned, or not played."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.transient_base import ALIKE
from bench.config.model import BenchConfiguration
from bench.control.passes import Pass
from protocols.earthquake.observed import Observed
from protocols.earthquake.overturn import overturning_time
from protocols.earthquake.protocol import EarthquakePoint, PointStatus
from protocols.earthquake.records import Shaking
from protocols.earthquake.shaken import Tracking, difference, tracking
from protocols.earthquake.uncertainty import Compared, compare, predict_draws
from sim.specimen import Specimen

Array = NDArray[np.float64]

CHANCE_NOTE = 0.05
"""Chance of toppling that is worth a word beside a block that stood."""


@dataclass(frozen=True, eq=False)
class BareTest:
    """The bare frame under one record: the `drive` [V] that it was learned with, what it showed, its `signals`."""

    drive: Array
    passes: tuple[Pass, ...]
    replication: str
    observed: Observed
    signals: Array
    tracking: Tracking


def common(shaking: Shaking, beta: float, target_gain: float | None, bare: BareTest | None) -> dict[str, object]:
    """What every point says, however the record ended."""
    return {
        "record": shaking.name,
        "beta": beta,
        "alpha_2_target": target_gain,
        "pga_target_m_s2": shaking.prepared.peak,
        **(
            {}
            if bare is None
            else {
                "bare_drift_peak_m": bare.observed.drift.peak.value,
                "bare_tracking_error": bare.tracking.error,
                "passes": len(bare.passes),
                "replication": bare.replication,
            }
        ),
    }


def measured(
    shaking: Shaking,
    specimen: Specimen,
    bare: BareTest,
    signals: Array,
    observed: Observed,
    target_gain: float | None,
    configuration: BenchConfiguration,
    draws: int,
    seed: int,
) -> EarthquakePoint:
    """A record that the block stood, compared with the model under both achieved motions."""
    found = compare(bare.observed, observed, specimen, configuration, draws, seed)
    moved = tracking(shaking, signals)
    return EarthquakePoint.model_validate(
        {
            **common(shaking, specimen.label or 0.0, target_gain, bare),
            "status": PointStatus.MEASURED,
            "alpha_1": found.alpha_1,
            "alpha_1_uncertainty": found.alpha_1_uncertainty,
            "alpha_1_predicted": found.alpha_1_predicted,
            "alpha_1_low": found.alpha_1_low,
            "alpha_1_high": found.alpha_1_high,
            "alpha_1_agrees": found.alpha_1_agrees,
            "alpha_2": found.alpha_2,
            "alpha_2_uncertainty": found.alpha_2_uncertainty,
            "alpha_2_predicted": found.alpha_2_predicted,
            "alpha_2_low": found.low,
            "alpha_2_high": found.high,
            "alpha_2_bench_uncertainty": found.bench,
            "agrees": found.agrees,
            "dominating": found.budget.dominating,
            "uncertainty_parts": found.budget.as_json,
            "topple_chance": found.chance,
            "drift_peak_m": observed.drift.peak.value,
            "drift_peak_s": observed.drift.peak.time,
            "pga_m_s2": observed.base.peak,
            "tracking_error": moved.error,
            "spectrum_error": moved.spectrum_error,
            "motion_difference": difference(shaking, signals, bare.signals),
            "reason": "; ".join(_remarks(found, observed)),
        }
    )


def overturned(
    shaking: Shaking,
    specimen: Specimen,
    bare: BareTest,
    signals: Array,
    target_gain: float | None,
    configuration: BenchConfiguration,
    draws: int,
    seed: int,
) -> EarthquakePoint:
    """A record that toppled the block; the prediction is for the motion with the bare frame, which was whole."""
    time = overturning_time(signals, shaking.target.sample_rate, specimen)
    base = bare.observed.base
    scale = configuration.sensors.table_scale
    predicted = predict_draws(base, base, specimen, configuration.known, draws, seed, table_scale=scale)
    when = "at a time that the first storey does not show" if time is None else f"{time:.2f} s after the drive began"
    said = f"the block overturned {when}; predicted chance {predicted.chance:.0%}"
    return EarthquakePoint.model_validate(
        {
            **common(shaking, specimen.label or 0.0, target_gain, bare),
            "status": PointStatus.OVERTURNED,
            "topple_chance": predicted.chance,
            "overturned_s": time,
            "overturned_predicted_s": float(np.median(predicted.times)) if predicted.times.size else None,
            "reason": said,
        }
    )


def not_played(
    shaking: Shaking, beta: float, target_gain: float | None, bare: BareTest | None, reason: str
) -> EarthquakePoint:
    """A record without a test or without a result at this stiffness."""
    known = common(shaking, beta, target_gain, bare)
    return EarthquakePoint.model_validate({**known, "status": PointStatus.NOT_PLAYED, "reason": reason})


def _remarks(found: Compared, observed: Observed) -> Iterator[str]:
    """Everything that a reader of the point should know."""
    if found.alpha_2_predicted is None:
        yield "the specimen as known topples under the achieved motion; the interval is that of draws that stood"
    elif found.chance > CHANCE_NOTE:
        yield f"the block stood; {found.chance:.0%} of the draws topple it"
    if found.agrees is False:
        yield "differs from the prediction by more than the uncertainty"
    if found.chaotic:
        yield "the response is chaotic here: the parts of the uncertainty cannot be told apart"
    agreement = observed.base.agreement
    if agreement is not None and abs(agreement - 1.0) > ALIKE:
        yield f"the table's displacement sensor shows {agreement:.3f} times what its accelerometer does: not used"
