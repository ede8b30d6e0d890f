"""Cycle map of an unstable periodic motion, identified from measured cycles under known controls, without a model.

The coefficients y of a cycle (`bench.control.stabiliser.observed`) are reduced to their largest principal components z,
shape (r,). Least squares of each cycle on its predecessor and on the controls of three cycles,

    z_(n+1) = k + A z_n + F0 c_(n+1) + F1 c_n + F2 c_(n-1),

is the cycle map of `sim.cycle_map` with the state x_n = z_n - z* - F0 c_n, M = A, B1 = F2, B0 = F1 + A F0, D1 = 0 and
D0 = F0, where z* = (I - A)^-1 k is the periodic motion. A periodic motion that is unstable, and was never reached, is
therefore found by extrapolation.

The motion is linear only near the periodic one. A cycle at the relative distance d from it has the weight
1 / (1 + (d / NEAR)^2), and the periodic motion and the weights are computed in turn.
"""

from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from bench.control.stabiliser import BLEND, Stabiliser, StabiliserDesign
from sim.cycle_map import CycleMap

Array = NDArray[np.float64]

SECTION = 1.5 * np.pi
"""Phase of the base's sine at which the cycles begin [rad]: the table is then at its greatest displacement, and a
rocking block far from its impacts.
"""

ORDER = 4
"""Number of principal components: those of the two slowest pairs of multipliers. With three, the dominant pair is found
only after a longer time; with six, motions far from the orbit are captured less often.
"""

NEAR = 0.3
"""Distance from the periodic motion, relative to its norm, at which a cycle has half the weight."""

RIDGE = 1e-3
"""Regularisation of the least squares, relative to the weighted number of cycles; all quantities have the scale 1."""

ROUNDS = 6
"""Number of repetitions with new weights."""

FARTHEST = 3.0
"""Largest step of the estimated periodic motion in one round, relative to its norm."""

EXCITATION = 0.03
"""Magnitude of the controls of the first cycles, relative to the amplitude; their phases are pseudo-random."""

EXCITED, REPEATED = 24, 6
"""Number of cycles before the first identification, and between repetitions."""

SETTLED, SMALL = 12, 0.01
"""Number of successive cycles with controls of at most `SMALL`, as a share, after which the identification is no longer
repeated: the cycles then contain little but noise.
"""

RECENT = 25
"""Number of preceding cycles from which the state of a newly designed stabiliser is estimated."""

SEED = 1
"""Random seed of the excitation, so that a run can be repeated bit by bit."""


def identified_map(measured: Array, controls: Array, omega: float) -> CycleMap:
    """Map from successive cycles: `measured` y, shape (n, m) [m], with NaN in the rows of cycles that were lost, and
    the `controls` in effect at their ends, shape (n, 2).

    Raises numpy.linalg.LinAlgError if the cycles do not determine a map.
    """
    known: NDArray[np.bool_] = np.asarray(np.isfinite(measured).all(axis=1), dtype=np.bool_)
    at = np.array([n for n in range(1, len(measured) - 1) if known[n] and known[n + 1]], dtype=np.intp)
    if at.size <= ORDER + 7:
        raise np.linalg.LinAlgError("too few cycles")
    weight, centre = np.ones(len(measured)), measured[known].mean(axis=0)
    scale_c = float(np.sqrt(np.mean(controls**2)))
    inputs = np.hstack([controls[at + shift] for shift in (1, 0, -1)]) / scale_c
    orbit, plane = centre, np.zeros((measured.shape[1], ORDER))
    a, f0, f1, f2 = np.zeros((ORDER, ORDER)), *np.zeros((3, ORDER, 2))
    for _ in range(ROUNDS):
        _, _, axes = np.linalg.svd((measured[known] - centre) * weight[known, None], full_matrices=False)
        plane = np.asarray(axes[:ORDER].T, dtype=np.float64)
        z = np.where(known[:, None], measured - centre, 0.0) @ plane
        scale = np.sqrt(np.average(z[at] ** 2, axis=0, weights=weight[at] ** 2))
        factor = np.minimum(weight[at], weight[at + 1])[:, None]
        rows = factor * np.hstack((z[at] / scale, inputs, np.ones((at.size, 1))))
        ridge = RIDGE * float(np.sum(factor**2)) * np.eye(rows.shape[1])
        ridge[-1, -1] = 0.0
        found = np.linalg.solve(rows.T @ rows + ridge, rows.T @ (factor * z[at + 1] / scale)).T * scale[:, None]
        a = np.asarray(found[:, :ORDER] / scale, dtype=np.float64)
        f0, f1, f2 = (np.asarray(found[:, ORDER + 2 * k :][:, :2] / scale_c, dtype=np.float64) for k in range(3))
        step = plane @ np.linalg.solve(np.eye(ORDER) - a, found[:, -1])
        orbit = np.asarray(centre + step, dtype=np.float64)
        distance = np.linalg.norm(np.where(known[:, None], measured - orbit, np.inf), axis=1)
        weight = 1.0 / (1.0 + (distance / (NEAR * np.linalg.norm(orbit))) ** 2)
        if np.linalg.norm(step) < FARTHEST * np.linalg.norm(centre):
            centre = orbit
    return CycleMap(
        omega=omega,
        phase=SECTION,
        blend=BLEND,
        transition=a,
        inputs=(f2, np.asarray(f1 + a @ f0, dtype=np.float64)),
        outputs=plane,
        feedthrough=(np.zeros((measured.shape[1], 2)), plane @ f0),
        orbit=orbit,
    )


