"""heyoka and CVODE applied to the standard case. heyoka (Biscani and Izzo, 2021) integrates by Taylor series compiled
by LLVM.

The equations for heyoka are deliberately written out here: an independent reference must not share those of this
program. One system covers both corners, with the sign of the corner as a parameter that the impact changes. The event
is a falling root of sg theta. If theta itself were the event, the start of the case at theta = 0 would count as an
impact, so that the block would be on the wrong corner and overturn. sg theta rises from every impact and from the
start, and a rising root is not an event, so that no guard time after an impact is required. The impacts of the case are
strong and do not test heyoka's protection against chatter.

CVODE (SUNDIALS), used through scikit-sundae, has its own root finding. It is a multistep method and restarts at order 1
after every impact. It uses this program's equations, so only the integrators are compared. The root at the start of a
phase is divided out of the event function.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.comparators.case import AMPLITUDE, DURATION, OMEGA, PHASE, SPECIMEN, START, drive


@dataclass(frozen=True)
class Outcome:
    """End state, shape (6,), numbers of impacts and steps, and peaks of |u1|, |u2 - u1| and |theta| if requested."""

    end: NDArray[Any]
    impacts: int
    steps: int
    peaks: tuple[Any, Any, Any] | None


class HeyokaPeer:
    """The standard case, compiled on construction; `extended` selects 80-bit arithmetic where available."""

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
            equations(hy, self._real),
            state=[self._real(0)] * 6,
            pars=[self._real(1)],
            t_events=events,
            nt_events=watched,
            tol=self._real(tolerance),
            **kind,
        )

    def run(self, duration: float = DURATION) -> Outcome:
        """Integrate the case from START over `duration` [s]."""
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
        # a function, not a method, because heyoka copies a callback together with the object to which it is bound
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


def equations(hy: Any, real: Any) -> list[tuple[Any, Any]]:
    """Eq. (8) and (A.1) of the paper for heyoka, in a form without cancellation at small angles."""
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


Vector = NDArray[np.float64]


class CvodePeer:
    """CVODE on the standard case with the relative `tolerance`; the absolute tolerance is a hundredth of it."""

    def __init__(self, tolerance: float) -> None:
        from bench.comparators.kernel.fixed_step import driven_rates

        self._p, self._row = SPECIMEN.packed(), drive().packed()[0]
        self._sg, self._start = 1.0, 0.0

        def rates(t: float, y: Vector, out: Vector) -> None:
            # the input is read-only, and the compiled function does not accept read-only arrays
            driven_rates(self._p, self._sg, self._row, t, y.copy(), out)

        def impact(t: float, y: Vector, out: Vector) -> None:
            out[0] = self._sg * y[4] / (t - self._start) if t > self._start else 1.0

        impact.terminal = [True]  # pyright: ignore[reportFunctionMemberAccess]  # scikit-sundae's convention
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
