"""Stabiliser of an unstable periodic motion: corrections of the drive's fundamental, once per cycle.

The state of the cycle map (`sim.cycle_map`) is estimated by a Kalman filter and fed back by a linear-quadratic
regulator. The orbit is not an input of the filter, which also estimates the Fourier coefficients y* of the periodic
motion, as a random walk with steps that are large compared with the noise. The stabiliser therefore reacts only to
differences between cycles: any motion that repeats is taken for the orbit and receives no control, however large the
error of the model.

A correction computed from cycle n takes effect at the beginning of cycle n + 2, because cycle n + 1 has already begun
when it is computed.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bench.analysis.cycles import Cycle
from bench.analysis.signals import DRIFT, U1
from sim.cycle_map import CycleMap, coefficients

Array = NDArray[np.float64]

DELAY = 2
"""Number of cycles from a measured cycle to the cycle in which the resulting correction begins."""

BLEND = 0.5
"""Fraction of a cycle over which a correction is blended in. A full cycle would weaken it by 20 to 30 %, since
successive corrections have nearly opposite signs.
"""

COST = 100.0
"""Cost of control (squared shares) relative to that of squared deviations of y from y*: with a low cost, every
deviation saturates the control and fewer motions are captured; with a high cost, the capture takes longer.
"""

READING, DISTURBANCE, WANDER = 3e-6, 1e-3, 1e-2
"""Standard deviations assumed by the filter: of a measured coefficient [m], of the disturbance of a state per cycle,
relative to the state's scale, and of the change of y* per cycle, relative to the norm of y*.
"""


def observed(cycle: Cycle, turn: complex) -> Array:
    """The vector y of a measured cycle; `turn` is the result of `bench.control.sine.Sine.turn`."""
    by = turn ** np.arange(1, cycle.harmonics(U1).size + 1)
    return coefficients(cycle.harmonics(U1) / by, cycle.harmonics(DRIFT) / by)


@dataclass(frozen=True, eq=False)
class StabiliserDesign:
    """Gains of a stabiliser for the orbit of `cycle_map`: `regulator`, shape (2, n + 2), and `filter`, shape
    (n + m, m), for n states and m coefficients.
    """

    cycle_map: CycleMap
    regulator: Array
    filter: Array

    @staticmethod
    def of(cycle_map: CycleMap) -> "StabiliserDesign":
        """Design from the solutions of two Riccati equations. Raises numpy.linalg.LinAlgError or ValueError if no
        control stabilises the orbit.
        """
        return StabiliserDesign(cycle_map, _regulator(cycle_map), _filter(cycle_map))


class Stabiliser:
    """Control of each cycle from the measured cycles: a complex share with a magnitude of at most `authority`."""

    def __init__(self, design: StabiliserDesign, authority: float) -> None:
        self._map, self._authority = design.cycle_map, authority
        self._regulator, self._filter = design.regulator, design.filter
        n, m = self._map.transition.shape[0], self._map.orbit.size
        self._state, self._orbit = np.zeros(n), np.zeros(m)
        self._begun = False
        # controls of three cycles: the one before the cycle measured next, the cycle measured next, and the one after
        # it
        self._before, self._now, self._next = np.zeros(2), np.zeros(2), np.zeros(2)

    @property
    def cycle_map(self) -> CycleMap:
        """The map for which the gains were designed."""
        return self._map

    @property
    def phase(self) -> float:
        """Phase of the base's sine at which the cycles begin [rad]."""
        return self._map.phase

    @property
    def deviation(self) -> float:
        """Norm of the estimated deviation of y from its value on the orbit, at the beginning of the next cycle,
        relative to the norm of that value.
        """
        return float(np.linalg.norm(self._map.outputs @ self._state) / np.linalg.norm(self._map.orbit))

    def next(self, y: Array | None) -> complex:
        """Control of the cycle after next, from the coefficients `y` of the cycle just measured; `y` is None for a
        cycle without a measurement.
        """
        moved = self._estimate(y)
        a, (b1, b0) = self._map.transition, self._map.inputs
        ahead = a @ moved + b1 @ self._now + b0 @ self._next
        control = -self._regulator @ np.concatenate((ahead, self._next))
        control *= min(1.0, self._authority / max(float(np.hypot(*control)), 1e-12))
        self._before, self._now, self._next = self._now, self._next, control
        return complex(control[0], control[1])

    def resume(self, measured: Sequence[Array | None], controls: Sequence[Array]) -> None:
        """Estimate the state from cycles that were not controlled by this stabiliser: their `measured` coefficients,
        and their `controls` with one before them and two after them, each of shape (2,).
        """
        for y, *parts in zip(measured, controls, controls[1:], controls[2:], strict=False):
            self._before, self._now, self._next = parts
            self._estimate(y)
        self._before, self._now, self._next = controls[-3:]

    def _estimate(self, y: Array | None) -> Array:
        """Update the estimates from the coefficients `y` of a cycle; returns the state after it."""
        a, (b1, b0), c, (d1, d0) = (
            self._map.transition,
            self._map.inputs,
            self._map.outputs,
            self._map.feedthrough,
        )
        if y is not None and not self._begun:
            self._orbit, self._begun = y - d1 @ self._before - d0 @ self._now, True
        moved = a @ self._state + b1 @ self._before + b0 @ self._now
        if y is not None:
            surprise = y - (self._orbit + c @ self._state + d1 @ self._before + d0 @ self._now)
            correction = self._filter @ surprise
            moved += correction[: moved.size]
            self._orbit = self._orbit + correction[moved.size :]
        self._state = moved
        return moved


