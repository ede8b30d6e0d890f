"""CVODE of SUNDIALS on the standard case, through scikit-sundae, with its own root finding.

A multistep method starts anew, at order 1, after every impact. The equations are ours: what is compared is the
integrator. The root at the start of a phase is divided out of the event.
"""

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.comparators.case import DURATION, SPECIMEN, START, drive

Vector = NDArray[np.float64]


class CvodePeer:
    """The standard case at one relative tolerance; the absolute one is a hundredth of it."""

    def __init__(self, tolerance: float) -> None:
        from bench.comparators.kernel.fixed_step import driven_rates

        self._p, self._row = SPECIMEN.packed(), drive().packed()[0]
        self._sg, self._start = 1.0, 0.0

        def rates(t: float, y: Vector, out: Vector) -> None:
            # what comes in cannot be written to, and the compiled function takes no such array
            driven_rates(self._p, self._sg, self._row, t, y.copy(), out)

        def impact(t: float, y: Vector, out: Vector) -> None:
            out[0] = self._sg * y[4] / (t - self._start) if t > self._start else 1.0

        impact.terminal = [True]  # pyright: ignore[reportFunctionMemberAccess]  # scikit-sundae's way to say it
        impact.direction = [-1]  # pyright: ignore[reportFunctionMemberAccess]
        solver = import_module("sksundae.cvode").CVODE
        self._solver: Any = solver(
            rates,
            method="Adams",
            rtol=tolerance,
            atol=0.01 * tolerance,
            eventsfn=impact,
            num_events=1,
            max_num_steps=100_000,
        )

    def run(self) -> tuple[Vector, int]:
        """End state, shape (6,), and the number of impacts."""
        x, t, impacts, self._sg = START.as_array(), 0.0, 0, 1.0
        while t < DURATION:
            self._start = t
            self._solver.init_step(t, x)
            found: Any = self._solver.step(DURATION, method="normal", tstop=DURATION)
            t, x = float(np.ravel(found.t)[-1]), np.array(np.atleast_2d(found.y)[-1], dtype=np.float64)
            if t < DURATION:
                impacts += 1
                x[4], x[5] = 0.0, x[5] * SPECIMEN.block.restitution
                self._sg = -self._sg
        return x, impacts
