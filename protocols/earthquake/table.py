"""The table's response that the drives are learned with: the stored one, or one identified at the campaign's begin."""

from collections.abc import Generator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.control.table_model import TableModel
from bench.control.target import REACH
from bench.engine.steps import Done, Handle, Outcome, Play, Say, Step
from bench.events import PointFinished
from drivers.rig import Handwork
from protocols.earthquake.parameters import EarthquakeParameters
from protocols.earthquake.records import band_used
from protocols.identify.parameters import IdentifyParameters
from protocols.identify.sheet import identify_plan
from sim.errors import InvalidInput, RockbenchError


def stored_table(parameters: EarthquakeParameters, configuration: BenchConfiguration) -> TableModel | None:
    """The configured table model; None when none is named.

    Raises InvalidInput when it cannot be read, is too old, or does not suit the sample rate or the band.
    """
    if configuration.table_model is None:
        return None
    model = TableModel.read(Path(configuration.table_model))
    model.require_fresh(datetime.now(UTC))
    model.require_rate(configuration.sample_rate)
    band = band_used(parameters, configuration)
    low, high = band[0] / REACH, band[1] * REACH
    if model.band[0] > low or model.band[1] < high:
        holds = f"the table model holds from {model.band[0]:g} to {model.band[1]:g} Hz"
        allowed = f"{holds}, a record in this band needs {low:g} to {high:g} Hz: identify the table in a wider band"
        raise InvalidInput("--table-band", f"{band[0]:g}:{band[1]:g}", allowed)
    return model


def table_for(
    parameters: EarthquakeParameters, configuration: BenchConfiguration
) -> Generator[Step, Outcome, TableModel]:
    """The stored table, or it is identified now; afterwards the bare frame stands on it."""
    model = stored_table(parameters, configuration)
    if model is not None:
        bare = configuration.specimen.bare()
        yield Handle(Handwork.REMOVE_BLOCK, bare, "Take the spring and the block off the table.")
        return model
    found: list[TableModel] = []
    low, high = band_used(parameters, configuration)
    wanted = IdentifyParameters(band_low=low / REACH, band_high=high * REACH)
    plan = identify_plan(wanted, configuration, found.append)
    step = next(plan)
    while True:
        # its thirds of an octave are no points of this campaign, nor is its progress that of the campaign
        if isinstance(step, Say) and isinstance(step.event, PointFinished):
            outcome = Done()
        else:
            outcome = yield replace(step, watch=None) if isinstance(step, Play) else step
        try:
            step = plan.send(outcome)
        except StopIteration:
            break
    if not found:
        raise RockbenchError("the identification of the table ended without a result")
    return found[0]
