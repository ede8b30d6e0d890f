"""Error curves of both lasers, from the equations that the second storey gives in every test.

The equations (`bench.analysis.storey_equations`, `bench.analysis.curve_observations`) are linear functions of the
curves, whose posterior is that of `bench.analysis.curve_posterior`.

Equations relate the two lasers with each other: of errors in proportion to the reading they tell the difference only,
which is that of the scales. What both have in common changes all drifts alike, and the residuals with them: readings
that are all error would leave none. That is no sign of errors, so the common proportion has no part in the equations.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bench.analysis.bare_harmonics import PROPERTIES, Both, bare_numbers, largest_drifts, observed_by, spreads
from bench.analysis.curve_observations import observations, without_noise_in_rows
from bench.analysis.curve_posterior import Candidates, LaserCurves
from bench.analysis.error_curve import CAUTION, block_diagonal
from bench.analysis.linearity import LinearFrame
from bench.analysis.signals import LASER_1, LASER_2
from bench.analysis.storey_equations import KEPT, Equations, StoreyMotion, storey_motion

Array = NDArray[np.float64]

FEWEST = 4
"""Minimum number of blocks of a test."""


def laser_curves(
    tests: Sequence[Array],
    frame: LinearFrame,
    sample_rate: float,
    limits: tuple[float, float],
    ranges: tuple[float, float],
    mismatch: float,
    block: float,
    caution: float = CAUTION,
    checks: Both = ((), ()),
) -> LaserCurves | None:
    """Curves according to the signals of `tests` with the same lasers, shape (n, len(SIGNALS)) each, of a `frame` with
    or without block; None if no test has a strong motion that is long and complete enough, or if the motions tell
    nothing of the errors.

    `limits` are the largest linearity errors and `ranges` the measuring ranges of the lasers [m]; `mismatch` is the
    standard uncertainty of the ratio of their scales. Residuals may be correlated within `block` seconds. Pairs of
    candidates are weighted by the power `caution` of their evidence. The `checks` are harmonics of tests of the bare
    frame, which observe the curves as well.
    """
    moved = [found for each in tests if (found := storey_motion(each, frame, sample_rate)) is not None]
    if not moved or 0.0 in limits:
        return None
    # also those of tests without equations, whose peaks are corrected as well
    read = [
        np.concatenate([*(each[:, column] for each in tests), *(each.readings for each in found)])
        for column, found in zip((LASER_1, LASER_2), checks, strict=True)
    ]
    candidates = Candidates.over((read[0], read[1]), limits, ranges, caution)
    first, second = candidates.places
    found = [each.equations(candidates.bases) for each in moved]
    rows, slopes = _joined(found)
    values = np.concatenate([each.values for each in found])
    scales = np.ones(rows.shape[1])
    scales[first.size + second.size] = mismatch
    # the readings themselves as errors
    alike = np.zeros(rows.shape[1])
    alike[: first.size + second.size] = np.concatenate((first, second))
    rows, slopes = (scales * each - np.outer(each @ alike, alike / (alike @ alike)) for each in (rows, slopes))
    removed = sum(each.removed for each in found)
    observed = observations(rows, values, removed, _blocks(moved, block), candidates.flexible)
    if not observed.values.size:
        return None
    ends = np.cumsum([each.values.size for each in found]).tolist()
    found_here = without_noise_in_rows(observed, rows, values, slopes, ends)
    if not any(checks):
        return candidates.curves(found_here, scales)
    known, further = first.size + second.size + 1, rows.shape[1] - first.size - second.size
    harmonics = bare_numbers(checks, candidates.bases, largest_drifts(checks))
    both = found_here.beside(observed_by(harmonics, candidates, limits), known)
    units = np.concatenate((scales, np.ones(both.rows.shape[1] - scales.size)))
    return candidates.curves(both, units, spreads(further, PROPERTIES))


def _joined(found: Sequence[Equations]) -> tuple[Array, Array]:
    """Rows of all tests and their slopes, shapes (equations, unknowns) and (tests, unknowns). The unknowns are those of
    the curves, the scale, and the changes of the second storey in each test.
    """
    rows, slopes = np.concatenate([each.rows for each in found]), np.array([each.slopes for each in found])
    own = block_diagonal([each.own for each in found])
    own_slopes = block_diagonal([each.own_slopes[None] for each in found])
    return np.concatenate((rows, own), axis=1), np.concatenate((slopes, own_slopes), axis=1)


def _blocks(moved: Sequence[StoreyMotion], block: float) -> NDArray[np.intp]:
    """Index of the first equation of each block, in all tests."""
    firsts, before = list[NDArray[np.intp]](), 0
    for each in moved:
        size = max(min(round(block * each.rate / KEPT), each.kept.size // FEWEST), 1)
        firsts.append(before + np.arange(0, each.kept.size, size))
        before += each.kept.size
    return np.concatenate(firsts)
