"""An open campaign for scripts and notebooks: results, samples of signals in SI units, journal and configuration."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import nan
from os import PathLike
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from bench.analysis.signals import SIGNALS, SignalMap
from bench.app.export.format import TableColumn, content_of
from bench.config.model import BenchConfiguration
from bench.datafile.reader import DataFile, JournalEntry, open_datafile
from bench.datafile.resting import rows_at_rest, run_starts
from bench.document.campaign import Campaign as Contents
from bench.document.typography import counted
from bench.events import SpecimenMounted
from bench.results import FILE
from sim.errors import InvalidInput
from sim.specimen import Specimen

REST = 2.0
"""Longest time at rest that is averaged for the zero of a signal [s], unless the protocol specifies another."""


@dataclass(frozen=True, eq=False, repr=False)
class Quantity(NDArrayOperatorsMixin):
    """An array with its SI unit: "1" for pure numbers, "" for strings and Booleans. numpy and matplotlib treat it as an
    array; arithmetic returns plain arrays without a unit.
    """

    values: NDArray[Any]
    unit: str

    @property
    def shape(self) -> tuple[int, ...]:
        return self.values.shape

    @property
    def ndim(self) -> int:
        return self.values.ndim

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.values, dtype=dtype, copy=copy)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        plain = [each.values if isinstance(each, Quantity) else each for each in inputs]
        return getattr(ufunc, method)(*plain, **options)

    def __len__(self) -> int:
        return len(self.values)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.values)

    def __getitem__(self, key: Any) -> "Quantity":
        return Quantity(np.asarray(self.values[key]), self.unit)

    def __float__(self) -> float:
        return float(self.values)

    def __repr__(self) -> str:
        unit = "" if self.unit == "1" else self.unit
        return f"{np.array2string(self.values, precision=6, threshold=20, separator=', ')} {unit}".rstrip()


@dataclass(frozen=True, eq=False, repr=False)
class Samples(Quantity):
    """Samples of the signal `name`, shape (n,), and their bench times [s], which increase, with gaps between runs."""

    time: Quantity
    name: str


@dataclass(frozen=True)
class Run:
    """A run: the samples from the arming of the rig at bench time `start` [s] to its stop at `stop` [s]. `beta` is the
    label (k_C/k1) of the mounted spring, None for the bare frame.
    """

    number: int
    start: float
    stop: float
    beta: float | None


class Campaign:
    """The data file of a campaign: finished, interrupted, or still being written. Use it in a `with` statement. Data
    are read on access; `refresh` includes data that were written to the file after it was opened.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        given = Path(path)
        self.path = given / FILE if given.is_dir() else given
        self._file: DataFile = open_datafile(self.path)
        self._contents = Contents(self.path, self._file)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Campaign {self.path}: {self.protocol}, {self.status}, {counted(len(self._file.points), 'point')}>"

    def close(self) -> None:
        """Close the file; may be called repeatedly."""
        self._file.close()

    def refresh(self) -> None:
        """Include data written since the file was opened."""
        self._file.refresh()
        self.__dict__.pop("runs", None)

    @property
    def status(self) -> str:
        """Status: completed, stopped, aborted, halted or failed; running while the file is being written, and also if
        its writer was killed; interrupted for a file recovered with losses or from a killed writer.
        """
        return self._file.status

    @property
    def summary(self) -> str:
        """Reason for the end of the campaign."""
        return self._file.summary

    @property
    def protocol(self) -> str:
        """Name of the protocol; empty if the file does not state it."""
        return self._contents.protocol

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters of the protocol in SI units."""
        return self._contents.parameters

    @property
    def configuration(self) -> BenchConfiguration:
        """Configuration of the bench. Raises InvalidInput if this version cannot read it."""
        found = self._contents.configuration
        if found is None:
            allowed = "its configuration was written by another version of this software; read it with that version"
            raise InvalidInput("record", str(self.path), allowed)
        return found

    @property
    def specimen(self) -> Specimen:
        """The specimen of the predictions. Raises InvalidInput if the file has none."""
        return self._contents.specimen

    @property
    def points(self) -> dict[str, Quantity]:
        """The results, one array per column; absent numbers are NaN. Empty before the first result."""
        return self._tables.get("points", {})

    @property
    def tables(self) -> dict[str, dict[str, Quantity]]:
        """All other non-empty tables except the journal: "prediction", "preflight", "estimates" and so on."""
        return {name: table for name, table in self._tables.items() if name not in ("points", "events")}

    @property
    def events(self) -> list[JournalEntry]:
        """The journal: bench time `time` [s], `kind` and `text` of each entry."""
        return self._file.events

    @property
    def sample_rate(self) -> float:
        """Sample rate [1/s]."""
        return self._file.sample_rate

    @property
    def signals(self) -> dict[str, str]:
        """Unit of each signal that `samples` returns, by name."""
        own = dict.fromkeys(SIGNALS, "m") | {"acceleration": "m/s2", "u2": "m"}
        return {**own, **{each.name: each.unit for each in self._map.further}, "drive": "V"}

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """The runs in the file so far, in order."""
        mounted = self._file.entries_of(SpecimenMounted)
        found: list[Run] = []
        for run, start in zip(self._file.runs, run_starts(self._file), strict=True):
            stop = start + float(run.time[-1]) + 1.0 / self.sample_rate
            # the specimen is mounted before the rig is armed; both times agree within a block
            springs = [row["beta"] for row in mounted if row["time"] < 0.5 * (start + stop)]
            found.append(Run(run.number, start, stop, springs[-1] if springs else None))
        return tuple(found)

    def samples(
        self,
        signal: str,
        *,
        run: int | None = None,
        coupled: bool | float | None = None,
        start: float | None = None,
        stop: float | None = None,
    ) -> Samples:
        """Samples of a signal in SI units, relative to the zero of each run, with the calibration of the lasers
        applied; NaN where a sensor had no valid value. By default, samples of all runs.

        run : number of the run.
        coupled : label of a spring, True for any spring, or False for the bare frame.
        start, stop : bench times [s] from `start` up to but not including `stop`.

        Raises InvalidInput for an unknown signal or run.
        """
        if signal not in self.signals:
            raise InvalidInput("signal", signal, f"it must be one of {', '.join(self.signals)}")
        if run is not None and run not in [each.number for each in self.runs]:
            several = f"the file contains runs 1 to {len(self.runs)}"
            allowed = {0: "the file contains no run", 1: "the file contains only run 1"}
            raise InvalidInput("run", run, allowed.get(len(self.runs), several))
        times, values = [np.empty(0)], [np.empty(0)]
        for each, stored in zip(self.runs, self._file.runs, strict=True):
            specimen = each.beta is not None if isinstance(coupled, bool) else each.beta
            if (run is not None and each.number != run) or (coupled is not None and specimen != coupled):
                continue
            time = each.start + stored.time[:]
            first, last = np.searchsorted(time, (-np.inf if start is None else start, np.inf if stop is None else stop))
            if first < last:
                rows = slice(stored.rows.start + int(first), stored.rows.start + int(last))
                times.append(time[first:last])
                rest = self.parameters.get("rest", REST)
                values.append(self._signal(signal, rows, rows_at_rest(self._file, stored.rows.start, rest)))
        unit = self.signals[signal]
        return Samples(np.concatenate(values), unit, Quantity(np.concatenate(times), "s"), signal)

    def _signal(self, signal: str, rows: slice, rest: slice) -> NDArray[np.float64]:
        if signal == "drive":
            return self._file.drive(rows).astype(np.float64)
        self._map.tare(self._channels(rest))
        found = self._map.of(self._channels(rows))
        names = [*SIGNALS, *(each.name for each in self._map.further)]
        if signal == "u2":
            return found[:, names.index("u1")] + found[:, names.index("drift")]
        return found[:, names.index(signal)]

    def _channels(self, rows: slice) -> NDArray[np.float64]:
        """Values of all channels, shape (n, n_channels)."""
        return np.column_stack([self._file.values(channel.name, rows) for channel in self._file.channels])

    @cached_property
    def _map(self) -> SignalMap:
        bench = self.configuration
        return SignalMap(self._file.channels, bench.laser_reference, bench.calibrated)

    @property
    def _tables(self) -> dict[str, dict[str, Quantity]]:
        content = content_of(self._file, self.path, raw=False)
        return {name: {each.name: _quantity(each) for each in table} for name, table in content.tables.items()}


def _quantity(column: TableColumn) -> Quantity:
    absent = "" if column.kind == "text" else nan
    return Quantity(np.array([absent if value is None else value for value in column.values]), column.unit)
