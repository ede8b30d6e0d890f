"""Demands of a seismic campaign: every record with every specimen, within the specimen's uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.control.starts import CATCH_ANGLE
from bench.control.target import integrated
from bench.guard.shaker import largest_repeated_mean
from bench.preflight.demands import (
    UNKNOWN_SHAKER,
    StageDemands,
    TableResponse,
    Travel,
    demand,
    response_of,
    travel_demands,
)
from bench.preflight.margins import Forecast, Stage, bounds, margins
from bench.preflight.motion import peaks, table_demands
from bench.progress import Progress, counting, silent
from protocols.earthquake.laser_check import LaserCheck
from protocols.earthquake.plan import Pace
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import LeftOut, Shaking
from protocols.earthquake.table import TableSource, table_warnings
from sim.excitation import SampledRecord
from sim.loading import load_model
from sim.rocking import simulate
from sim.specimen import Specimen
from sim.sweep import in_threads

Array = NDArray[np.float64]

STEP = 0.005
"""Sample interval of a simulated motion [s]; peaks of a sine of 4 Hz are underestimated by at most 0.2 %."""

TOLERANCE = 1e-7


def travel(specimen: Specimen, shaking: Shaking, factor: float, grounded: bool) -> Travel:
    """Largest motions of the specimen, simulated from rest under `factor` times the record until the record ends or the
    block falls.
    """
    record = shaking.prepared.record
    times = np.arange(0.0, record.duration, STEP)
    motion = simulate(
        specimen,
        SampledRecord(factor * record.acceleration, record.dt),
        sample_times=times,
        peaks_from=None,
        tolerance=TOLERANCE,
        overturning_angle=CATCH_ANGLE,
    )
    moved = np.zeros((1, 6)) if motion.samples is None or not len(motion.samples) else motion.samples
    u1, u2 = moved[:, 0], moved[:, 1]
    table = np.zeros(len(moved))
    if grounded:
        places = np.arange(record.acceleration.size) * record.dt
        table = factor * np.interp(times[: len(moved)], places, shaking.prepared.motion.displacement)
    seen = (float(np.abs(each).max()) for each in (u1 + table, u2 + table, u2 - u1))
    return Travel(*seen, toppled=None if motion.overturned is None else motion.end_time)


def load(
    shaking: Shaking, payload: float, configuration: BenchConfiguration, response: TableResponse | None
) -> dict[str, float]:
    """Peak demands on table and shaker with a `payload` [kg]; unknown demands are absent.

    Raises InvalidInput if the table model does not cover the record's band.
    """
    target = shaking.target
    velocity, displacement = integrated(target.acceleration, target.sample_rate)
    series = table_demands(displacement, velocity, target.acceleration, configuration.shaker_model)
    found = peaks(series)
    if "current" in series:
        forget = float(np.exp(-1.0 / (configuration.limits.heating_time * target.sample_rate)))
        found["heating"] = float(np.sqrt(largest_repeated_mean(series["current"] ** 2, forget)))
    if response is not None:
        volts = _drive(shaking, payload, response)
        slew = float(np.abs(np.diff(volts)).max()) * target.sample_rate
        found |= {"drive_voltage": float(np.abs(volts).max()) + response.friction, "drive_slew": slew}
    return found


def _drive(shaking: Shaking, payload: float, response: TableResponse) -> Array:
    """The drive [V] that makes a linear table follow the record."""
    target = shaking.target
    low, high = target.support
    frequency, spectrum = target.frequency, np.fft.rfft(target.acceleration)
    inside = (frequency > low) & (frequency < high)
    volts = np.zeros_like(spectrum)
    volts[inside] = spectrum[inside] / response.transfer(2.0 * np.pi * frequency[inside], payload)
    return np.fft.irfft(volts, target.acceleration.size)


DRAWS, SEED = 32, 8
"""Number of specimens drawn in addition to the nominal one, and random seed."""

OFF = 0.03
"""Assumed largest relative error of the table's motion; also the relative allowance for noise and friction in the
demands on table and shaker.
"""

IMPACTS = 0.15
"""Relative allowance for the impacts of a rocking block, which increase some demands and which the drive does not
compensate.
"""

OFF_MIDDLE = 0.015
"""Assumed largest offset of a storey at rest from the middle of the laser's range, relative to half the range."""

_RAISED = ("acceleration", "force", "current")

_UNKNOWN = {
    "drive_voltage": "the table is unknown: the run identifies it at its start",
    "drive_slew": "the table is unknown: the run identifies it at its start",
    **UNKNOWN_SHAKER,
}


@dataclass(frozen=True)
class Combination:
    """A record with the bare frame (`beta` None) or with a spring, and its demands."""

    record: str
    beta: float | None
    demands: StageDemands


