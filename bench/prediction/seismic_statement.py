"""The paper's statement 8, on earthquake records, as checks of what the model does."""

from collections.abc import Sequence

import numpy as np

from bench.prediction.seismic import SeismicCurve
from bench.prediction.verdicts import Check, Statement

ABOUT = 0.1
"""How near to 0.5 the best gain must be to be around it."""


def seismic_statement(curves: Sequence[SeismicCurve]) -> Statement:
    """Statement 8 for some records, each with its gains over the stiffness: alpha_2 < 1, best about 0.5, towards 1 as
    beta grows (sections 5.1 and 5.2).

    It is not expected to hold: with the table's values and records on their own time scale the paper's experiments are
    not reproduced, and what lies below 1 to 2 Hz decides. A block that topples has no gain, and alpha_2 < 1 fails.
    """
    gains = [gain for curve in curves for gain in curve.gains]
    known = np.array([gain.alpha_2 for gain in gains if gain.alpha_2 is not None])
    toppled = sum(gain.motion.overturned is not None for gain in gains)
    below = int((known < 1.0).sum())
    least = float(known.min()) if known.size else float("nan")
    most = float(known.max()) if known.size else float("nan")
    everywhere = Check(
        "α₂ < 1 for every record and stiffness, and nothing topples",
        f"α₂ < 1 in {below} of {len(gains)} runs, from {least:.3f} to {most:.3f}; the block topples in {toppled}",
        below == len(gains),
        {"below": below, "runs": len(gains), "toppled": toppled, "least": least, "most": most},
        expected=False,
    )
    best = Check(
        f"the best α₂ is about 0.5 (within {ABOUT:g})",
        f"{least:.3f}",
        abs(least - 0.5) <= ABOUT,
        {"best": least},
        expected=False,
    )
    ends = [_ends(curve) for curve in curves]
    nearer = sum(last < first for first, last in ends)
    towards = Check(
        "α₂ is nearer to 1 at the largest β than at the smallest, for every record",
        f"so for {nearer} of {len(curves)} records",
        nearer == len(curves),
        {"nearer": nearer, "records": len(curves)},
        expected=False,
    )
    return Statement(8, "Gain under earthquake records", [everywhere, best, towards])


def _ends(curve: SeismicCurve) -> tuple[float, float]:
    """Distance of alpha_2 from 1 at the smallest and at the largest stiffness that have one; NaN without."""
    known = [gain.alpha_2 for gain in curve.gains if gain.alpha_2 is not None]
    return (abs(known[0] - 1.0), abs(known[-1] - 1.0)) if known else (float("nan"), float("nan"))
