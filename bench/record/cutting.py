"""Cuts the parts of a copied file to what belongs together: no row of which something is missing is left."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bench.record import hdf5
from bench.record.declared import part_of


def cut(entry: hdf5.Group, counted: Mapping[str, int]) -> dict[str, int]:
    """Cut the datasets of each part to the shortest of them, and samples and blocks to one another.

    Of the last block that is known the end is not, where later ones of those `counted` were lost: it is left out.
    Returns the rows of every part.
    """
    parts: dict[str, list[hdf5.Dataset]] = {name: [] for name in counted}
    for stored in hdf5.datasets(entry):
        if hdf5.grows(stored):
            parts[part_of(stored.name)].append(stored)
    rows = {name: min((each.shape[0] for each in stored), default=0) for name, stored in parts.items()}
    row, run, first = (
        hdf5.dataset(entry, f"instrument/blocks/{name}")[: rows["blocks"]] for name in ("row", "run", "first")
    )
    lost = rows["blocks"] < counted["blocks"]
    rows["blocks"], rows["samples"] = _placed(row, run, first, rows["samples"], lost=lost)
    for name, stored in parts.items():
        for each in stored:
            each.resize((rows[name],))
    return rows


def _placed(
    row: NDArray[np.int64], run: NDArray[np.int64], first: NDArray[np.int64], samples: int, *, lost: bool
) -> tuple[int, int]:
    """How many blocks and samples are placed as a bench places them.

    Rows begin at 0 and rise, runs never fall, and within a run samples may be missing but not come twice.
    """
    if not len(row) or row[0] != 0 or run[0] < 1 or first[0] < 0:
        return 0, 0
    length, runs = np.diff(row), np.diff(run)
    fits = (length > 0) & (runs >= 0) & (first[1:] >= np.where(runs == 0, first[:-1] + length, 0))
    # of two blocks that do not follow one another either may be the wrong one
    last = len(row) - 1 if fits.all() else int(np.argmin(fits))
    if lost or not fits.all():
        samples = min(samples, int(row[last]))
    return int(np.searchsorted(row[: last + 1], samples)), samples
