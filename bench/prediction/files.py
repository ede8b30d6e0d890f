"""Predictions as files and as plain data: CSV, HDF5, JSON."""

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from bench.provenance import software
from bench.record.tables import Table
from bench.report.files import write_new
from sim.knowledge import SpecimenKnowledge
from sim.parameters import Parameters
from sim.specimen import Specimen

FORMAT, FORMAT_VERSION = "rocking-bench prediction", 1


def provenance(request: Parameters, specimen: Specimen, known: SpecimenKnowledge | None = None) -> dict[str, Any]:
    """What a prediction was computed from and with; `known` where it says how far it may be off."""
    found = {"request": request.model_dump(mode="json"), "specimen": specimen.model_dump(mode="json")}
    if known is not None:
        found["known"] = known.model_dump(mode="json")
    return {**found, "software": software()}


def rows_of(table: Table) -> list[dict[str, Any]]:
    """One dictionary per row: numbers, truth values, texts; None where a value is absent (NaN)."""
    columns = [plain(column.values) for column in table.values()]
    return [dict(zip(table, row, strict=True)) for row in zip(*columns, strict=True)]


def plain(values: NDArray[Any]) -> list[Any]:
    """The values of an array, shape (n,), as Python's own; None where one is absent (NaN)."""
    # NaN is the one value that differs from itself
    return [None if value != value else value for value in values.tolist()]


def write_csv(path: Path, table: Table) -> None:
    """Write a table: one header line, names ending with the unit; full precision; empty where a value is absent.

    Raises InvalidInput when `path` exists, RockbenchError when the disk fails.
    """
    cells = [[_text(value) for value in plain(column.values)] for column in table.values()]

    def write(unfinished: Path) -> None:
        with unfinished.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(table)
            writer.writerows(zip(*cells, strict=True))

    write_new(path, write)


def write_hdf5(path: Path, title: str, tables: Mapping[str, Table], metadata: Mapping[str, Any]) -> None:
    """Write tables, with the units and the meaning of their columns, and what they were computed from.

    Raises InvalidInput when `path` exists, RockbenchError when the disk fails.
    """
    from bench.record import hdf5
    from bench.record import tables as stored
    from bench.record.layout import now

    for name, table in tables.items():
        stored.check(name, table)

    def write(unfinished: Path) -> None:
        file = hdf5.create(unfinished)
        try:
            file.attrs["NX_class"], file.attrs["default"] = "NXroot", "entry"
            file.attrs["format"], file.attrs["format_version"] = FORMAT, FORMAT_VERSION
            entry = hdf5.create_group(file, "entry", "NXentry")
            hdf5.write_text(entry, "title", title)
            hdf5.write_text(entry, "start_time", now(), description="wall clock at the creation of this file, ISO 8601")
            hdf5.write_text(entry, "program_name", "rocking-bench").attrs["version"] = software()["rocking-bench"]
            group = hdf5.create_group(entry, "metadata", "NXcollection")
            for name, value in metadata.items():
                hdf5.write_text(group, name, json.dumps(value, ensure_ascii=False, allow_nan=False))
            for name, table in tables.items():
                stored.write(entry, name, table)
        finally:
            file.close()

    write_new(path, write)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)
