"""Table and specimen against an independent model: Lagrange's equations of the whole, integrated by scipy."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from sim.arrangement import plant_of
from sim.kernel.plant import FALLEN, REST, ROCK_A, ROCK_B, STATES
from sim.kernel.table import COLUMNS, stream
from sim.shaker import Shaker
from sim.specimen import Block, Frame, Specimen

Array = NDArray[np.float64]

CATCH = 0.35


def play(
    specimen: Specimen,
    shaker: Shaker,
    requests: Array,
    tick: float,
    substeps: int = 1,
    start: Array | None = None,
    mode: int = REST,
) -> tuple[Array, int]:
    """Samples at the ticks and one more after the last, shape (n + 1, 9), and the final mode."""
    state = np.zeros(STATES) if start is None else start.copy()
    requests = np.append(requests, 0.0)
    samples = np.empty((requests.size, COLUMNS))
    held = np.array([requests[0] if start is not None else 0.0, 0.0])
    plant = plant_of(specimen, shaker, CATCH)
    n = requests.size - 1
    mode = stream(plant, tick, substeps, requests[:n], np.zeros(n), mode, state, held, samples[:n])
    samples[n, :STATES], samples[n, STATES] = state, held[1]
    return samples, mode


class Lagrange:
    """q = [x, u1, u2, theta] with T and V as in Eqs. (1) to (5), the table added; V is differentiated numerically.

    The complex step gives the derivatives of V to rounding, so no equation of motion is written down here.
    """

    def __init__(self, specimen: Specimen, shaker: Shaker, request: Callable[[float], float]) -> None:
        self.specimen, self.shaker, self.request = specimen, shaker, request

    def corner(self, mode: int) -> tuple[float, float]:
        """Distance of the pivot from corner A, and of the mass centre from the pivot, along the base."""
        b = self.specimen.block.b
        return (0.0, b) if mode == ROCK_A else (2.0 * b, -b)

    def potential(self, q: Any, mode: int) -> Any:
        f, k, s = self.specimen.frame, self.specimen.block, self.specimen
        pivot, along = self.corner(mode)
        theta = q[3]
        height = along * np.sin(theta) + k.h_b * np.cos(theta)
        # the spring's end on the block lies at (0, h1) from corner A in the upright block
        end_x = pivot - pivot * np.cos(theta) - f.h1 * np.sin(theta)
        end_y = -pivot * np.sin(theta) + f.h1 * np.cos(theta)
        length = np.sqrt((s.d + end_x - q[1]) ** 2 + (end_y - f.h1) ** 2)
        springs = 0.5 * f.k1 * q[1] ** 2 + 0.5 * f.k2 * (q[2] - q[1]) ** 2 + 0.5 * s.k_c * (length - s.d) ** 2
        return k.mass * s.g * height + springs + 0.5 * self.shaker.k_s * q[0] ** 2

    def shaker_force(self, v: float, t: float) -> float:
        """Coil, friction and suspension damping; the suspension's spring is in the potential."""
        p, request = self.shaker, self.request(t)
        coil = request if p.amplifier == "current" else (request - p.bl * v) / p.resistance
        return p.bl * coil - p.c_s * v - p.friction * math.tanh(v / p.friction_velocity)

    def rates(self, t: float, y: Array, mode: int) -> Array:
        """y = [x, u1, u2, theta, and their velocities]."""
        f, k = self.specimen.frame, self.specimen.block
        c1, c2 = f.dashpots
        q, dq = y[:4], y[4:]
        _, along = self.corner(mode)
        theta, omega = q[3], dq[3]
        # Jacobians of the horizontal and vertical positions; only the mass centre's change with q
        to_x = -along * math.sin(theta) - k.h_b * math.cos(theta)
        to_y = along * math.cos(theta) - k.h_b * math.sin(theta)
        masses = [
            (self.shaker.moving_mass, np.array([1.0, 0.0, 0.0, 0.0]), 0.0),
            (f.m1, np.array([1.0, 1.0, 0.0, 0.0]), 0.0),
            (f.m2, np.array([1.0, 0.0, 1.0, 0.0]), 0.0),
            (k.mass, np.array([1.0, 0.0, 0.0, to_x]), -to_y * omega**2),
            (k.mass, np.array([0.0, 0.0, 0.0, to_y]), to_x * omega**2),
            (k.inertia - k.mass * (k.b**2 + k.h_b**2), np.array([0.0, 0.0, 0.0, 1.0]), 0.0),
        ]
        matrix, right = np.zeros((4, 4)), np.zeros(4)
        for mass, jacobian, convective in masses:
            matrix += mass * np.outer(jacobian, jacobian)
            right -= mass * convective * jacobian
        for i in range(4):
            nudged = q.astype(complex)
            nudged[i] += 1e-30j
            right[i] -= self.potential(nudged, mode).imag / 1e-30
        right[0] += self.shaker_force(dq[0], t)
        right[1] -= (c1 + c2) * dq[1] - c2 * dq[2]
        right[2] -= c2 * (dq[2] - dq[1])
        if mode == REST:
            acceleration = np.append(np.linalg.solve(matrix[:3, :3], right[:3]), 0.0)
        else:
            acceleration = np.linalg.solve(matrix, right)
        return np.concatenate([dq, acceleration])

    def moment(self, t: float, y: Array) -> float:
        """Overturning moment of the standing block, of Eq. (9)."""
        s = self.specimen
        return s.block.h_b * s.block.mass * self.rates(t, y, REST)[4] - s.k_c * s.frame.h1 * y[1]

    def integrate(self, y: Array, mode: int, end: float) -> tuple[Array, int, int]:
        """State at `end`, mode, and number of impacts; no coming to rest, no catch."""
        s, t, impacts = self.specimen, 0.0, 0
        resisting = s.block.b * s.g * s.block.mass
        while t < end:
            if mode == REST and abs(moment := self.moment(t, y)) > resisting:
                mode = ROCK_A if moment > 0.0 else ROCK_B
            here = mode

            def event(time: float, state: Array, here: int = here) -> float:
                return state[3] if here != REST else resisting - abs(self.moment(time, state))

            event.terminal = True  # type: ignore[attr-defined]
            event.direction = {REST: -1.0, ROCK_A: -1.0, ROCK_B: 1.0}[here]  # type: ignore[attr-defined]
            run: Any = solve_ivp(
                lambda time, state, here=here: self.rates(time, state, here),
                (t, end),
                y,
                method="DOP853",
                rtol=1e-12,
                atol=1e-14,
                events=event,
            )
            t, y = float(run.t[-1]), run.y[:, -1].copy()
            if t >= end:
                break
            if here == REST:
                mode = ROCK_A if self.moment(t, y) > 0.0 else ROCK_B
                continue
            impacts += 1
            y[3] = 0.0
            mode = ROCK_B if here == ROCK_A else ROCK_A
            y = self.after_impact(y)
        return y, mode, impacts

    def after_impact(self, y: Array) -> Array:
        """Two unknowns v+, omega+: momentum of table and block, and the block's angular momentum about the new corner.

        The loss in the second, 1 - r of J omega, is that of the block on fixed ground.
        """
        k, m_t = self.specimen.block, self.shaker.moving_mass
        swing = k.mass * k.h_b
        balance = np.array([[m_t + k.mass, -swing], [-swing, k.inertia]])
        before = np.array([(m_t + k.mass) * y[4] - swing * y[7], k.restitution * k.inertia * y[7] - swing * y[4]])
        after = y.copy()
        after[4], after[7] = np.linalg.solve(balance, before)
        after[5:7] = y[5:7] + y[4] - after[4]
        return after


