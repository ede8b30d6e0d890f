"""Parquet: one file per run and per table, with the names used in the data file and units in the metadata of each
field.
"""

import json
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from bench.app.export.format import Content, ExportFormat, Signal, TableColumn


def write(content: Content, folder: Path) -> None:
    """Write run-<number>.parquet in pieces, and <table>.parquet. Absent values of tables are null."""
    # `Any` because pyarrow is an optional dependency without type information
    arrow: Any = import_module("pyarrow")
    parquet: Any = import_module("pyarrow.parquet")
    about = {name: str(value) for name, value in content.info.items()}
    fields = [arrow.field("time", arrow.float64(), metadata=_about("s", "seconds since the rig was armed"))]
    fields += [_field(arrow, signal) for signal in content.signals]
    for run in content.runs:
        schema = arrow.schema(fields, metadata=about | {"run": str(run.number)})
        with parquet.ParquetWriter(str(folder / f"run-{run.number}.parquet"), schema) as writer:
            for piece in content.pieces(run):
                writer.write_table(arrow.table([arrow.array(each) for each in piece], schema=schema))
    for name, columns in content.tables.items():
        parquet.write_table(_table(arrow, columns, about), str(folder / f"{name}.parquet"))


def _about(unit: str, description: str, **more: object) -> dict[str, str]:
    return {"unit": unit, "description": description} | {name: json.dumps(value) for name, value in more.items()}


def _field(arrow: Any, signal: Signal) -> Any:
    conversion: Mapping[str, Any] = signal.conversion or {}
    metadata = _about(signal.unit, signal.quantity, device=signal.device, **conversion)
    return arrow.field(signal.name, arrow.from_numpy_dtype(signal.dtype), metadata=metadata)


def _table(arrow: Any, columns: Sequence[TableColumn], about: Mapping[str, str]) -> Any:
    kinds = {"number": arrow.float64(), "whole": arrow.int64(), "switch": arrow.bool_(), "text": arrow.string()}
    fields = [
        arrow.field(each.name, kinds[each.kind], metadata=_about(each.unit, each.description)) for each in columns
    ]
    arrays = [arrow.array(each.values, type=kinds[each.kind]) for each in columns]
    return arrow.table(arrays, schema=arrow.schema(fields, metadata=dict(about)))


FORMAT = ExportFormat("Parquet", write, library="pyarrow")
