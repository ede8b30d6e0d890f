"""Comma-separated values: one file per run and per result table, with units in the headings."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.app.export.format import Content, ExportFormat, Signal, TableColumn
from bench.inert import csv_cell

DIGITS = 12
"""Significant digits of a value, enough to recover the counts of a 24-bit converter."""

CHANNELS = "channels.csv"


def headed(name: str, unit: str) -> str:
    """A name followed by its unit, if any, in brackets."""
    return csv_cell(f"{name} [{unit}]" if unit not in ("", "1") else name)


def write(content: Content, folder: Path) -> None:
    """Write every run and table as comma-separated text with decimal points; missing samples are `nan`."""
    write_channels(content.signals, folder / CHANNELS)
    headings = [headed("time", "s"), *(headed(signal.name, signal.unit) for signal in content.signals)]
    formats = [f"%.{DIGITS}g", *("%d" if signal.dtype.kind == "i" else f"%.{DIGITS}g" for signal in content.signals)]
    for run in content.runs:
        with (folder / f"run-{run.number}.csv").open("w", encoding="utf-8", newline="\n") as file:
            csv.writer(file, lineterminator="\n").writerow(headings)
            for piece in content.pieces(run):
                np.savetxt(file, np.column_stack(piece), fmt=formats, delimiter=",", newline="\n")
    for name, columns in content.tables.items():
        write_table(columns, folder / f"{name}.csv")


def write_table(columns: Sequence[TableColumn], path: Path) -> None:
    """Write one table; absent values are empty fields, Booleans are `yes` or `no`."""
    with path.open("w", encoding="utf-8", newline="\n") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(headed(column.name, column.unit) for column in columns)
        rows.writerows(zip(*(_cells(column) for column in columns), strict=True))


def write_channels(signals: Sequence[Signal], path: Path) -> None:
    """Write the descriptions of the columns, with the conversion of raw counts."""
    conversions = [name for signal in signals for name in signal.conversion or ()]
    names = list(dict.fromkeys(conversions))
    with path.open("w", encoding="utf-8", newline="\n") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["name", "unit", "quantity", "device", *names])
        for signal in signals:
            known = signal.conversion or {}
            cells = [_cell(known.get(name)) for name in names]
            texts = (signal.name, signal.unit, signal.quantity, signal.device)
            rows.writerow([*map(csv_cell, texts), *cells])


def _cells(column: TableColumn) -> list[str]:
    return [_cell(value) for value in column.values]


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return repr(value) if isinstance(value, float) else csv_cell(str(value))


FORMAT = ExportFormat("CSV", write)