def reordered(y: Array) -> Array:
    """[x, u1, u2, theta, velocities] as the kernel orders its state."""
    return y[[0, 4, 1, 2, 5, 6, 3, 7]]


ROCKING_START = np.array([0.004, 0.004, -0.003, 0.012, 0.04, 0.05, -0.05, -0.12])
"""[x, u1, u2, theta, velocities]: about corner A with everything moving."""

VOLTAGE = Shaker(half_stroke=1e3, amplifier_lag=0.0)
CURRENT = Shaker(half_stroke=1e3, amplifier="current", amplifier_lag=0.0, gain=1.0)


@pytest.mark.parametrize("shaker", [VOLTAGE, CURRENT], ids=["voltage", "current"])
@pytest.mark.parametrize("beta", [0.25, 0.97])
def test_rocking_on_the_table_follows_lagrange_through_impacts(shaker: Shaker, beta: float) -> None:
    specimen = Specimen(beta=beta)
    reference = Lagrange(specimen, shaker, lambda _: 1.2)
    expected, mode, impacts = reference.integrate(ROCKING_START, ROCK_A, 0.5)
    samples, reached = play(specimen, shaker, np.full(1000, 1.2), 0.0005, 4, reordered(ROCKING_START), ROCK_A)
    assert impacts >= 3
    assert reached == mode
    np.testing.assert_allclose(samples[-1, :STATES], reordered(expected), rtol=0, atol=1e-8)


