"""Demands of a seismic campaign: every record with every specimen, over the uncertainty of the specimen."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.preflight.asked import UNKNOWN_SHAKER, Asked, demand
from bench.preflight.bounds import bounds
from bench.preflight.forecast import Forecast, Stage
from bench.preflight.response import response_of
from bench.progress import Progress, counting, silent
from protocols.earthquake.asked import Travel, load, travel
from protocols.earthquake.pace import Pace
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import Shaking
from protocols.earthquake.table import TableSource, table_warnings
from sim.loading import load_model
from sim.specimen import Specimen
from sim.sweep import in_threads

Array = NDArray[np.float64]

DRAWS, SEED = 32, 8
"""Specimens that are drawn besides the assumed one, and their seed."""

OFF = 0.03
"""Share by which the table's motion may be off, and every quantity of it above what was asked: noise, friction."""

IMPACTS = 0.15
"""The same for what is fast where a block rocks, for what its impacts raise: no drive cancels them."""

OFF_MIDDLE = 0.015
"""Share of half its range by which a storey may rest off the laser's middle."""

_RAISED = ("acceleration", "force", "current")

_UNKNOWN = {
    "drive_voltage": "nothing is known of this table yet: it is identified first",
    "drive_slew": "nothing is known of this table yet: it is identified first",
    **UNKNOWN_SHAKER,
}


def forecast(
    parameters: EarthquakeParameters,
    configuration: BenchConfiguration,
    shakings: Sequence[Shaking],
    table: TableSource,
    progress: Progress = silent,
) -> Forecast:
    """The demands of the identification and of every record with the bare frame and with every spring, and the chance
    that the block stands.
    """
    load_model(progress)
    first = _identification(table)
    specimens = [configuration.known_specimen.bare(), *map(configuration.known_specimen.coupled, parameters.beta)]
    asked, done = [*first], counting(progress, f"simulating every record with {1 + DRAWS} specimens")
    for shaking in shakings:
        for specimen in specimens:
            asked.append(_asked(shaking, specimen, configuration))
            done(len(asked) - len(first), len(shakings) * len(specimens))
    return Forecast(
        demands=tuple(demand(quantity, asked, _UNKNOWN) for quantity in bounds(configuration)),
        stages=tuple(Stage(each.name, (), each.chance) for each in asked),
        duration=Pace(parameters, shakings, table.duration).total,
        warnings=table_warnings(parameters, configuration, table.model),
        notes=tuple(f"{shaking.name}: {'; '.join(shaking.prepared.steps)}" for shaking in shakings),
    )


def _identification(table: TableSource) -> list[Asked]:
    """The demands of the identification at the campaign's begin: none with a stored model."""
    if table.found is None:
        return []
    # linear and at a level that keeps its distance: no specimen within its uncertainty changes much of it
    values = {quantity: np.full(1 + DRAWS, value) for quantity, value in table.found.asked.items()}
    return [Asked("the identification of the table", values, None)]


def _asked(shaking: Shaking, specimen: Specimen, configuration: BenchConfiguration) -> Asked:
    block = specimen.block.mass if specimen.beta is not None else 0.0
    payload = specimen.frame.m1 + specimen.frame.m2 + block
    loads = load(shaking, payload, configuration, response_of(configuration))
    raised = _RAISED if specimen.beta is not None else ()
    factors = np.concatenate(([1.0], 1.0 + OFF * np.random.default_rng(SEED).uniform(-1.0, 1.0, DRAWS)))
    values = {
        quantity: factors * value * (1.0 + (IMPACTS if quantity in raised else OFF))
        for quantity, value in loads.items()
    }
    travels = _travels(shaking, specimen, factors, configuration)
    halves = [0.5 * whole for whole in configuration.laser_ranges]
    values |= {
        "laser_1": np.array([each.storey_1 for each in travels]) / halves[0] + OFF_MIDDLE,
        "laser_2": np.array([each.storey_2 for each in travels]) / halves[1] + OFF_MIDDLE,
        "drift": np.array([each.drift for each in travels]),
    }
    mounted = "the bare frame" if specimen.beta is None else f"beta = {specimen.label:g}"
    stood = sum(each.toppled is None for each in travels[1:])
    chance = None if specimen.beta is None else (stood + 1) / (DRAWS + 2)
    return Asked(f"{shaking.name} with {mounted}", values, chance)


def _travels(
    shaking: Shaking, specimen: Specimen, factors: Array, configuration: BenchConfiguration
) -> Sequence[Travel]:
    """Motion of the specimen as assumed and as drawn, on all processors."""
    drawn = [specimen, *configuration.known.draws(specimen, DRAWS, np.random.default_rng(SEED))]
    grounded = configuration.laser_reference == "ground"

    def one(k: int) -> Travel:
        return travel(drawn[k], shaking, float(factors[k]), grounded)

    return in_threads(one, range(len(drawn)))