def load_solvers() -> None:
    """Import the solvers of the design, which takes too long to be done while the table is driven."""
    import_module("scipy.linalg")


class IdentifyingStabiliser:
    """Stabiliser whose cycle map is identified from the cycles that it controls (see `Stabiliser`).

    The first controls are pseudo-random. Afterwards the map is identified, and the stabiliser designed, again every
    `REPEATED` cycles until the controls are small: the closer the motion is to the orbit, the better is the map.
    """

    phase = SECTION

    def __init__(self, omega: float, authority: float) -> None:
        """For cycles at `omega` [rad/s]; `authority` is at least `EXCITATION`."""
        self._omega, self._authority = omega, authority
        self._random = np.random.default_rng(SEED)
        self._designed: Stabiliser | None = None
        self._measured = list[Array | None]()
        # controls of all measured cycles and of the one after them, preceded by that before the first one
        self._controls: list[Array] = [np.zeros(2), np.zeros(2), np.zeros(2)]
        self.identified = 0
        """Number of identifications so far."""

    @property
    def cycle_map(self) -> CycleMap | None:
        """The latest identified map; None before the first one."""
        return None if self._designed is None else self._designed.cycle_map

    @property
    def deviation(self) -> float:
        """As `Stabiliser.deviation`; NaN before the first identification."""
        return float("nan") if self._designed is None else self._designed.deviation

    def next(self, y: Array | None) -> complex:
        """Control of the cycle after next, as `Stabiliser.next`."""
        self._measured.append(y)
        count = len(self._measured) - EXCITED
        quiet = all(float(np.linalg.norm(control)) <= SMALL for control in self._controls[-SETTLED:])
        if count >= 0 and count % REPEATED == 0 and not quiet:
            self._identify()
        if self._designed is not None:
            control = self._designed.next(y)
        else:
            control = EXCITATION * 1j ** int(self._random.integers(4))
        self._controls.append(np.array([control.real, control.imag]))
        return control

    def _identify(self) -> None:
        """Replace the stabiliser by one that is designed for the map of all cycles so far; keeps the present one if no
        map is found that can be stabilised.
        """
        lost = np.full(next(y.size for y in self._measured if y is not None), np.nan)
        rows = np.array([lost if y is None else y for y in self._measured])
        try:
            found = identified_map(rows, np.array(self._controls[1:-1]), self._omega)
            designed = Stabiliser(StabiliserDesign.of(found), self._authority)
        except (np.linalg.LinAlgError, ValueError):
            return
        first = max(len(self._measured) - RECENT, 0)
        designed.resume(self._measured[first:-1], self._controls[first:])
        self._designed = designed
        self.identified += 1


Control = Stabiliser | IdentifyingStabiliser
"""A stabiliser, whatever the origin of its map."""
