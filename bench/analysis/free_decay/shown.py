"""What the lasers would show of a frame on a table that moves as it was measured to move, and how that depends on what.

    laser_i = G_i z_i(t - tau_i) + o_i + sum_k a_ik (z_i / R_i)^k,    i = 1, 2

z is the response to the table's displacement from a free initial state (`response`). Gain, delay, offset and the smooth
bend of each laser are nuisance: they are fitted along, so that no scale, latency or curvature of a laser reaches the
stiffness.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.analysis.free_decay.response import Constants, Response, response
from bench.analysis.free_decay.stretch import Stretch

Array = NDArray[np.float64]

BEND = (2, 3, 4, 5)
"""Powers of the bend of a laser's characteristic, from 2 on."""

CONSTANTS, STATE = slice(0, 4), slice(4, 8)
GAINS, DELAYS, OFFSETS = slice(8, 10), slice(10, 12), slice(12, 14)
BENDS = slice(14, 14 + 2 * len(BEND))
COUNT = BENDS.stop
"""Places in the values: k1, k2, c1, c2 of the frame, its state at the begin, then what belongs to the lasers."""


@dataclass(frozen=True, eq=False)
class Shown:
    """What the lasers would show, as a function of COUNT values. `reach` [m], shape (2,), are the R_i."""

    stretch: Stretch
    masses: tuple[float, float]
    reach: Array

    def parts(self, values: Array) -> tuple[Response, Array, Array]:
        """The response, and (z1, z2) [m] and their velocities, shape (2, n), with the delays in them."""
        found = response(Constants(*self.masses, *values[:4].tolist()), self.stretch.step)
        # one delay for all is one of the table's motion: the initial state is free
        late, rate = self.stretch.driving(float(values[DELAYS][0]))
        q = found.forced(late) + (found.adjoint @ values[STATE])[:, None] * found.free(late.size)
        return found, self._seen(found.storeys(q), late), self._seen(found.velocities(q, late), rate)

    def _seen(self, absolute: Array, table: Array) -> Array:
        return absolute - table if self.stretch.on_table else absolute

    def shown(self, values: Array) -> Array:
        """What the lasers show [m], shape (2, n)."""
        _, z, speed = self.parts(values)
        further = values[DELAYS][1] - values[DELAYS][0]
        z = z - np.array([[0.0], [further]]) * speed
        share = z / self.reach[:, None]
        bent = np.zeros_like(z)
        for term in values[BENDS].reshape(2, len(BEND)).T[::-1]:
            bent = (bent + term[:, None]) * share
        return values[GAINS][:, None] * z + values[OFFSETS][:, None] + bent * share

    def jacobian(self, values: Array) -> Array:
        """Derivatives of `shown`, shape (COUNT, 2, n)."""
        found, z, speed = self.parts(values)
        n = z.shape[1]
        further = values[DELAYS][1] - values[DELAYS][0]
        z = z - np.array([[0.0], [further]]) * speed
        share = z / self.reach[:, None]
        powers = np.cumprod(np.broadcast_to(share, (BEND[-1], 2, n)), axis=0)
        slope = np.tile(values[GAINS][:, None], (1, n))
        for power, term in zip(BEND, values[BENDS].reshape(2, len(BEND)).T, strict=True):
            slope += (power * term / self.reach)[:, None] * powers[power - 2]
        out = np.zeros((COUNT, 2, n))
        for place in (0, 1, 2, 3, DELAYS.start):
            out[place] = self._difference(values, place)
        free = found.free(n)
        for place in range(4):
            q = found.adjoint[:, place, None] * free
            change = found.storeys(q)
            change[1] -= further * found.velocities(q, np.zeros_like(self.stretch.time))[1]
            out[STATE.start + place] = slope * change
        for laser in range(2):
            out[GAINS.start + laser, laser] = z[laser]
            out[OFFSETS.start + laser, laser] = 1.0
            first = BENDS.start + laser * len(BEND)
            out[first : first + len(BEND), laser] = powers[1:, laser]
        out[DELAYS.start + 1, 1] = -slope[1] * speed[1]
        return out

    def _difference(self, values: Array, place: int) -> Array:
        step = np.zeros(COUNT)
        step[place] = 1e-5 * max(abs(values[place]), 1e-3 if place == DELAYS.start else 1e-2)
        return (self.shown(values + step) - self.shown(values - step)) / (2.0 * step[place])
