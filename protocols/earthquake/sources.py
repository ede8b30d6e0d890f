"""What a campaign reads of other files, kept in its data file: records as they were read, and the table's model.

A replay, a re-analysis and a report then need the data file alone.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.accelerograms.accelerogram import Accelerogram
from bench.config.declared import declared
from bench.control.table_model import TableModel
from bench.record.tables import Column, Table

RECORDS, SAMPLES, MODEL, LINES = "records", "record_samples", "table_model", "table_model_lines"
"""Tables of the data file: one row per record and its samples one record after another, one row for the model and its
lines.
"""

_TEXTS = {
    "name": "name of the record",
    "source": "file that it was read from, or that it is synthetic",
    "format": "spelling of the file",
    "unit": "what its numbers were in",
    "sha256": "SHA-256 of the file; of the samples where there is none",
}


@dataclass(frozen=True, eq=False)
class FileSources:
    """The `records` in the order asked, and the `table` where the configuration named one."""

    records: tuple[Accelerogram, ...]
    table: TableModel | None

    @property
    def tables(self) -> dict[str, Table]:
        """As they are kept in a data file, to the last bit."""
        found = {RECORDS: _records(self.records), SAMPLES: _samples(self.records)}
        return found if self.table is None else found | _model(self.table)

    @staticmethod
    def stored(tables: Mapping[str, Table]) -> "FileSources | None":
        """Those of a data file; None for a file of before they were kept."""
        if RECORDS not in tables or SAMPLES not in tables:
            return None
        return FileSources(_stored_records(tables), _stored_model(tables))


def _records(records: Sequence[Accelerogram]) -> Table:
    def texts(values: Sequence[str], description: str) -> Column:
        return Column(np.array(values, dtype=np.str_), "", description)

    lengths = [record.acceleration.size for record in records]
    return {
        **{
            name: texts([getattr(record, name) for record in records], description)
            for name, description in _TEXTS.items()
        },
        "header": texts([json.dumps(dict(record.header)) for record in records], "what the file says of itself (JSON)"),
        "synthetic": Column(np.array([record.synthetic for record in records]), "", "made, not measured"),
        "dt": Column(np.array([record.dt for record in records]), "s", "step of its samples"),
        "samples": Column(np.array(lengths), "1", f"how many of the rows of {SAMPLES} are its own, one after another"),
    }


def _samples(records: Sequence[Accelerogram]) -> Table:
    values = np.concatenate([record.acceleration for record in records])
    return {"acceleration": Column(values, "m/s2", "ground acceleration as read, neither filtered nor scaled")}


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
