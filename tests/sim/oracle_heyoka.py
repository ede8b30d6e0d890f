"""Independent truth over long times: heyoka's Taylor integrator with its own event detection, at tolerance 1e-15.

The equations are written here by virtual work from the geometry of the spring, for heyoka to differentiate.
heyoka loses an event that lies close behind the start of an integration (an impact leaves theta = 0 there), so each
phase starts with a millisecond without events, in which the block must not come back; that is checked.
"""

from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from sim.specimen import Specimen

BLIND = 1e-3
"""Seconds after an impact that are integrated without events."""


def heyoka_motion(
    specimen: Specimen,
    amplitude: float,
    omega: float,
    phase: float,
    start: NDArray[np.float64],
    duration: float,
    tolerance: float = 1e-15,
) -> tuple[NDArray[np.float64], list[float]]:
    """End state, shape (6,), and times of the impacts under amplitude sin(omega t + phase).

    The block must rock at the start and all along. Raises AssertionError when a phase ends within BLIND.
    """
    integrators: dict[int, tuple[Any, Any]] = {}
    for corner in (1, -1):
        equations, theta = _equations(specimen, corner, amplitude * hy.sin(omega * hy.time + phase))
        towards = hy.event_direction.negative if corner > 0 else hy.event_direction.positive
        blind = hy.taylor_adaptive(equations, [0.0] * 6, tol=tolerance)
        seeing = hy.taylor_adaptive(
            equations, [0.0] * 6, tol=tolerance, t_events=[hy.t_event(theta, direction=towards)]
        )
        integrators[corner] = blind, seeing
    t, x, impacts = 0.0, start.copy(), list[float]()
    corner = int(np.sign(x[4] or x[5]))
    while t < duration:
        blind, seeing = integrators[corner]
        if x[4] == 0.0:
            blind.time, blind.state[:] = t, x
            blind.propagate_until(min(t + BLIND, duration))
            t, x = blind.time, blind.state.copy()
            assert corner * x[4] > 0.0
        seeing.time, seeing.state[:] = t, x
        seeing.reset_cooldowns()
        outcome = seeing.propagate_until(duration)[0]
        t, x = seeing.time, seeing.state.copy()
        if outcome == hy.taylor_outcome.time_limit:
            break
        impacts.append(t)
        x[4], x[5], corner = 0.0, x[5] * specimen.block.restitution, -corner
    return x, impacts


def _equations(specimen: Specimen, corner: int, a_g: Any) -> tuple[list[tuple[Any, Any]], Any]:
    """Equations of motion about one corner, and theta."""
    frame, block, d, k_c = specimen.frame, specimen.block, specimen.d, specimen.k_c
    (c1, c2), h1 = frame.dashpots, frame.h1
    u1, u2, v1, v2, theta, omega = hy.make_vars("u1", "u2", "v1", "v2", "theta", "omega")
    s, c, versine = hy.sin(theta), hy.cos(theta), 2.0 * hy.sin(0.5 * theta) ** 2
    # from the storey to the block: the spring's end on the block turns about the corner
    lever = 0.0 if corner > 0 else 2.0 * block.b
    stretch = lever * versine - h1 * s - u1
    dx, dy = d + stretch, -h1 * versine - lever * s
    length = hy.sqrt(dx * dx + dy * dy)
    tension = k_c * (2.0 * d * stretch + stretch * stretch + dy * dy) / (length + d)
    on_storey = tension * dx / length
    on_block = -tension * (dx * (lever * s - h1 * c) + dy * (-h1 * s - lever * c)) / length
    weight = block.mass * specimen.g * (block.h_b * s - corner * block.b * c)
    push = block.mass * a_g * (block.h_b * c + corner * block.b * s)
    first = on_storey - (c1 + c2) * v1 + c2 * v2 - (frame.k1 + frame.k2) * u1 + frame.k2 * u2
    second = -c2 * (v2 - v1) - frame.k2 * (u2 - u1)
    rates = [v1, v2, first / frame.m1 - a_g, second / frame.m2 - a_g, omega, (weight + push + on_block) / block.inertia]
    return list(zip((u1, u2, v1, v2, theta, omega), rates, strict=True)), theta
