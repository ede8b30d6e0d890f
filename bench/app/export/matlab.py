"""MATLAB format 5, which Octave and scipy also read: one file per run, and one with the result tables."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.app.export.format import Content, ExportFormat, TableColumn
from sim.errors import InvalidInput

LARGEST = 2**31 - 1
"""Maximum size of a variable in this format [bytes]."""

LONGEST = 63
"""Maximum length of a name [characters]."""

_OWN = ("time", "units", "channels", "info")
_KEYWORDS = (
    *("break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function", "global", "if"),
    *("otherwise", "parfor", "persistent", "return", "spmd", "switch", "try", "while"),
)


def check(content: Content) -> None:
    """Raise InvalidInput for a run that is too large for the format."""
    for run in content.runs:
        needed = 8 * len(run.rows)
        if needed > LARGEST:
            size = f"a variable of run {run.number} needs {needed / 2**30:.1f} GiB"
            raise InvalidInput("--to", "mat", f"{size}, but the format is limited to 2 GiB: use --to parquet")


def write(content: Content, folder: Path) -> None:
    """Write run-<number>.mat with a variable for the time and each signal (column vectors), and tables.mat.

    `units` and `channels` have a field for each variable, so that `units.laser_1` is the unit of `laser_1`; a name that
    MATLAB does not allow is changed, and `channels.laser_1.name` has the original.
    """
    names = variables([signal.name for signal in content.signals], _OWN)
    units = {"time": "s"} | {name: each.unit for name, each in zip(names, content.signals, strict=True)}
    channels = {
        name: {
            "name": each.name,
            "unit": each.unit,
            "quantity": each.quantity,
            "device": each.device,
            **(each.conversion or {}),
        }
        for name, each in zip(names, content.signals, strict=True)
    }
    info = _fields(content.info)
    for run in content.runs:
        # only one column at a time is in memory
        makers: dict[str, Callable[[], Any]] = {
            "time": lambda run=run: run.time[:],
            **{
                name: (lambda run=run, each=each: each.of(run))
                for name, each in zip(names, content.signals, strict=True)
            },
            "units": lambda: units,
            "channels": lambda: channels,
            "info": lambda run=run: info | {"run": float(run.number)},
        }
        _save(folder / f"run-{run.number}.mat", makers)
    tables = dict(zip(variables(list(content.tables), _OWN), content.tables.values(), strict=True))
    makers = {name: (lambda columns=columns: _table(columns)) for name, columns in tables.items()}
    table_units = {name: _units(columns) for name, columns in tables.items()}
    _save(folder / "tables.mat", {**makers, "units": lambda: table_units, "info": lambda: info})


def variables(names: Sequence[str], taken: Iterable[str] = ()) -> list[str]:
    """Valid MATLAB names for `names`, in the same order, distinct from each other and from those in `taken`."""
    found: list[str] = []
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_]", "_", name)[:LONGEST]
        plain = plain if re.match(r"[A-Za-z]", plain) else f"x{plain}"[:LONGEST]
        tried, number = plain, 1
        while tried in found or tried in taken or tried in _KEYWORDS:
            number += 1
            tried = f"{plain[: LONGEST - 1 - len(str(number))]}_{number}"
        found.append(tried)
    return found


class _OneAtATime(Mapping[str, Any]):
    """Mapping whose values are computed on each access and not retained."""

    def __init__(self, makers: Mapping[str, Callable[[], Any]]) -> None:
        self._makers = makers

    def __getitem__(self, key: str) -> Any:
        return self._makers[key]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


def _save(path: Path, makers: Mapping[str, Callable[[], Any]]) -> None:
    from scipy.io import savemat

    values: Any = _OneAtATime(makers)
    savemat(path, values, long_field_names=True, oned_as="column")


def _table(columns: Sequence[TableColumn]) -> dict[str, Any]:
    names = variables([column.name for column in columns])
    return {name: _values(column) for name, column in zip(names, columns, strict=True)}


def _units(columns: Sequence[TableColumn]) -> dict[str, str]:
    names = variables([column.name for column in columns])
    return {name: column.unit for name, column in zip(names, columns, strict=True)}


def _values(column: TableColumn) -> NDArray[Any]:
    """Numbers and Booleans (0, 1) as doubles, NaN where absent; strings as a cell array, empty where absent."""
    if column.kind == "text":
        cells = np.empty(len(column.values), dtype=object)
        cells[:] = ["" if value is None else value for value in column.values]
        return cells
    return np.array([np.nan if value is None else float(value) for value in column.values])


def _fields(info: Mapping[str, Any]) -> dict[str, Any]:
    return dict(zip(variables(list(info)), info.values(), strict=True))


FORMAT = ExportFormat("MATLAB", write, check)
