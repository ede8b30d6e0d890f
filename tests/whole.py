# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false
"""Whether a file that has its final name is a whole one, by its own content alone."""

import csv
import io
import json
from pathlib import Path

import h5py
import numpy as np

from bench.datafile.inspection import verify
from bench.datafile.structure import check_structure
from sim.errors import RockbenchError

ENDINGS = {
    ".html": (b"<!doctype html>", b"</html>"),
    ".pdf": (b"%PDF-", b"%%EOF"),
    ".png": (b"\x89PNG", b"IEND\xaeB`\x82"),
    ".svg": (b"<?xml", b"</svg>"),
    ".uff": (b"    -1", b"    -1"),
    ".parquet": (b"PAR1", b"PAR1"),
}
"""First and last bytes by the name's ending, without regard to case and white space."""
VERIFIED = ("rocking-bench record", "rocking-bench analysis")


def partial(path: Path) -> str | None:
    """Why the file or a file of the folder at `path` is not whole; None where everything is."""
    if path.is_dir():
        found = [partial(each) for each in sorted(path.iterdir())]
        return next(filter(None, found), None) if found else f"{path.name} is an empty folder"
    kind = path.suffix.lower()
    try:
        if kind == ".h5":
            why = _data_file(path)
        elif kind in ENDINGS:
            content = path.read_bytes().lower()
            first, last = (part.lower() for part in ENDINGS[kind])
            why = None if content.startswith(first) and content.rstrip().endswith(last) else "it is cut"
        elif kind == ".csv":
            why = _columns(path)
        elif kind == ".json":
            why = None if json.loads(path.read_text(encoding="utf-8")) else "it is empty"
        elif kind == ".mat":
            from scipy.io import loadmat

            why = None if loadmat(path) else "it has no variables"
        else:
            why = "no result has such a name"
    except (OSError, ValueError, KeyError, RockbenchError) as error:
        why = str(error)
    return why and f"{path.name}: {why}"


def _data_file(path: Path) -> str | None:
    with h5py.File(path, "r", locking=False) as file:
        check_structure(file, path)
        tables = list[h5py.Dataset]()
        file.visititems(lambda _, each: tables.append(each) if isinstance(each, h5py.Dataset) else None)
        for table in tables:
            np.asarray(table[()])
        if not tables:
            return "it has no datasets"
        verified = file.attrs.get("format") in VERIFIED
    return next(iter(verify(path).problems), None) if verified else None


def _columns(path: Path) -> str | None:
    text = path.read_text(encoding="utf-8")
    rows = list(csv.reader(io.StringIO(text, newline="")))
    same = bool(rows) and all(len(row) == len(rows[0]) for row in rows)
    return None if same and text.endswith("\n") else "its last row is cut"