def combinations(
    parameters: EarthquakeParameters,
    configuration: BenchConfiguration,
    shakings: Sequence[Shaking],
    progress: Progress = silent,
) -> list[Combination]:
    """Simulated demands of every record with the bare frame and with every spring, and probability that the block does
    not topple.
    """
    load_model(progress)
    specimens = [configuration.known_specimen.bare(), *map(configuration.known_specimen.coupled, parameters.beta)]
    found, done = list[Combination](), counting(progress, f"simulating every record with {1 + DRAWS} specimens")
    for shaking in shakings:
        for specimen in specimens:
            found.append(Combination(shaking.name, specimen.label, _shaking_demands(shaking, specimen, configuration)))
            done(len(found), len(shakings) * len(specimens))
    return found


def beyond_limits(found: Sequence[Combination], configuration: BenchConfiguration) -> LeftOut:
    """Combinations that exceed a limit even with the nominal specimen, with the reason. A record that exceeds one with
    the bare frame is omitted with all springs, and one that exceeds a limit with every spring is omitted with the bare
    frame. Empty if no combination would remain: the preflight then refuses the campaign.
    """
    bound = bounds(configuration)
    left = LeftOut()
    for each in found:
        exceeded = (
            margin
            for margin in margins((demand(quantity, [each.demands], _UNKNOWN) for quantity in bound), bound)
            if margin.margin is not None and margin.margin < 0.0
        )
        if reason := "; ".join(margin.excess for margin in exceeded):
            left[each.record, each.beta] = reason
    for each in found:
        bare = left.get((each.record, None))
        if bare is not None and each.beta is not None:
            left.setdefault((each.record, each.beta), f"with the bare frame: {bare}")
    for record in dict.fromkeys(each.record for each in found):
        springs = [each.beta for each in found if each.record == record and each.beta is not None]
        if all((record, beta) in left for beta in springs):
            left.setdefault((record, None), "no spring remains")
    return LeftOut() if len(left) == len(found) else left


def forecast(
    parameters: EarthquakeParameters,
    configuration: BenchConfiguration,
    shakings: Sequence[Shaking],
    table: TableSource,
    found: Sequence[Combination],
    left_out: LeftOut,
    check: LaserCheck | None = None,
) -> Forecast:
    """Demands of the identification, of the check of the lasers and of the played combinations, with a warning for each
    omitted one.
    """
    played = [each.demands for each in found if (each.record, each.beta) not in left_out]
    asked = [*_identification(table), *played]
    if check is not None:
        asked.append(_shaking_demands(check.shaking, configuration.known_specimen.bare(), configuration))
    omitted = tuple(
        f"{each.demands.name} is omitted: {left_out[each.record, each.beta]}"
        for each in found
        if (each.record, each.beta) in left_out
    )
    return Forecast(
        demands=tuple(demand(quantity, asked, _UNKNOWN) for quantity in bounds(configuration)),
        stages=tuple(Stage(each.name, (), each.chance) for each in asked),
        duration=Pace(parameters, shakings, table.duration, left_out, check).total,
        warnings=(*omitted, *table_warnings(parameters, configuration, table.model)),
        notes=tuple(
            f"{shaking.name}: {'; '.join(shaking.prepared.steps)}"
            for shaking in (*([] if check is None else [check.shaking]), *shakings)
        ),
    )


def _identification(table: TableSource) -> list[StageDemands]:
    """Demands of the identification at the start of the campaign; none with a stored model."""
    if table.plan is None:
        return []
    # the specimen's uncertainty is neglected, since the response is linear and the level includes a margin
    values = {quantity: np.full(1 + DRAWS, value) for quantity, value in table.plan.demands.items()}
    return [StageDemands("the identification of the table", values, None)]


def _shaking_demands(shaking: Shaking, specimen: Specimen, configuration: BenchConfiguration) -> StageDemands:
    loads = load(shaking, specimen.mass, configuration, response_of(configuration))
    raised = _RAISED if specimen.beta is not None else ()
    factors = np.concatenate(([1.0], 1.0 + OFF * np.random.default_rng(SEED).uniform(-1.0, 1.0, DRAWS)))
    values = {
        quantity: factors * value * (1.0 + (IMPACTS if quantity in raised else OFF))
        for quantity, value in loads.items()
    }
    travels = _travels(shaking, specimen, factors, configuration)
    values |= travel_demands(travels, configuration.laser_half_ranges, OFF_MIDDLE)
    mounted = "the bare frame" if specimen.beta is None else f"beta = {specimen.label:g}"
    stood = sum(each.toppled is None for each in travels[1:])
    chance = None if specimen.beta is None else (stood + 1) / (DRAWS + 2)
    return StageDemands(f"{shaking.name} with {mounted}", values, chance)


def _travels(
    shaking: Shaking, specimen: Specimen, factors: Array, configuration: BenchConfiguration
) -> Sequence[Travel]:
    """Motions of the nominal and of the drawn specimens, computed on all processors."""
    drawn = [specimen, *configuration.known.draws(specimen, DRAWS, np.random.default_rng(SEED))]
    grounded = configuration.laser_reference == "ground"

    def one(k: int) -> Travel:
        return travel(drawn[k], shaking, float(factors[k]), grounded)

    return in_threads(one, range(len(drawn)))