def test_uplift_from_rest_and_table_acceleration_follow_lagrange() -> None:
    specimen = Specimen(beta=0.64)
    reference = Lagrange(specimen, CURRENT, lambda _: 1.1)
    start = np.array([0, 0, 0, 0, 0.01, -0.30, -0.20, 0])
    expected, mode, _ = reference.integrate(start, REST, 0.12)
    samples, reached = play(specimen, CURRENT, np.full(240, 1.1), 0.0005, 4, reordered(start))
    assert 10 < np.count_nonzero(samples[:, 6] == 0.0) < 200
    assert (reached, mode) == (ROCK_A, ROCK_A)
    np.testing.assert_allclose(samples[-1, :STATES], reordered(expected), rtol=0, atol=1e-8)
    before, _, _ = reference.integrate(start, REST, 0.1195)
    assert samples[-1, 8] == pytest.approx((expected[4] - before[4]) / 0.0005, abs=1e-7)


def test_a_very_heavy_table_imposes_its_motion_on_the_specimen_of_the_paper() -> None:
    """The table goes as the current says; the specimen then obeys Eqs. (8) and (A.1) under a known a_g."""
    specimen = Specimen(beta=0.40)
    heavy = Shaker(
        moving_mass=1e9, half_stroke=1e3, bl=1e9, k_s=0, c_s=0, friction=0, amplifier="current", amplifier_lag=0, gain=1
    )
    tick, count = 0.005, 260
    requests = 1.6 * np.sin(14.0 * tick * np.arange(count))
    samples, reached = play(specimen, heavy.model_copy(update={"voltage_limit": 1e12}), requests, tick, 10)
    y, mode, impacts = np.zeros(8), REST, 0
    for request in requests:
        y, mode, more = Lagrange(specimen, heavy, lambda _, held=request: held).integrate(y, mode, tick)
        impacts += more
    assert impacts >= 2
    assert reached == mode
    np.testing.assert_allclose(samples[-1, 2:STATES], reordered(y)[2:], rtol=0, atol=1e-7)
    assert samples[-1, 1] == pytest.approx(tick * requests.sum(), abs=1e-7)


@pytest.mark.parametrize("restitution_factor", [1.0, 0.9])
def test_impacts_keep_the_horizontal_momentum_of_everything_that_moves(restitution_factor: float) -> None:
    specimen = Specimen(beta=0.64, block=Block(restitution_factor=restitution_factor))
    free = Shaker(half_stroke=1e3, k_s=0, c_s=0, friction=0, amplifier="current", amplifier_lag=0)
    samples, _ = play(specimen, free, np.zeros(3000), 0.0005, 2, reordered(ROCKING_START), ROCK_A)
    f, k = specimen.frame, specimen.block
    v, v1, v2, theta, omega = samples[:, 1], samples[:, 4], samples[:, 5], samples[:, 6], samples[:, 7]
    assert (np.diff(np.sign(theta)) != 0).sum() >= 8
    lever = k.h_b * np.cos(theta) + np.sign(theta) * k.b * np.sin(theta)
    momentum = free.moving_mass * v + f.m1 * (v + v1) + f.m2 * (v + v2) + k.mass * (v - lever * omega)
    np.testing.assert_allclose(momentum, momentum[0], rtol=0, atol=1e-10)


def test_energy_is_kept_by_an_elastic_rocking_block_on_a_free_undamped_table() -> None:
    elastic = 1.0 / Block().restitution
    specimen = Specimen(beta=0.64, frame=Frame(xi1=0, xi2=0), block=Block(restitution_factor=elastic))
    free = Shaker(half_stroke=1e3, k_s=300, c_s=0, friction=0, amplifier="current", amplifier_lag=0)
    samples, _ = play(specimen, free, np.zeros(4000), 0.0005, 2, reordered(ROCKING_START), ROCK_A)
    f, k = specimen.frame, specimen.block
    lagrange = Lagrange(specimen, free, lambda _: 0.0)
    energies: list[float] = []
    for row in samples[::50]:
        x, v, u1, u2, v1, v2, theta, omega = row[:STATES]
        lever = k.h_b * math.cos(theta) + math.copysign(k.b, theta) * math.sin(theta)
        kinetic = free.moving_mass * v**2 + f.m1 * (v + v1) ** 2 + f.m2 * (v + v2) ** 2 + k.inertia * omega**2
        kinetic += k.mass * (v**2 - 2.0 * lever * v * omega)
        mode = ROCK_A if theta > 0.0 else ROCK_B
        energies.append(0.5 * kinetic + float(lagrange.potential(np.array([x, u1, u2, theta]), mode)))
    assert (np.diff(np.sign(samples[:, 6])) != 0).sum() >= 8
    np.testing.assert_allclose(energies, energies[0], rtol=0, atol=1e-8)


def test_order_four_is_kept_across_impacts() -> None:
    specimen = Specimen(beta=0.64)
    ends = [
        play(specimen, VOLTAGE, np.full(80, 1.2), 0.008, substeps, reordered(ROCKING_START), ROCK_A)[0][-1, :STATES]
        for substeps in (1, 2, 4, 32)
    ]
    errors = [float(np.abs(end - ends[-1]).max()) for end in ends[:-1]]
    slopes = np.diff(np.log2(errors))
    assert (slopes < -3.3).all(), errors