def _regulator(found: CycleMap) -> Array:
    """Feedback gain on the deviation and the last control, shape (2, n + 2), from the discrete Riccati equation."""
    from scipy.linalg import solve_discrete_are

    (b1, b0), n = found.inputs, found.transition.shape[0]
    a = np.zeros((n + 2, n + 2))
    a[:n, :n], a[:n, n:] = found.transition, b1
    b = np.concatenate((b0, np.eye(2)))
    weight = 1e-9 * np.eye(n + 2)
    weight[:n, :n] += found.outputs.T @ found.outputs / float(found.orbit @ found.orbit)
    cost = COST * np.eye(2)
    value = np.asarray(solve_discrete_are(a, b, weight, cost), dtype=np.float64)
    gain = np.asarray(np.linalg.solve(cost + b.T @ value @ b, b.T @ value @ a), dtype=np.float64)
    # the solver does not always detect that an equation has no stabilising solution
    if np.abs(np.linalg.eigvals(a - b @ gain)).max() >= 1.0:
        raise np.linalg.LinAlgError("the regulator does not stabilise the orbit")
    return gain


def _filter(found: CycleMap) -> Array:
    """Steady-state gain of the Kalman predictor of the deviation and y*, shape (n + m, m)."""
    from scipy.linalg import block_diag, solve_discrete_are

    n, m = found.transition.shape[0], found.orbit.size
    a = np.asarray(block_diag(found.transition, np.eye(m)), dtype=np.float64)
    c = np.hstack((found.outputs, np.eye(m)))
    wander = WANDER * float(np.linalg.norm(found.orbit))
    disturbance = np.diag(np.concatenate((np.full(n, DISTURBANCE**2), np.full(m, wander**2))))
    reading = READING**2 * np.eye(m)
    covariance = np.asarray(solve_discrete_are(a.T, c.T, disturbance, reading), dtype=np.float64)
    return a @ covariance @ c.T @ np.linalg.inv(c @ covariance @ c.T + reading)


QUIET, CAPTURED = 0.01, 24
"""Largest control of a captured motion, as a share, and number of successive cycles in which it must not be exceeded.
"""

UNLIMITED = 0.1
"""Largest control of a captured motion, as a fraction of the authority; a control that is limited is not small."""

LOST, ROUGH = 6, 0.5
"""A captured motion counts as lost after this number of successive cycles in which the control exceeds this fraction of
the authority.
"""

MISSING = 3
"""Number of successive cycles without a measurement after which the hold ends."""

ANSWER = 0.15
"""Largest difference between the table's fundamental and that expected from the drive, as a share; a phase error of 9
degrees or a gain error of 15 % causes a difference of this size.
"""

CHANGED = 2
"""Number of successive cycles with such a difference after which the hold ends; during the first one the response may
still have been the old one for a time, so that it does not show which part has changed.
"""

GROWTH = 1.5
"""Largest allowed peak of a cycle, relative to the largest peak of the free motion."""


@dataclass
class HoldMonitor:
    """Monitor of a hold: detects the capture of the motion and the reasons to release the hold.

    `omega` [rad/s] is the frequency of the cycles, `patience` the number of cycles within which the motion must be
    captured, `largest` [m] the largest allowed peak drift, and `answer` the table's fundamental before the hold, per
    share of the drive.
    """

    omega: float
    authority: float
    patience: int
    largest: float
    answer: complex
    captured_after: int | None = None
    cycles: int = 0
    _missing: int = 0
    _changed: int = 0
    _controls: deque[float] = field(default_factory=lambda: deque[float](maxlen=CAPTURED))

    def missed(self) -> str | None:
        """Count a cycle without a measurement. Returns the reason to release the hold, if any."""
        self.cycles += 1
        self._missing += 1
        if self._missing >= MISSING:
            return f"{MISSING} successive cycles could not be measured: a sensor may have lost its target"
        return self._late()

    def push(self, control: complex, drift: float, played: complex, achieved: complex) -> str | None:
        """Count a cycle with its `control`, peak `drift` [m], and shares of drive and table. Returns the reason to
        release the hold, if any.
        """
        self.cycles += 1
        self._missing = 0
        self._controls.append(abs(control))
        if drift > self.largest:
            return f"the drift reached {1e3 * drift:.3g} mm, but only {1e3 * self.largest:.3g} mm is allowed"
        expected = self.answer * played
        self._changed = self._changed + 1 if abs(achieved - expected) > ANSWER else 0
        if self._changed == CHANGED:
            return _change(achieved / expected, self.omega)
        controls = list(self._controls)
        if self.captured_after is None:
            if len(controls) == CAPTURED and max(controls) <= min(QUIET, UNLIMITED * self.authority):
                self.captured_after = self.cycles - CAPTURED
        elif min(controls[-LOST:]) > ROUGH * self.authority:
            return "the deviation grew again after the capture"
        return self._late()

    def _late(self) -> str | None:
        if self.captured_after is None and self.cycles >= self.patience:
            return f"the motion was not captured within {self.patience} cycles"
        return None


def _change(ratio: complex, omega: float) -> str:
    """Description of a change of the table's response by the factor `ratio` at `omega` [rad/s]."""
    gain, phase = abs(ratio), float(np.angle(ratio))
    text = (
        f"the table's response to the drive changed: gain by a factor of {gain:.2f}, "
        f"phase by {round(np.degrees(phase)):+d} degrees"
    )
    if phase < -abs(gain - 1.0):
        text += f", like a delay of {-1e3 * phase / omega:.0f} ms"
    return text
