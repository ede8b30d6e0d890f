"""Universal File Format: one file per run with a dataset 58 (binary) for each signal; tables, which UFF lacks, are
written as text.

The format cannot represent missing values, and pyuff writes 0 for them, so a signal is split where samples are missing
or invalid, and each part is a separate dataset.
"""

import shutil
import tempfile
import warnings
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.app.export import text
from bench.app.export.format import Content, ExportFormat, Signal
from bench.datafile.series import RecordedRun
from sim.errors import InvalidInput

MOST_PARTS = 200
"""Maximum number of parts of a signal; the export of a signal with more parts is refused."""

_KINDS = {"m": 8, "m/s": 11, "m/s2": 12, "N": 13}
"""Specific data type of the ordinate by unit; 0 (unknown) for other units."""

_TIME_RESPONSE, _TIME, _REAL_DOUBLE, _EVEN = 1, 17, 4, 1
_LABEL, _LINE = 20, 80


def write(content: Content, folder: Path) -> None:
    """Write run-<number>.uff, and the tables as text. Raises InvalidInput for a signal with more than `MOST_PARTS`
    parts.
    """
    pyuff: Any = import_module("pyuff")  # `Any`: pyuff is an optional dependency without type information
    for run in content.runs:
        with (folder / f"run-{run.number}.uff").open("wb") as file:
            _append(pyuff, file, _units(pyuff), folder)
            time = run.time[:]
            for node, signal in enumerate(content.signals, 1):
                values = signal.of(run)
                for start, stop in _parts(signal, values, time, content.sample_rate):
                    dataset = _dataset(content, run, signal, node, values[start:stop], time[start:stop])
                    _append(pyuff, file, dataset, folder)
    text.write_channels(content.signals, folder / text.CHANNELS)
    for name, columns in content.tables.items():
        text.write_table(columns, folder / f"{name}.csv")


def _append(pyuff: Any, file: Any, dataset: dict[str, Any], folder: Path) -> None:
    """Append a dataset. It is first written to a separate file, because pyuff rereads the whole file after each
    addition.
    """
    with tempfile.TemporaryDirectory(dir=folder, prefix=".part-") as parts:
        path = Path(parts, "part.uff")
        with warnings.catch_warnings():
            # pyuff does not close the last file that it opened for binary data; the interpreter does
            warnings.simplefilter("ignore", ResourceWarning)
            pyuff.UFF(str(path)).write_sets(dataset, "add")
        with path.open("rb") as part:
            shutil.copyfileobj(part, file)


def _units(pyuff: Any) -> dict[str, Any]:
    """Dataset 164: SI units."""
    return pyuff.prepare_164(
        units_code=1, units_description="SI", temp_mode=1, length=1.0, force=1.0, temp=1.0, temp_offset=273.15
    )


def _parts(signal: Signal, values: NDArray[Any], time: NDArray[np.float64], rate: float) -> Iterator[tuple[int, int]]:
    """Uninterrupted parts of the signal as index ranges [start, stop); parts of a single sample are omitted."""
    good = np.isfinite(values)
    # the sample after a gap in time begins a new part
    follows = np.concatenate(([False], np.diff(time) < 1.5 / rate))
    inside = good & np.concatenate(([False], good[:-1])) & follows
    starts = np.flatnonzero(good & ~inside)
    if starts.size > MOST_PARTS:
        gaps = f"missing samples divide {signal.name} into {starts.size} parts"
        raise InvalidInput("--to", "uff", f"{gaps}, too many for UFF: use --to parquet, or --raw")
    ends = np.flatnonzero(good & ~np.concatenate((inside[1:], [False]))) + 1
    for start, stop in zip(starts.tolist(), ends.tolist(), strict=True):
        if stop - start > 1:
            yield start, stop


def _dataset(
    content: Content,
    run: RecordedRun,
    signal: Signal,
    node: int,
    values: NDArray[Any],
    time: NDArray[np.float64],
) -> dict[str, Any]:
    info = content.info
    # the header stores six digits of the abscissa; the text lines have the exact value
    exact = (
        f"first sample {round(time[0] * content.sample_rate)} of the run, {content.sample_rate!r} samples per second"
    )
    lines = (
        signal.name,
        f"run {run.number} of {info['file']}",
        f"{info['start_time']}",
        f"{signal.quantity} {signal.device}".strip(),
        exact,
    )
    return {
        "type": 58,
        "binary": 1,
        **{f"id{k}": line[:_LINE] or "NONE" for k, line in enumerate(lines, 1)},
        "func_type": _TIME_RESPONSE,
        "rsp_node": node,
        "rsp_dir": 1,
        "ref_node": 0,
        "ref_dir": 0,
        "ord_data_type": _REAL_DOUBLE,
        "abscissa_spacing": _EVEN,
        "abscissa_spec_data_type": _TIME,
        "abscissa_axis_lab": "time",
        "abscissa_axis_units_lab": "s",
        "ordinate_spec_data_type": _KINDS.get(signal.unit, 0),
        "ordinate_axis_lab": signal.name[:_LABEL],
        "ordinate_axis_units_lab": signal.unit[:_LABEL],
        "orddenom_spec_data_type": 0,
        "z_axis_spec_data_type": 0,
        "x": time,
        "data": values.astype(np.float64, copy=False),
    }


FORMAT = ExportFormat("UFF", write, library="pyuff")
