"""Demands of a harmonic campaign: predicted for every stage, over the uncertainty of the specimen."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.control.legs import program
from bench.control.starts import CATCH_ANGLE, DRIVE, SEED, Start
from bench.preflight.asked import UNKNOWN_SHAKER, Asked, demand
from bench.preflight.bounds import bounds
from bench.preflight.forecast import Forecast
from bench.preflight.load import load
from bench.preflight.motion import Travel, travel
from bench.preflight.response import TableResponse, response_of
from bench.progress import Progress, counting, silent
from protocols.harmonic.protocol import HarmonicParameters
from protocols.harmonic.reach import Reach
from protocols.harmonic.sheet import Pace
from protocols.harmonic.stages import Trial, payload_of, trials
from sim.specimen import Specimen
from sim.sweep import Done, in_threads

Array = NDArray[np.float64]

DRAWS = 16
"""Specimens that are drawn besides the assumed one: their 95 % lies close below the worst of them."""

RIPPLE = 0.03
"""Share by which every quantity of the table and its drive may exceed the asked one: noise, and what a calibration at
half the level leaves open of the friction."""

IMPACTS = 0.15
"""The same where the block rocks, for what its impacts raise until the table's harmonics are cancelled."""

OFF_MIDDLE = 0.015
"""Share of half its range by which a storey may rest off the laser's middle."""

_RAISED = ("acceleration", "force", "current", "drive_slew")
"""Quantities that impacts raise: what is fast."""

_UNKNOWN = {
    "drive_voltage": "nothing is known of this table: give table_model",
    "drive_slew": "nothing is known of this table: give table_model",
    **UNKNOWN_SHAKER,
}


def forecast(
    parameters: HarmonicParameters,
    configuration: BenchConfiguration,
    starts: Mapping[tuple[float, float], Sequence[Start]],
    reach: Reach,
    progress: Progress = silent,
) -> Forecast:
    """The campaign's stages with the demands of them all.

    A drawn specimen is the same one throughout the campaign, and so is how far its drive is off.
    Raises InvalidInput when a table model is named that cannot be read or does not reach far enough.
    """
    response = response_of(configuration)
    found = list(trials(parameters, configuration, response, starts))
    factors = np.concatenate(([1.0], 1.0 + DRIVE * np.random.default_rng(SEED).uniform(-1.0, 1.0, DRAWS)))
    simulating = counting(progress, f"simulating every stage with {1 + DRAWS} specimens")
    moved = _travels(found, factors, configuration, simulating)
    asked = [
        _asked(trial, travels, factors, reach, configuration, response)
        for trial, travels in zip(found, moved, strict=True)
    ]
    return Forecast(
        demands=tuple(demand(quantity, asked, _UNKNOWN) for quantity in bounds(configuration)),
        stages=tuple(trial.stage for trial in found),
        duration=Pace(parameters.omega, 1 + len(parameters.beta)).progress("").remaining,
    )


def _travels(
    found: Sequence[Trial], factors: Array, configuration: BenchConfiguration, done: Done
) -> list[list[Travel]]:
    """Motion of the specimen in each trial, as assumed and as drawn, on all processors."""
    drawn: dict[Specimen, list[Specimen]] = {}
    for trial in found:
        if trial.specimen not in drawn:
            others = configuration.known.draws(trial.specimen, DRAWS, np.random.default_rng(SEED))
            drawn[trial.specimen] = [trial.specimen, *others]

    def one(run: tuple[Trial, int]) -> Travel:
        trial, i = run
        legs = [type(leg)(leg.duration, float(factors[i]) * leg.amplitude, leg.omega) for leg in trial.legs]
        specimen = drawn[trial.specimen][i]
        return travel(specimen, program(legs), trial.begin, configuration.laser_reference, CATCH_ANGLE)

    n = len(factors)
    every = in_threads(one, [(trial, i) for trial in found for i in range(n)], done)
    return [every[k * n : (k + 1) * n] for k in range(len(found))]


def _asked(
    trial: Trial,
    travels: Sequence[Travel],
    factors: Array,
    reach: Reach,
    configuration: BenchConfiguration,
    response: TableResponse | None,
) -> Asked:
    loads = load(
        program(trial.legs),
        trial.begin,
        trial.longest,
        payload=payload_of(trial.specimen),
        mover=configuration.mover,
        response=response,
        heating_time=configuration.limits.heating_time,
    )
    raised = _RAISED if trial.beta is not None else ()
    values = {
        quantity: factors * value * (1.0 + (IMPACTS if quantity in raised else RIPPLE))
        for quantity, value in loads.items()
    }
    # a simulation of limited length may not have reached the steady state
    steady = None if trial.steady is None else reach.steady(trial.beta, trial.steady)
    steady = steady or Travel(0.0, 0.0, 0.0)
    halves = [0.5 * whole for whole in configuration.laser_ranges]
    values |= {
        "laser_1": np.array([max(each.storey_1, steady.storey_1) for each in travels]) / halves[0] + OFF_MIDDLE,
        "laser_2": np.array([max(each.storey_2, steady.storey_2) for each in travels]) / halves[1] + OFF_MIDDLE,
        "drift": np.array([max(each.drift, steady.drift) for each in travels]),
    }
    return Asked(trial.stage.name, values)
