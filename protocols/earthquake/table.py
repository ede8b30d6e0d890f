"""The table's response that the drives are learned with: the stored one, or one identified at the campaign's begin."""

from collections.abc import Generator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from math import ceil, tau
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.control.table_model import TableModel
from bench.control.target import FLAT, REACH
from bench.engine.steps import Done, Handle, Outcome, Play, Say, Step, Watch
from bench.events import Event, Progress
from drivers.rig import Handwork
from protocols.common.identification.level import Planned, mounted_name, planned
from protocols.common.identification.parameters import IdentifyParameters
from protocols.common.identification.plan import expected_duration, identified
from protocols.earthquake.pace import Pace
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import band_used
from protocols.earthquake.sources import FileSources
from sim.errors import InvalidInput

PERIOD, LONGEST = 8.0, 120.0
"""Period of the identification unless its lowest octave needs a longer one, and the longest that is tried [s]."""

OCTAVE_LINES = 4
"""Lines in the lowest octave of the identification, where an octave holds the fewest."""


def stored_table(
    parameters: EarthquakeParameters, configuration: BenchConfiguration, sources: FileSources | None = None
) -> TableModel | None:
    """The configured table model; None when none is named. That of a data file was fresh when its run began.

    Raises InvalidInput when it cannot be read, is too old, or does not suit the sample rate or the band.
    """
    if configuration.table_model is None:
        return None
    if sources is not None and sources.table is not None:
        model = sources.table
    else:
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


@dataclass(frozen=True, eq=False)
class TableSource:
    """Where the table's response is from: a stored `model`, else an identification as `wanted`, planned as `found`."""

    model: TableModel | None
    wanted: IdentifyParameters
    found: Planned | None

    @staticmethod
    def of(
        parameters: EarthquakeParameters, configuration: BenchConfiguration, sources: FileSources | None
    ) -> "TableSource":
        """That of a campaign. Raises InvalidInput for a model that cannot be used, or a table that cannot be
        identified.
        """
        model = stored_table(parameters, configuration, sources)
        if model is not None:
            return TableSource(model, IdentifyParameters(), None)
        wanted = identification(parameters, configuration)
        return TableSource(None, wanted, planned(wanted, configuration))

    @property
    def duration(self) -> float:
        """Expected length of the identification [s]; zero with a stored model."""
        return 0.0 if self.found is None else expected_duration(self.wanted, self.found)


def table_warnings(
    parameters: EarthquakeParameters, configuration: BenchConfiguration, model: TableModel | None
) -> tuple[str, ...]:
    """What the operator should know: a stored model of something else than what the drives are learned with, a mode of
    the frame at which nothing tells how well the table follows.
    """
    said: list[str] = []
    bare = mounted_name(configuration.known_specimen.bare())
    if model is not None and model.specimen != bare:
        said.append(
            f"table_model was identified with {model.specimen!r} on the table, the drives are learned with the {bare}:"
            " more passes may be needed; `rockbench run identify` without --beta identifies the table for it"
        )
    mode, low = (
        min(configuration.known_specimen.frame.natural_frequencies) / tau,
        band_used(parameters, configuration)[0],
    )
    if mode * FLAT < low:
        said.append(
            f"the frame's first mode at {mode:.3g} Hz lies below the band from {low:g} Hz on: what the table does there"
            " is not compared in full, and its response spectrum may be missed"
        )
    return tuple(said)


def identification(parameters: EarthquakeParameters, configuration: BenchConfiguration) -> IdentifyParameters:
    """How the table is identified for these records where no model is named.

    Raises InvalidInput for a band that reaches too low for it.
    """
    low, high = band_used(parameters, configuration)
    first = low / REACH
    period = max(PERIOD, float(ceil(OCTAVE_LINES / first)))
    if period > LONGEST:
        lowest = REACH * OCTAVE_LINES / LONGEST
        allowed = (
            f"the identification of the table reaches down to records from {lowest:.3g} Hz on: raise the lower end"
        )
        raise InvalidInput("--table-band", f"{low:g}:{high:g}", f"{allowed}, or name a table_model that covers it")
    return IdentifyParameters(band_low=first, band_high=high * REACH, period=period)


def table_for(
    source: TableSource, configuration: BenchConfiguration, pace: Pace
) -> Generator[Step, Outcome, TableModel]:
    """The stored table, or it is identified now; afterwards the bare frame stands on it."""
    if source.model is not None or source.found is None:
        assert source.model is not None
        bare = configuration.known_specimen.bare()
        yield Handle(Handwork.REMOVE_BLOCK, bare, "Take the spring and the block off the table.")
        return source.model
    plan = identified(source.wanted, configuration, source.found)
    try:
        step = next(plan)
        while True:
            # its progress is a part of the campaign's
            if isinstance(step, Say) and isinstance(step.event, Progress):
                outcome = Done()
            else:
                outcome = yield replace(step, watch=_counted(step.watch, pace)) if isinstance(step, Play) else step
            step = plan.send(outcome)
    except StopIteration as end:
        pace.identified()
        return end.value


def _counted(watch: Watch | None, pace: Pace) -> Watch | None:
    """The watch of an identification, with its progress as a part of the campaign's."""
    if watch is None:
        return None

    def look(signals: NDArray[np.float64]) -> Event | None:
        event = watch(signals)
        if not isinstance(event, Progress):
            return event
        pace.identified(event.fraction)
        return pace.progress("the table is identified")

    return look
