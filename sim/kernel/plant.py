"""Table and specimen as one mechanical system: time derivative of its state in every contact mode.

The state consists of y = [x, v, u1, u2, v1, v2, theta, omega], with x, v of the table and u, v relative to it, and of a
contact mode. The specimen acts back on the table: the horizontal momentum of all moving parts gives

    m_t a + m1 (a + u1'') + m2 (a + u2'') + M x_C'' = F,    x_C'' = a - G theta'' + omega^2 (h_b s - sg b c)

with s, c = sin, cos(theta), sg = +1 about corner A and -1 about B, and the lever G = h_b c + sg b s. The storeys'
equations give m_i (a + u_i'') without a, and J theta'' = T + M G a is linear in a, so that a follows in closed form.
Storeys, spring and block follow Eqs. (8) and (A.1) of the paper, where dx and dy are the components of the spring, and
B2 = 0 about A, 2b about B; 1 - cos and the elongation of the spring are computed without cancellation.
"""
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false
# numba has no type annotations.

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from sim.kernel.compiled import FLOAT, INT, ROW, VOID, compiled

Array = NDArray[np.float64]

REST, ROCK_A, ROCK_B, FALLEN = 0, 1, 2, 3
"""Contact modes: at rest, rocking about A (theta > 0), rocking about B (theta < 0), held by the catch."""

SATURATED = 40.0
"""Argument from which the exponential of the friction, exp(40), is too large to change the result."""

STATES = 8
"""Number of values in the state."""


class Plant(NamedTuple):
    """Constants of the moving system in SI units; `mass` is 0 without a block that can rock, `k_c` without a spring."""

    m1: float
    m2: float
    k1: float
    k2: float
    c1: float
    c2: float
    h1: float
    k_c: float
    d: float
    b: float
    h_b: float
    mass: float
    inertia: float
    restitution: float
    g: float
    catch_angle: float
    moving_mass: float
    k_s: float
    c_s: float
    friction: float
    friction_velocity: float
    half_stroke: float
    stop_stiffness: float
    stop_damping: float
    bl: float
    resistance: float
    holds_current: float
    voltage_limit: float
    current_limit: float
    lag: float


PLANT: Any = types.NamedUniTuple(FLOAT, len(Plant._fields), Plant)


@compiled(FLOAT(FLOAT, FLOAT, FLOAT, PLANT), internal=True)
def table_force(x: float, v: float, request: float, p: Plant) -> float:
    """Force [N] of coil, suspension, friction and end stops on the table.

    `request` is the coil voltage [V] commanded by the amplifier, or the current [A] if `holds_current`. In both cases,
    the coil voltage R i + Bl v and the current are kept within the amplifier's limits.
    """
    current = request if p.holds_current > 0.0 else (request - p.bl * v) / p.resistance
    back_emf = p.bl * v
    current = max(current, (-p.voltage_limit - back_emf) / p.resistance)
    current = min(current, (p.voltage_limit - back_emf) / p.resistance)
    current = min(max(current, -p.current_limit), p.current_limit)
    relative = 2.0 * v / p.friction_velocity
    if abs(relative) < SATURATED:
        # tanh from one exponential: twice as fast as the library function, and accurate to rounding
        friction = p.friction * (1.0 - 2.0 / (math.exp(relative) + 1.0))
    else:
        friction = math.copysign(p.friction, v)
    force = p.bl * current - p.k_s * x - p.c_s * v - friction
    over = abs(x) - p.half_stroke
    if over > 0.0:
        side = math.copysign(1.0, x)
        force -= side * p.stop_stiffness * over * max(0.0, 1.0 + p.stop_damping * side * v)
    return force


