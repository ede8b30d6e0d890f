"""Output of predictions as CSV, HDF5 or JSON."""

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from bench.datafile.tables import Table
from bench.inert import csv_cell
from bench.provenance import software
from bench.unfinished import write_new
from sim.knowledge import SpecimenKnowledge
from sim.parameters import Parameters
from sim.specimen import Specimen

BLOCK = 10_000
"""Number of rows of a CSV file written at once."""

FORMAT, FORMAT_VERSION = "rocking-bench prediction", 1


def provenance(request: Parameters, specimen: Specimen, known: SpecimenKnowledge | None = None) -> dict[str, Any]:
    """Inputs and software versions of a prediction, and the uncertainties of the specimen if `known` is given."""
    found = {"request": request.model_dump(mode="json"), "specimen": specimen.model_dump(mode="json")}
    if known is not None:
        found["known"] = known.model_dump(mode="json")
    return {**found, "software": software()}


def rows_of(table: Table) -> list[dict[str, Any]]:
    """One dictionary per row: numbers, Booleans and strings, and None where a value is absent (NaN)."""
    columns = [plain(column.values) for column in table.values()]
    return [dict(zip(table, row, strict=True)) for row in zip(*columns, strict=True)]


def plain(values: NDArray[Any]) -> list[Any]:
    """Values of an array, shape (n,), as Python objects; None where a value is absent (NaN)."""
    # NaN is the only value that is not equal to itself
    return [None if value != value else value for value in values.tolist()]


def write_csv(path: Path, table: Table) -> None:
    """Write a table as CSV: a line of column names, numbers in full precision, and empty cells for absent values.

    Raises InvalidInput if `path` exists, and RockbenchError if the file cannot be written.
    """
    rows = max((len(column.values) for column in table.values()), default=0)

    def write(unfinished: Path) -> None:
        with unfinished.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(table)
            # in blocks, because text cells need far more memory than numbers
            for first in range(0, rows, BLOCK):
                block = (plain(column.values[first : first + BLOCK]) for column in table.values())
                writer.writerows(zip(*([csv_cell(_text(value)) for value in each] for each in block), strict=True))

    write_new(path, write)


def write_hdf5(path: Path, title: str, tables: Mapping[str, Table], metadata: Mapping[str, Any]) -> None:
    """Write tables, with units and descriptions of their columns, and `metadata` to an HDF5 file.

    Raises InvalidInput if `path` exists, and RockbenchError if the file cannot be written.
    """
    from bench.datafile import hdf5
    from bench.datafile import tables as stored
    from bench.datafile.layout import now

    for name, table in tables.items():
        stored.check(name, table)

    def write(unfinished: Path) -> None:
        file = hdf5.create(unfinished)
        try:
            file.attrs["NX_class"], file.attrs["default"] = "NXroot", "entry"
            file.attrs["format"], file.attrs["format_version"] = FORMAT, FORMAT_VERSION
            entry = hdf5.create_group(file, "entry", "NXentry")
            hdf5.write_text(entry, "title", title)
            hdf5.write_text(
                entry, "start_time", now(), description="creation time of this file by the wall clock, ISO 8601"
            )
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