def test_the_step_of_the_bench_is_accurate_to_far_below_a_count() -> None:
    specimen, shaker = Specimen(beta=0.64), Shaker()
    requests = 4.2 * np.sin(16.0 * 0.0005 * np.arange(4000))
    coarse, _ = play(specimen, shaker, requests, 0.0005, 1)
    fine, _ = play(specimen, shaker, requests, 0.0005, 16)
    assert np.abs(fine[:, 6]).max() > 0.01
    assert np.abs(coarse - fine)[:, [0, 2, 3]].max() < 2e-8


def test_a_decaying_block_comes_to_rest_as_bounces_add_up() -> None:
    """Stand-alone block on a standing table: |omega| shrinks by r per impact, a bounce from theta takes 2 T_q(theta).

    Housner (1963): the time from theta to 0 is acosh(1 / (1 - theta/alpha)) / p for a slender block; here the sum
    over the bounces with theta_n from the energy, exact for the small angles of the test.
    """
    specimen = Specimen(beta=0.0)
    heavy = Shaker(moving_mass=1e9, half_stroke=1e3, k_s=0, c_s=0, friction=0, amplifier="current", amplifier_lag=0)
    k, g = specimen.block, specimen.g
    theta = 0.004
    start = np.array([0, 0, 0, 0, 0, 0, theta, 0.0])
    samples, reached = play(specimen, heavy, np.zeros(40_000), 0.0005, 1, start, ROCK_A)
    resting = int(np.argmax(np.abs(samples[:, 6:8]).sum(axis=1) == 0.0)) * 0.0005
    p = math.sqrt(k.mass * g * k.h_b / k.inertia)
    alpha = k.b / k.h_b
    expected, turns = math.acosh(1.0 / (1.0 - theta / alpha)) / p, 0
    while theta > 1e-9:
        energy = (1.0 - (1.0 - theta / alpha) ** 2) * k.restitution**2
        theta = alpha * (1.0 - math.sqrt(1.0 - energy))
        expected += 2.0 * math.acosh(1.0 / (1.0 - theta / alpha)) / p
        turns += 1
    assert turns > 100
    assert reached == REST
    assert resting == pytest.approx(expected, rel=0.02)


def test_a_block_that_topples_hangs_in_the_catch_and_the_table_takes_its_momentum() -> None:
    specimen = Specimen(beta=0.64)
    free = Shaker(half_stroke=1e3, k_s=0, c_s=0, friction=0, amplifier="current", amplifier_lag=0)
    f, k = specimen.frame, specimen.block
    start = np.array([0, 0, 0, 0, 0, 0, -0.1, -2.5])
    samples, reached = play(specimen, free, np.zeros(4000), 0.0005, 1, start, ROCK_B)
    assert reached == FALLEN
    assert (samples[-1000:, 6] == -CATCH).all()
    v, v1, v2, theta, omega = samples[:, 1], samples[:, 4], samples[:, 5], samples[:, 6], samples[:, 7]
    lever = k.h_b * np.cos(theta) + np.sign(theta) * k.b * np.sin(theta)
    momentum = free.moving_mass * v + f.m1 * (v + v1) + f.m2 * (v + v2) + k.mass * (v - lever * omega)
    np.testing.assert_allclose(momentum, momentum[0], rtol=0, atol=1e-9)


def test_the_bare_frame_has_neither_block_nor_spring() -> None:
    """A heavy table accelerated at a constant 1 m/s2: the undamped frame swings about its static drift."""
    frame = Frame(xi1=0, xi2=0)
    heavy = Shaker(
        moving_mass=1e9, half_stroke=1e3, bl=1e9, k_s=0, c_s=0, friction=0, amplifier="current", amplifier_lag=0, gain=1
    )
    heavy = heavy.model_copy(update={"voltage_limit": 1e12})
    samples, reached = play(Specimen(frame=frame), heavy, np.ones(2000), 0.0005, 2)
    masses = np.diag([frame.m1, frame.m2])
    stiffness = np.array([[frame.k1 + frame.k2, -frame.k2], [-frame.k2, frame.k2]])
    static = -np.linalg.solve(stiffness, masses @ np.ones(2))
    squares, modes = np.linalg.eig(np.linalg.solve(masses, stiffness))
    swing = modes @ (np.cos(np.sqrt(squares) * 1.0) * np.linalg.solve(modes, static))
    assert reached == REST
    np.testing.assert_allclose(samples[-1, 2:4], static - swing, rtol=0, atol=1e-8)
