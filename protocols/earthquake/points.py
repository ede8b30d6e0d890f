"""Points for the outcomes of a record: measured, overturned, or not played."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.transient_base import ALIKE
from bench.config.model import BenchConfiguration
from bench.control.passes import Pass
from protocols.common.replicate import Replicated
from protocols.earthquake.draws import predict_draws
from protocols.earthquake.measurement import Tracking, difference, overturning_time, tracking
from protocols.earthquake.observation import Observed
from protocols.earthquake.protocol import EarthquakeParameters, EarthquakePoint, PointStatus
from protocols.earthquake.records import Shaking
from protocols.earthquake.uncertainty import Compared, compare, with_better_zero
from sim.specimen import Specimen

Array = NDArray[np.float64]

CHANCE_NOTE = 0.05
"""Predicted probability of toppling above which a remark is added if the block has not toppled."""


@dataclass(frozen=True, eq=False)
class BareTest:
    """Test of the bare frame under one record: the iterated `drive` [V], the peaks, and the `signals`, whose readings
    are corrected; `raw` are those before the correction.
    """

    drive: Array
    passes: tuple[Pass, ...]
    replication: str
    observed: Observed
    signals: Array
    tracking: Tracking
    raw: Array


def shared_fields(shaking: Shaking, beta: float, target_gain: float | None, bare: BareTest | None) -> dict[str, object]:
    """Fields that a point has for every outcome."""
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


def measured_point(
    shaking: Shaking,
    specimen: Specimen,
    bare: BareTest,
    signals: Array,
    observed: Observed,
    target_gain: float | None,
    configuration: BenchConfiguration,
    draws: int,
    seed: int,
    sensors: SensorUncertainty,
) -> EarthquakePoint:
    """Point of a record without toppling, compared with the model under both achieved motions."""
    reference, observed = with_better_zero(bare.observed, observed, sensors, draws, seed)
    bare = replace(bare, observed=reference)
    found = compare(reference, observed, specimen, configuration, draws, seed, sensors)
    moved = tracking(shaking, signals)
    return EarthquakePoint.model_validate(
        {
            **shared_fields(shaking, specimen.label or 0.0, target_gain, bare),
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


def overturned_point(
    shaking: Shaking,
    specimen: Specimen,
    bare: BareTest,
    signals: Array,
    target_gain: float | None,
    configuration: BenchConfiguration,
    draws: int,
    seed: int,
) -> EarthquakePoint:
    """Point of a record that toppled the block; the prediction is for the table motion of the bare test."""
    time = overturning_time(signals, shaking.target.sample_rate, specimen)
    base = bare.observed.base
    scale = configuration.sensors.table_scale
    predicted = predict_draws(base, base, specimen, configuration.known, draws, seed, table_scale=scale)
    when = (
        "at a time that cannot be determined from the first storey"
        if time is None
        else f"{time:.2f} s after the drive began"
    )
    said = f"the block overturned {when}; predicted probability {predicted.chance:.0%}"
    return EarthquakePoint.model_validate(
        {
            **shared_fields(shaking, specimen.label or 0.0, target_gain, bare),
            "status": PointStatus.OVERTURNED,
            "topple_chance": predicted.chance,
            "overturned_s": time,
            "overturned_predicted_s": float(np.median(predicted.times)) if predicted.times.size else None,
            "reason": said,
        }
    )


def unplayed_point(
    shaking: Shaking, beta: float, target_gain: float | None, bare: BareTest | None, reason: str
) -> EarthquakePoint:
    """Point of a record that was not played, or has no result, at this stiffness ratio."""
    known = shared_fields(shaking, beta, target_gain, bare)
    return EarthquakePoint.model_validate({**known, "status": PointStatus.NOT_PLAYED, "reason": reason})


def _remarks(found: Compared, observed: Observed) -> Iterator[str]:
    if found.alpha_2_predicted is None:
        yield (
            "the nominal specimen topples under the achieved motion; the interval is computed from the draws that do "
            "not topple"
        )
    elif found.chance > CHANCE_NOTE:
        yield f"the block did not topple, but it topples in {100.0 * found.chance:.0f} % of the draws"
    yield from found.rough
    if found.agrees is False:
        yield "the difference from the prediction exceeds the uncertainty"
    if found.chaotic:
        yield "the response is chaotic here: the contributions to the uncertainty cannot be separated"
    agreement = observed.base.agreement
    if agreement is not None and abs(agreement - 1.0) > ALIKE:
        yield (
            f"the table's displacement sensor measures {agreement:.3f} times the motion measured by its "
            "accelerometer, and is therefore not used"
        )


def rejection(learned: Replicated, parameters: EarthquakeParameters) -> str | None:
    """Reason why the best drive is not used; None if it is used."""
    if learned.acceleration is None:
        return f"no pass was evaluated: {learned.reason}"
    if learned.repeatable <= parameters.usable:
        return None
    return (
        f"the table's motion has an error of {learned.repeatable:.1%} rms (passes: {len(learned.passes)}), more than"
        f" {parameters.usable:.1%} (--usable); {learned.reason}"
    )


def shortfall(learned: Replicated, parameters: EarthquakeParameters, lowest: float) -> str:
    """Tolerances that the drive misses, as text; empty if it meets both.

    `lowest` [Hz] is the lower end of the record's band.
    """
    said: list[str] = []
    if learned.repeatable > parameters.tolerance:
        said.append(
            f"the table's motion has an error of {learned.repeatable:.2%} rms, tolerance {parameters.tolerance:.2%}"
        )
    off, period = learned.spectrum_error
    if off > parameters.spectrum_tolerance:
        below = " (below the record's band)" if period * lowest > 1.0 else ""
        asked = f"tolerance {parameters.spectrum_tolerance:.1%}"
        said.append(f"its response spectrum has an error of {off:.1%} at {period:.3g} s{below}, {asked}")
    if said and learned.status != "converged":
        said.append(learned.reason)
    return "; ".join(said)
