"""The records of a campaign, each with the motion that the table is to make of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.reference import RecordReference, read_records
from bench.accelerograms.synthetic import NAMES
from bench.config.model import BenchConfiguration
from bench.control.preparation import PreparedMotion, prepare
from bench.control.stroke.fit import periods_of
from bench.control.stroke.reach import Reach
from bench.control.target import Target
from bench.prediction.seismic import band_of
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.earthquake.sources import FileSources
from sim.errors import InvalidInput
from sim.excitation import SampledRecord

FADE = 1.0
"""Time over which a part of a record is faded in and out [s]."""


@dataclass(frozen=True, eq=False)
class Shaking:
    """One record: as its file has it, as it was prepared for the table, and as the table is asked for it.

    `begin` [s] is where the part that was prepared begins in the file.
    """

    accelerogram: Accelerogram
    begin: float
    prepared: PreparedMotion
    target: Target

    @property
    def name(self) -> str:
        """What the record is called."""
        return self.accelerogram.name

    def described(self) -> dict[str, object]:
        """What it is and what was done to it, for a summary."""
        record, prepared = self.accelerogram, self.prepared
        return {
            "name": record.name,
            "source": record.source,
            "format": record.format,
            "sha256": record.sha256,
            "synthetic": record.synthetic,
            "peak_m_s2": record.peak,
            "factor": prepared.factor,
            "table_peak_m_s2": prepared.peak,
            "table_velocity_m_s": prepared.motion.peak_velocity,
            "table_displacement_m": prepared.motion.peak_displacement,
            "part_from_s": self.begin,
            "begin_s": self.begin + prepared.begin,
            "duration_s": self.target.duration,
            "steps": list(prepared.steps),
        }

    def volts(self, drive: NDArray[np.float64], decay: float) -> NDArray[np.float64]:
        """`drive` [V] with `decay` [s] of silence after it."""
        return np.concatenate((drive, np.zeros(round(decay * self.target.sample_rate))))


def band_used(parameters: EarthquakeParameters, configuration: BenchConfiguration) -> tuple[float, float]:
    """The band [Hz] that the records are limited to. Raises InvalidInput for one that this table does not make."""
    low, high = configuration.table_band
    band = band_of(parameters.table_band, configuration)
    if band is None:
        raise InvalidInput("--table-band", parameters.table_band, "a table always has a band: give LOW:HIGH")
    if band[0] < low or band[1] > high:
        raise InvalidInput("--table-band", parameters.table_band, f"the table makes {low:g} to {high:g} Hz")
    return band


def shakings(
    parameters: EarthquakeParameters, configuration: BenchConfiguration, sources: FileSources | None = None
) -> tuple[Shaking, ...]:
    """Every record, read and prepared, in the order asked; `sources` are those of a data file. Raises InvalidInput."""
    named = parameters.records or tuple(f"synthetic:{name}" for name in NAMES)
    records = sources.records if sources else read_records([RecordReference.parse(text) for text in named])
    return tuple(_shaking(record, parameters, configuration) for record in records)


def _shaking(record: Accelerogram, parameters: EarthquakeParameters, configuration: BenchConfiguration) -> Shaking:
    specimen = configuration.known_specimen
    try:
        part, begin = _strongest(record.sampled, parameters.longest)
        prepared = prepare(
            part,
            band=band_used(parameters, configuration),
            peak=parameters.peak_factor * specimen.uplift_acceleration,
            reach=Reach.of(configuration),
            trim=parameters.trim or None,
            length_ratio=parameters.length_ratio,
            periods=periods_of(specimen.frame),
        )
        return Shaking(record, begin, prepared, prepared.target(configuration.sample_rate))
    except InvalidInput as refused:
        raise InvalidInput(f"{refused.item} of {record.name}", refused.value, refused.allowed) from None


def _strongest(record: SampledRecord, longest: float) -> tuple[SampledRecord, float]:
    """The part of `longest` seconds with the greatest Arias intensity, faded in and out, and where it begins [s]."""
    count = round(longest / record.dt) + 1
    if record.acceleration.size <= count:
        return record, 0.0
    intensity = np.concatenate(([0.0], np.cumsum(record.acceleration**2)))
    begin = int((intensity[count:] - intensity[:-count]).argmax())
    ramp = np.minimum(np.arange(count) * record.dt / FADE, 1.0)
    fade = 0.5 * (1.0 - np.cos(np.pi * np.minimum(ramp, ramp[::-1])))
    return SampledRecord(fade * record.acceleration[begin : begin + count], record.dt), begin * record.dt
