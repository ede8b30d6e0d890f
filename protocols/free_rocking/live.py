"""Live view of free rocking: restitution by impact, and the last tilt with the fitted motion."""

import numpy as np

from bench.analysis.uncertainty import COVERAGE
from bench.live_view import LiveRun, LiveView, Panel
from sim.free_rocking import theoretical_restitution

IMPACTS = "restitution"
"""Series contained in a fit of the impacts, but not in a fit of the motion."""


def rocking_view(run: LiveRun) -> LiveView:
    """Restitution of every impact of each tilt, with its expanded uncertainty, and the last tilt's fitted motion."""
    theory = theoretical_restitution(run.configuration.known_specimen.block)
    restitution = Panel(
        "restitution by impact",
        ("impact", "1"),
        ("restitution", "1"),
        awaits="The restitution of each impact appears here after the first tilt.",
    )
    motion = Panel(
        "motion of the block's face",
        ("time", "s"),
        ("displacement", "m"),
        awaits="The recorded and the fitted motion appear here after the first tilt.",
    )
    impacts = [fit for fit in run.fits if IMPACTS in fit.columns]
    for fit in impacts:
        values = fit.columns[IMPACTS].values
        spread = COVERAGE * fit.columns[f"{IMPACTS}_uncertainty"].values
        restitution.points(fit.name.removeprefix("impacts of "), np.arange(1, values.size + 1), values, spread)
    last = max((fit.columns[IMPACTS].values.size for fit in impacts), default=10)
    restitution.predicted("theory", [1, last], [theory, theory])
    motions = [fit for fit in run.fits if IMPACTS not in fit.columns]
    return restitution, motion.fit(motions[-1]) if motions else motion
