"""The journal beside the file: one line of JSON for each event, for people and for tools that read no HDF5.

It is also the second copy of what is worth most when a disk or a computer fails: `rockbench file recover` takes the
events from it that the file has lost.
"""

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any


def beside(path: Path) -> Path:
    """Where the journal of a file is."""
    return path.with_suffix(".events.jsonl")


class Diary:
    """Appends to a new journal. Raises FileExistsError where there is one, and OSError when the disk fails."""

    def __init__(self, path: Path) -> None:
        self._handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        self._written = False

    def add(self, time: float, kind: str, text: str, more: Mapping[str, Any]) -> None:
        """One event at `time` [s], with `more` of its content."""
        line = json.dumps({"time": time, "kind": kind, "text": text, **more}, ensure_ascii=False) + "\n"
        # one call without a buffer: a killed program leaves whole lines
        os.write(self._handle, line.encode())
        self._written = True

    def sync(self) -> None:
        """Bring what was added onto the disk itself."""
        if self._written:
            os.fsync(self._handle)
            self._written = False

    def close(self) -> None:
        """Let go of the file. Allowed any number of times."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1


def read(path: Path) -> Iterator[dict[str, Any]]:
    """The lines of a journal before the first that was cut short or is damaged; none where there is no journal."""
    if not path.is_file():
        return
    # not splitlines: a text may hold other characters that end a line
    for line in path.read_text(encoding="utf-8", errors="replace").split("\n"):
        try:
            read = json.loads(line)
        except (json.JSONDecodeError, RecursionError):
            return
        if not (isinstance(read, dict) and {"time", "kind", "text"} <= read.keys()):
            return
        yield read
