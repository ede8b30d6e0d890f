"""heyoka's batch mode on the standard case: four trajectories in the lanes of one vector, with their own impacts."""

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.comparators.case import DURATION, SPECIMEN, START
from bench.comparators.libraries import equations

BATCH = 4
"""Number of trajectories in a batch: the number of doubles in an AVX2 register."""


class HeyokaBatch:
    """`BATCH` identical trajectories of the standard case, without peaks; compiled on construction."""

    def __init__(self, tolerance: float) -> None:
        hy = import_module("heyoka")
        counts = self._impacts = [0] * BATCH
        restitution = SPECIMEN.block.restitution

        # a function, not a method, because heyoka copies a callback together with the object to which it is bound
        def strike(ta: Any, _sign: int, place: int) -> bool:
            counts[place] += 1
            ta.state[4, place] = 0.0
            ta.state[5, place] *= restitution
            ta.pars[0, place] = -ta.pars[0, place]
            return True

        event = hy.t_event_batch(
            hy.par[0] * hy.make_vars("theta"), callback=strike, direction=hy.event_direction.negative
        )
        self._integrator = hy.taylor_adaptive_batch(
            equations(hy, float),
            np.zeros((6, BATCH)),
            time=[0.0] * BATCH,
            pars=np.ones((1, BATCH)),
            tol=tolerance,
            t_events=[event],
        )

    def run(self) -> tuple[NDArray[np.float64], int]:
        """End state, shape (6,), and number of impacts of the last trajectory."""
        ta = self._integrator
        ta.state[:], ta.pars[:] = START.as_array()[:, None], 1.0
        ta.set_time(0.0)
        ta.reset_cooldowns()
        before = self._impacts[-1]
        ta.propagate_until(DURATION)
        return np.array(ta.state[:, -1]), self._impacts[-1] - before
