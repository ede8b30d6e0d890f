"""Table model of the replication: stored, or identified at the start of the campaign."""

from dataclasses import dataclass
from datetime import UTC, datetime
from math import ceil, tau
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.control.table_model import ROUNDING, TableModel
from bench.control.target import FLAT, REACH
from protocols.common.identification.parameters import IdentifyParameters
from protocols.common.identification.plan import expected_duration
from protocols.common.identification.signal import Planned, mounted_name, planned
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.records import FileSources, band_used
from sim.errors import InvalidInput

PERIOD, LONGEST = 8.0, 120.0
"""Usual and longest period of the identification [s]; a low band requires a longer period than the usual one."""

OCTAVE_LINES = 4
"""Minimum number of lines in the lowest octave of the identification, which has the fewest lines."""


def stored_table(
    parameters: EarthquakeParameters, configuration: BenchConfiguration, sources: FileSources | None = None
) -> TableModel | None:
    """The configured table model; None if there is none.

    Does not check the age of a model from a data file. Raises InvalidInput if the model cannot be read, is too old, or
    does not match the sample rate or the band.
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
    # a line of the model is a multiple of the resolution, which is rounded
    if model.band[0] > low * (1.0 + ROUNDING) or model.band[1] < high * (1.0 - ROUNDING):
        holds = f"the table model covers {model.band[0]:g} to {model.band[1]:g} Hz"
        allowed = f"{holds}, but a record in this band needs {low:g} to {high:g} Hz: identify the table in a wider band"
        raise InvalidInput("--table-band", f"{band[0]:g}:{band[1]:g}", allowed)
    return model


@dataclass(frozen=True, eq=False)
class TableSource:
    """Source of the table model: a stored `model`, or else an identification with `parameters`, planned as `plan`."""

    model: TableModel | None
    parameters: IdentifyParameters
    plan: Planned | None

    @staticmethod
    def of(
        parameters: EarthquakeParameters, configuration: BenchConfiguration, sources: FileSources | None
    ) -> "TableSource":
        """The source for a campaign. Raises InvalidInput for an unsuitable model, or for a band in which the table
        cannot be identified.
        """
        model = stored_table(parameters, configuration, sources)
        if model is not None:
            return TableSource(model, IdentifyParameters(), None)
        wanted = identification(parameters, configuration)
        return TableSource(None, wanted, planned(wanted, configuration))

    @property
    def duration(self) -> float:
        """Expected duration of the identification [s]; zero for a stored model."""
        return 0.0 if self.plan is None else expected_duration(self.parameters, self.plan)


def table_warnings(
    parameters: EarthquakeParameters, configuration: BenchConfiguration, model: TableModel | None
) -> tuple[str, ...]:
    """Warnings about a model identified with another specimen, and about a frame mode below the compared band."""
    said: list[str] = []
    bare = mounted_name(configuration.known_specimen.bare())
    if model is not None and model.specimen != bare:
        said.append(
            f"table_model was identified with {model.specimen!r} on the table, but the drives are iterated with the "
            f"{bare}: more passes may be needed; `rockbench run identify` without --beta uses the bare frame"
        )
    mode, low = (
        min(configuration.known_specimen.frame.natural_frequencies) / tau,
        band_used(parameters, configuration)[0],
    )
    if mode * FLAT < low:
        said.append(
            f"the frame's first mode at {mode:.3g} Hz is below the band, which starts at {low:g} Hz: the table's "
            "motion at this frequency is not fully compared, and its response spectrum may have larger errors"
        )
    return tuple(said)


def identification(parameters: EarthquakeParameters, configuration: BenchConfiguration) -> IdentifyParameters:
    """Parameters of the identification if there is no stored model. Raises InvalidInput if the band is too low."""
    low, high = band_used(parameters, configuration)
    first = low / REACH
    period = max(PERIOD, float(ceil(OCTAVE_LINES / first)))
    if period > LONGEST:
        lowest = REACH * OCTAVE_LINES / LONGEST
        allowed = f"the table can be identified from {lowest:.3g} Hz upward: raise the lower end"
        raise InvalidInput(
            "--table-band", f"{low:g}:{high:g}", f"{allowed}, or specify a table_model that covers the band"
        )
    return IdentifyParameters(band_low=first, band_high=high * REACH, period=period)
