"""Records of a campaign: preparation for the table, and storage in the data file together with the table model."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.reference import RecordReference, read_records
from bench.accelerograms.synthetic import NAMES
from bench.config.declared import declared
from bench.config.model import BenchConfiguration
from bench.control.preparation import PreparedMotion, prepare
from bench.control.stroke_fit import periods_of
from bench.control.table_model import TableModel
from bench.control.target import Reach, Target
from bench.datafile.tables import Column, Table
from bench.prediction.seismic import band_of
from protocols.earthquake.protocol import EarthquakeParameters
from sim.errors import InvalidInput
from sim.excitation import SampledRecord

RECORDS, SAMPLES, MODEL, LINES = "records", "record_samples", "table_model", "table_model_lines"
"""Tables of the data file: records, one row each; concatenated samples of all records; table model, one row; lines of
the table model.
"""

OMITTED = "left_out"
"""Table of the data file with a row for each combination that is not played; absent if all are played."""

LeftOut = dict[tuple[str, float | None], str]
"""Reasons why combinations are not played, by record and stiffness ratio (None for the bare frame)."""

_TEXTS = {
    "name": "name of the record",
    "source": "file of the record, or its synthetic source",
    "format": "format of the file",
    "unit": "unit in the file",
    "sha256": "SHA-256 of the file, or of the samples if there is no file",
}


@dataclass(frozen=True, eq=False)
class FileSources:
    """`records` in the given order, the `table` model if the configuration names one, and the `left_out` combinations.

    They are stored in the data file, so that replay, re-analysis and report need no other file.
    """

    records: tuple[Accelerogram, ...]
    table: TableModel | None
    left_out: LeftOut = field(default_factory=LeftOut)

    @property
    def tables(self) -> dict[str, Table]:
        """Tables for the data file, from which the sources are restored exactly."""
        found = {RECORDS: _records(self.records), SAMPLES: _samples(self.records)}
        if self.table is not None:
            found |= _model(self.table)
        return found | {OMITTED: _omitted(self.left_out)} if self.left_out else found

    @staticmethod
    def stored(tables: Mapping[str, Table]) -> "FileSources | None":
        """Sources stored in a data file; None for files of older versions, which do not contain them."""
        if RECORDS not in tables or SAMPLES not in tables:
            return None
        return FileSources(_stored_records(tables), _stored_model(tables), _stored_left_out(tables))


def _records(records: Sequence[Accelerogram]) -> Table:
    def texts(values: Sequence[str], description: str) -> Column:
        return Column(np.array(values, dtype=np.str_), "", description)

    lengths = [record.acceleration.size for record in records]
    return {
        **{
            name: texts([getattr(record, name) for record in records], description)
            for name, description in _TEXTS.items()
        },
        "header": texts(
            [json.dumps(dict(record.header)) for record in records], "description contained in the file (JSON)"
        ),
        "synthetic": Column(
            np.array([record.synthetic for record in records]), "", "whether the record is synthetic, not measured"
        ),
        "dt": Column(np.array([record.dt for record in records]), "s", "sample interval"),
        "samples": Column(np.array(lengths), "1", f"number of consecutive rows in {SAMPLES} that belong to the record"),
    }


def _samples(records: Sequence[Accelerogram]) -> Table:
    values = np.concatenate([record.acceleration for record in records])
    return {"acceleration": Column(values, "m/s2", "ground acceleration as read, neither filtered nor scaled")}


def _omitted(left_out: LeftOut) -> Table:
    betas = [np.nan if beta is None else beta for _, beta in left_out]
    return {
        "record": Column(np.array([record for record, _ in left_out], dtype=np.str_), "", "name of the record"),
        "beta": Column(np.array(betas), "1", "stiffness ratio of the coupling spring; NaN: bare frame"),
        "reason": Column(np.array([*left_out.values()], dtype=np.str_), "", "reason why it is not played"),
    }


def _model(model: TableModel) -> dict[str, Table]:
    single, lines = dict[str, Column](), dict[str, Column]()
    for entry in declared(TableModel):
        value = getattr(model, entry.name)
        if entry.many:
            lines[entry.name] = Column(np.array(value), entry.unit, entry.description)
        elif entry.unit:
            single[entry.name] = Column(np.array([value]), entry.unit, entry.description)
        else:
            text = value if isinstance(value, str) else value.isoformat()
            single[entry.name] = Column(np.array([text], dtype=np.str_), "", entry.description)
    return {MODEL: single, LINES: lines}


def _stored_records(tables: Mapping[str, Table]) -> tuple[Accelerogram, ...]:
    table, samples = tables[RECORDS], tables[SAMPLES]["acceleration"].values
    ends = np.cumsum(table["samples"].values)
    pieces = np.split(np.asarray(samples, dtype=np.float64), ends[:-1])
    return tuple(
        Accelerogram(
            acceleration=piece,
            dt=float(table["dt"].values[k]),
            header=json.loads(str(table["header"].values[k])),
            synthetic=bool(table["synthetic"].values[k]),
            **{name: str(table[name].values[k]) for name in _TEXTS},
        )
        for k, piece in enumerate(pieces)
    )


def _stored_model(tables: Mapping[str, Table]) -> TableModel | None:
    if MODEL not in tables or LINES not in tables:
        return None
    values: dict[str, Any] = {name: column.values[0].item() for name, column in tables[MODEL].items()}
    values |= {name: tuple(column.values.tolist()) for name, column in tables[LINES].items()}
    return TableModel.model_validate(values)


def _stored_left_out(tables: Mapping[str, Table]) -> LeftOut:
    if OMITTED not in tables:
        return LeftOut()
    columns = (tables[OMITTED][name].values.tolist() for name in ("record", "beta", "reason"))
    return {
        (str(record), None if np.isnan(beta) else float(beta)): str(reason)
        for record, beta, reason in zip(*columns, strict=True)
    }


FADE = 1.0
"""Duration of the fade-in and of the fade-out when part of a record is played [s]."""


@dataclass(frozen=True, eq=False)
class Shaking:
    """Record as read from its file, as prepared for the table, and as the target of the replication.

    `begin` [s] is the start of the prepared part in the file.
    """

    accelerogram: Accelerogram
    begin: float
    prepared: PreparedMotion
    target: Target

    @property
    def name(self) -> str:
        return self.accelerogram.name

    def described(self) -> dict[str, object]:
        """Origin and preparation of the record, for the summary."""
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
            "begin_s": self.begin + prepared.begin_in_record,
            "duration_s": self.target.duration,
            "steps": list(prepared.steps),
        }

    def volts(self, drive: NDArray[np.float64], decay: float) -> NDArray[np.float64]:
        """The samples of `drive` [V], followed by `decay` [s] of zeros."""
        return np.concatenate((drive, np.zeros(round(decay * self.target.sample_rate))))


def band_used(parameters: EarthquakeParameters, configuration: BenchConfiguration) -> tuple[float, float]:
    """Band [Hz] to which records are filtered. Raises InvalidInput if there is none or it exceeds the table's band."""
    low, high = configuration.table_band
    band = band_of(parameters.table_band, configuration)
    if band is None:
        raise InvalidInput(
            "--table-band", parameters.table_band, "records must be filtered to a band: specify LOW:HIGH"
        )
    if band[0] < low or band[1] > high:
        raise InvalidInput(
            "--table-band", parameters.table_band, f"it must be within the table's band, {low:g} to {high:g} Hz"
        )
    return band


def shakings(
    parameters: EarthquakeParameters, configuration: BenchConfiguration, sources: FileSources | None = None
) -> tuple[Shaking, ...]:
    """Read and prepare every record, in the given order; `sources` are those stored in a data file, which replace the
    files of the records. Raises InvalidInput for a record that cannot be read or is unsuitable for the bench.
    """
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
    """Part of at most `longest` seconds with the largest Arias intensity, faded in and out, and its start [s]."""
    count = round(longest / record.dt) + 1
    if record.acceleration.size <= count:
        return record, 0.0
    intensity = np.concatenate(([0.0], np.cumsum(record.acceleration**2)))
    begin = int((intensity[count:] - intensity[:-count]).argmax())
    ramp = np.minimum(np.arange(count) * record.dt / FADE, 1.0)
    fade = 0.5 * (1.0 - np.cos(np.pi * np.minimum(ramp, ramp[::-1])))
    return SampledRecord(fade * record.acceleration[begin : begin + count], record.dt), begin * record.dt
