"""Rows of a large map, kept in a folder until the map is complete, so that it continues after a crash.

Every column is a file to which blocks of rows are appended. A state file, replaced after each block, has the number of
rows of these files and the state from which the map continues. Longer files are from an interrupted block and are cut.
"""

import json
import os
import shutil
from hashlib import sha256
from pathlib import Path
from typing import Any
from uuid import uuid4
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from bench.datafile.tables import Column, Table
from bench.result_cache import stamp
from bench.unfinished import replace
from sim.errors import InvalidInput
from sim.map_rows import Continuation

STATE, OWN = "state.npz", "unfinished-map"
"""Names of the state file, and of the file that marks the folder as one that may be removed and names the process that
writes to it.
"""

TEXT = "<U16"
"""Type of columns that contain strings."""


class MapStore:
    """Rows of the map defined by `inputs`, JSON content, in `folder`, which is created with the first block.

    Rows of a map with other inputs, or of another version of the program, are discarded.
    """

    def __init__(self, folder: Path, inputs: object) -> None:
        self.folder = folder
        self._key = sha256(json.dumps([inputs, stamp()], sort_keys=True).encode()).hexdigest()
        self._columns: dict[str, dict[str, str]] = {}
        self._rows = 0
        self._process, self._claimed = uuid4().hex, False
        self.after: Continuation | None = None
        """State from which the map continues; None at its beginning."""
        self._load()

    def append(self, table: Table, after: Continuation) -> None:
        """Append the rows of a block, and save the state `after` it.

        Raises OSError, and InvalidInput if the folder is not one of an unfinished map, or another process has begun to
        write to it.
        """
        if not self._columns:
            if self.folder.exists() and not (self.folder / OWN).exists():
                raise InvalidInput(
                    "folder", str(self.folder), "it does not contain an unfinished map; rename or remove it"
                )
            self.remove()
            self.folder.mkdir()
            self._columns = {
                name: {
                    "type": TEXT if each.values.dtype.kind == "U" else each.values.dtype.str,
                    "unit": each.unit,
                    "description": each.description,
                }
                for name, each in table.items()
            }
        if not self._claimed:
            self._claim()
        self._require_claim()
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
        self._require_claim()
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
        """All rows; their values are read from the files when they are used. Raises InvalidInput like `append`."""
        if self._claimed:
            self._require_claim()
        return {
            name: Column(self._values(name, each["type"]), each["unit"], each["description"])
            for name, each in self._columns.items()
        }

    def remove(self) -> None:
        """Remove the folder of a map whose results have been written."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _claim(self) -> None:
        (self.folder / OWN).write_text(self._process, encoding="ascii")
        self._claimed = True

    def _require_claim(self) -> None:
        """Refuse to continue if another process writes to the folder: the rows of the two would be mixed."""
        try:
            owner = (self.folder / OWN).read_text(encoding="ascii")
        except OSError:
            owner = ""
        if owner != self._process:
            remedy = "another process writes its map there; wait for its end, or choose another name for the results"
            raise InvalidInput("folder", str(self.folder), remedy)

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
