"""Export to NumPy archives: `numpy.load("run-1.npz")["table_acceleration"]`; units are in units.json."""

import json
from pathlib import Path

import numpy as np

from bench.app.export.format import Content, ExportFormat


def write(content: Content, folder: Path) -> None:
    """One archive for each run with its time, and one for each table of results."""
    for run in content.runs:
        np.savez_compressed(
            folder / f"run-{run.number}.npz",
            time=np.concatenate(list(run.time.pieces(2**18))),
            **{signal.name: signal.of(run) for signal in content.signals},
        )
    for name, columns in content.tables.items():
        np.savez_compressed(folder / f"{name}.npz", **{column.name: _array(column.values) for column in columns})
    units = {signal.name: signal.unit for signal in content.signals}
    (folder / "units.json").write_text(json.dumps({"time": "s", **units}, indent=2), encoding="utf-8")


def _array(values: object) -> np.ndarray:
    """Absent values are NaN among numbers and empty among texts."""
    found = list(values)  # type: ignore[call-overload]
    texts = any(isinstance(value, str) for value in found)
    return np.array([("" if texts else np.nan) if value is None else value for value in found])


FORMAT = ExportFormat("NumPy", write)
