"""heyoka on the standard case (Biscani and Izzo, 2021): Taylor series compiled by LLVM, from its own expressions.

The equations are written down here once more on purpose: an independent reference must not share ours. One system
serves both corners, with the sign of the corner as a parameter that the impact changes.

The event is sg theta, falling. With theta itself as the event the start of the case, which lies on theta = 0, counts
as an impact and turns the block to the wrong corner: it falls over. sg theta rises from every impact and from the
start, and a rising root is not an event; so no guard time after an impact has to be right either. The impacts of the
case are vigorous: nothing here says how heyoka's guard does in chatter.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.comparators.case import AMPLITUDE, DURATION, OMEGA, PHASE, SPECIMEN, START


@dataclass(frozen=True)
class Outcome:
    """End state, shape (6,), counts, and peaks of |u1|, |u2 - u1|, |theta| when they were watched."""

    end: NDArray[Any]
    impacts: int
    steps: int
    peaks: tuple[Any, Any, Any] | None


class HeyokaPeer:
    """The standard case, compiled when it is made; `extended` is 80-bit arithmetic where the machine has it."""

    def __init__(self, tolerance: float, *, peaks: bool = False, extended: bool = False) -> None:
        hy = import_module("heyoka")
        self._real: Any = np.longdouble if extended else float
        self._impacts = 0
        self._best: list[Any] | None = [self._real(0)] * 3 if peaks else None
        self._restitution = self._real(SPECIMEN.block.restitution)
        theta, corner_sign = hy.make_vars("theta"), hy.par[0]
        falling = hy.event_direction.negative
        kind = {"fp_type": self._real}
        events = [hy.t_event(corner_sign * theta, callback=self._on_impact(), direction=falling, **kind)]
        slopes = (hy.make_vars("v1"), hy.make_vars("v2") - hy.make_vars("v1"), hy.make_vars("omega"))
        watched = [
            hy.nt_event(slope, callback=self._watcher(which), **kind) for which, slope in enumerate(slopes) if peaks
        ]
        self._integrator = hy.taylor_adaptive(
            _equations(hy, self._real),
            state=[self._real(0)] * 6,
            pars=[self._real(1)],
            t_events=events,
            nt_events=watched,
            tol=self._real(tolerance),
            **kind,
        )

    def run(self, duration: float = DURATION) -> Outcome:
        """Integrate the case from its start."""
        ta = self._integrator
        ta.state[:] = START.as_array().astype(self._real)
        ta.pars[0], ta.time = self._real(1), self._real(0)
        ta.reset_cooldowns()
        self._impacts = 0
        if self._best is not None:
            u1, u2, theta = START.u1, START.u2, START.theta
            self._best = [abs(self._real(value)) for value in (u1, u2 - u1, theta)]
        steps = ta.propagate_until(self._real(duration))[3]
        peaks = None if self._best is None else (self._best[0], self._best[1], self._best[2])
        return Outcome(np.array(ta.state), self._impacts, int(steps), peaks)

    def _on_impact(self) -> Any:
        # a function, not a method: heyoka copies its callbacks with all that they are bound to
        def strike(ta: Any, _sign: int) -> bool:
            self._impacts += 1
            ta.state[4] = self._real(0)
            ta.state[5] *= self._restitution
            ta.pars[0] = -ta.pars[0]
            return True

        return strike

    def _watcher(self, which: int) -> Any:
        def watch(ta: Any, time: Any, _sign: int) -> None:
            ta.update_d_output(time)
            u1, u2, theta = ta.d_output[0], ta.d_output[1], ta.d_output[4]
            best = self._best
            if best is not None:
                best[which] = max(best[which], abs((u1, u2 - u1, theta)[which]))

        return watch


def _equations(hy: Any, real: Any) -> list[tuple[Any, Any]]:
    """Eq. (8) and (A.1) in the form that does not cancel at small angles."""
    m1, m2, k1, k2, c1, c2, h1, k_c, d, b, h_b, mass, inertia, _, g, _ = (real(v) for v in SPECIMEN.packed()[:16])
    u1, u2, v1, v2, theta, omega = hy.make_vars("u1", "u2", "v1", "v2", "theta", "omega")
    sg = hy.par[0]
    base = real(AMPLITUDE) * hy.sin(real(OMEGA) * hy.time + real(PHASE))
    s, c, half = hy.sin(theta), hy.cos(theta), hy.sin(real(0.5) * theta)
    versine = real(2) * half * half
    corner = b * (real(1) - sg)
    excess = corner * versine - h1 * s - u1
    dx, dy = d + excess, -h1 * versine - corner * s
    length = hy.sqrt(dx * dx + dy * dy)
    q = (real(2) * d * excess + excess * excess + dy * dy) / (length * (length + d))
    arm = ((corner + d) * corner + h1 * h1) * s - h1 * d * c + u1 * (h1 * c - corner * s)
    turning = mass * (g * (h_b * s - sg * b * c) + base * (h_b * c + sg * b * s)) - k_c * q * arm
    return [
        (u1, v1),
        (u2, v2),
        (v1, (-(c1 + c2) * v1 + c2 * v2 - (k1 + k2) * u1 + k2 * u2 + k_c * q * dx) / m1 - base),
        (v2, (c2 * (v1 - v2) + k2 * (u1 - u2)) / m2 - base),
        (theta, omega),
        (omega, turning / inertia),
    ]