@compiled(VOID(INT, ROW, FLOAT, FLOAT, PLANT, ROW), internal=True)
def rates(mode: int, y: Array, request: float, noise: float, p: Plant, dy: Array) -> None:
    """Write the time derivative of the state `y`, shape (8,), into `dy`; dy[1] is the table's acceleration.

    `noise` is a force on the table [N]. In REST the spring is linear and the block's mass is added to the table.
    """
    u1, u2, v1, v2, theta, omega = y[2], y[3], y[4], y[5], y[6], y[7]
    sg = 1.0
    s, c, q, dx, dy_spring, corner = 0.0, 1.0, 0.0, 0.0, 0.0, 0.0
    if mode == REST:
        push = -p.k_c * u1
    else:
        half = math.sin(0.5 * theta)
        s, c, versine = 2.0 * half * math.cos(0.5 * theta), 1.0 - 2.0 * half * half, 2.0 * half * half
        if mode == ROCK_B or (mode == FALLEN and theta < 0.0):
            sg, corner = -1.0, 2.0 * p.b
        change = corner * versine - p.h1 * s - u1
        dx, dy_spring = p.d + change, -p.h1 * versine - corner * s
        length = math.sqrt(dx * dx + dy_spring * dy_spring)
        q = (change * (2.0 * p.d + change) + dy_spring * dy_spring) / (length * (length + p.d))
        push = p.k_c * q * dx
    storey1 = -(p.c1 + p.c2) * v1 + p.c2 * v2 - (p.k1 + p.k2) * u1 + p.k2 * u2 + push
    storey2 = p.c2 * (v1 - v2) + p.k2 * (u1 - u2)
    force = table_force(y[0], y[1], request, p) + noise - storey1 - storey2
    if mode in (ROCK_A, ROCK_B):
        lever = p.h_b * c + sg * p.b * s
        torque = p.mass * p.g * (p.h_b * s - sg * p.b * c)
        torque -= p.k_c * q * (dx * (corner * s - p.h1 * c) - dy_spring * (p.h1 * s + corner * c))
        force += p.mass * (lever * torque / p.inertia + omega * omega * (sg * p.b * c - p.h_b * s))
        a = force / (p.moving_mass + p.mass - (p.mass * lever) ** 2 / p.inertia)
        dy[6], dy[7] = omega, (torque + p.mass * lever * a) / p.inertia
    else:
        a = force / (p.moving_mass + p.mass)
        dy[6], dy[7] = 0.0, 0.0
    dy[0], dy[1], dy[2], dy[3] = y[1], a, v1, v2
    dy[4], dy[5] = storey1 / p.m1 - a, storey2 / p.m2 - a


@compiled(FLOAT(ROW, ROW, PLANT), internal=True)
def overturning_moment(y: Array, dy: Array, p: Plant) -> float:
    """h_b M a - k_c h1 u1 [N m] of the resting block, which lifts when the magnitude exceeds b g M (Eqs. 9, A.3)."""
    return p.h_b * p.mass * dy[1] - p.k_c * p.h1 * y[2]


@compiled(FLOAT(PLANT), internal=True)
def restitution_on_table(p: Plant) -> float:
    """Ratio of the angular velocities after and before an impact on a table that can move.

    From Housner's balance of angular momentum about the new corner, with the horizontal momentum shared by the table:
    (J - mu) omega+ = (r J - mu) omega-, mu = (M h_b)^2 / (m_t + M). The ratio r on fixed ground is the limit for a
    heavy table. A light table takes up momentum at the impact; the control of its drive restores this momentum later.
    """
    give = (p.mass * p.h_b) ** 2 / (p.moving_mass + p.mass)
    return (p.restitution * p.inertia - give) / (p.inertia - give)


@compiled(VOID(ROW, FLOAT, PLANT), internal=True)
def turn(y: Array, omega: float, p: Plant) -> None:
    """Change the block's angular velocity to `omega` instantaneously; the table takes the horizontal impulse.

    m_t v + M (v - G omega) is conserved, with the lever G of the module's docstring. The columns transmit no impulse,
    so that the storeys keep their absolute velocities.
    """
    lever = p.h_b * math.cos(y[6]) + math.copysign(p.b, y[6]) * math.sin(y[6])
    jump = p.mass * lever * (omega - y[7]) / (p.moving_mass + p.mass)
    y[1] += jump
    y[4] -= jump
    y[5] -= jump
    y[7] = omega
