"""Rows of a large map, kept in a folder until the map is complete, so that its computation can continue after a crash.

Each column is a file to which blocks of rows are appended. A state file, replaced after each block, contains the number
of rows of these files and the state from which the map continues. Longer files are left from an interrupted block;
their excess is overwritten or truncated by the next one.
"""

import gc
import json
import os
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from bench.datafile.tables import Column, Table
from bench.result_cache import stamp
from bench.unfinished import replace
from sim.errors import InvalidInput
from sim.map_rows import Continuation
from sim.process_lock import LockHeld, ProcessLock

STATE, OWN = "state.npz", "unfinished-map"
"""Names of the state file, and of the file that marks the folder as one that may be removed; the lock of the process
that writes to the folder is stored next to the latter.
"""

TEXT = "<U16"
"""Type of columns that contain strings."""


class MapStore:
    """Rows of the map defined by `inputs`, JSON content, in `folder`, which this process creates if missing and locks.

    Rows of a map with other inputs, or of another version of the program, are discarded with the first block. Raises
    OSError, and InvalidInput if the folder is not one of an unfinished map, or another process writes to it.
    """

    def __init__(self, folder: Path, inputs: object) -> None:
        self.folder = folder
        self._key = sha256(json.dumps([inputs, stamp()], sort_keys=True).encode()).hexdigest()
        self._columns: dict[str, dict[str, str]] = {}
        self._rows = 0
        self.after: Continuation | None = None
        """State from which the map continues; None at its beginning."""
        self._lock = _locked(folder)
        self._load()

    def append(self, table: Table, after: Continuation) -> None:
        """Append the rows of a block, and save the state `after` it. Raises OSError."""
        if not self._columns:
            _clear(self.folder)
            self._columns = {
                name: {
                    "type": TEXT if each.values.dtype.kind == "U" else each.values.dtype.str,
                    "unit": each.unit,
                    "description": each.description,
                }
                for name, each in table.items()
            }
        count = 0
        for name, each in table.items():
            kind = np.dtype(self._columns[name]["type"])
            count = len(each.values)
            with self._path(name).open("r+b" if self._rows else "wb") as file:
                file.seek(self._rows * kind.itemsize)
                file.write(np.ascontiguousarray(each.values, dtype=kind).tobytes())
                file.truncate()
                file.flush()
                os.fsync(file.fileno())
        self._rows += count
        self.after = after
        about = json.dumps([self._key, self._rows, after.rows, self._columns])
        temporary = self.folder / f".{STATE}"
        with temporary.open("wb") as file:
            np.savez(file, about=np.array(about), sections=after.sections, jacobians=after.jacobians)
            file.flush()
            os.fsync(file.fileno())
        replace(temporary, self.folder / STATE)

    def table(self) -> Table:
        """All rows; their values are read from the files when they are used."""
        return {
            name: Column(self._values(name, each["type"]), each["unit"], each["description"])
            for name, each in self._columns.items()
        }

    def close(self) -> None:
        """Release the folder; it is removed if it contains no rows."""
        if self.after is None:
            _remove(self.folder, self._lock)
        self._lock.release()

    def remove(self) -> None:
        """Remove the folder of a map whose results have been written. Its table must no longer be referenced."""
        # Windows cannot remove a mapped file, and a reference cycle, as in a figure, would keep the file mapped
        gc.collect()
        _remove(self.folder, self._lock)

    def _values(self, name: str, kind: str) -> NDArray[Any]:
        if not self._rows:
            return np.empty(0, kind)
        return np.memmap(self._path(name), dtype=kind, mode="r", shape=(self._rows,))

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.bin"

    def _load(self) -> None:
        """Read the state of an unfinished map with the same inputs."""
        try:
            with np.load(self.folder / STATE, allow_pickle=False) as stored:
                key, rows, done, columns = json.loads(str(stored["about"]))
                after = Continuation(done, stored["sections"], stored["jacobians"])
            sizes = {
                name: self._path(name).stat().st_size >= rows * np.dtype(each["type"]).itemsize
                for name, each in columns.items()
            }
        except (OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile):
            return
        if key == self._key and all(sizes.values()):
            self._rows, self._columns, self.after = rows, columns, after


def discard(folder: Path) -> None:
    """Remove the folder of an unfinished map that will not be continued; any other folder, and one to which a process
    writes, is kept.
    """
    if folder.is_dir():
        with suppress(OSError, InvalidInput):
            _remove(folder, _locked(folder))


def _locked(folder: Path) -> ProcessLock:
    if folder.exists() and not (folder / OWN).exists() and any(folder.iterdir()):
        raise InvalidInput("folder", str(folder), "the folder does not contain an unfinished map; rename or remove it")
    folder.mkdir(exist_ok=True)
    (folder / OWN).touch()
    try:
        return ProcessLock(folder / OWN, f"process {os.getpid()}")
    except LockHeld as error:
        remedy = (
            f"{error.holder} is writing its map there; wait for it to finish, or choose another name for the results"
        )
        raise InvalidInput("folder", str(folder), remedy) from None


def _clear(folder: Path) -> None:
    """Remove all files except the marker of the folder and the lock."""
    for path in folder.iterdir():
        if not path.name.startswith(OWN):
            path.unlink()


def _remove(folder: Path, lock: ProcessLock) -> None:
    with suppress(OSError):
        _clear(folder)
        (folder / OWN).unlink()
    lock.release(remove=True)
    with suppress(OSError):
        folder.rmdir()
