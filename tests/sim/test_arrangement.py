"""What is clamped, held and let go on the virtual bench, against closed forms and linear algebra."""

from dataclasses import replace
from itertools import pairwise
from math import asin, atan, cos, hypot, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import signal
from scipy.special import ellipk, ellipkinc

from sim.arrangement import Arrangement
from sim.block_face import rotation
from sim.errors import InvalidInput
from sim.sensors import Laser
from sim.specimen import Block, Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters

Array = NDArray[np.float64]

RATE = 2000.0
ALONE = Arrangement(Specimen(beta=0.0), table_locked=True, watched=0.35)
LINEAR = {"laser_1": Laser(linearity=0.0), "laser_2": Laser(linearity=0.0)}


def bench_with(arrangement: Arrangement, seed: int = 1, **parts: object) -> VirtualBench:
    """Armed with the arrangement mounted."""
    bench = VirtualBench(VirtualBenchParameters.model_validate(parts), arrangement.specimen, seed)
    bench.mount(arrangement)
    bench.arm()
    return bench


def released(theta: Array) -> int:
    """The tick at which the hand let go: the last of those at which nothing has moved."""
    return int(np.flatnonzero(theta == theta[0])[-1])


def quarter(theta: float, block: Block, g: float) -> float:
    """Time [s] from rest at `theta` to the ground: T / 4 of the exact period, by elliptic integrals."""
    size, alpha = hypot(block.b, block.h_b), atan(block.b / block.h_b)
    modulus = cos(0.5 * (alpha - theta)) ** 2
    lower = asin(cos(0.5 * alpha) / sqrt(modulus))
    return float(ellipk(modulus) - ellipkinc(lower, modulus)) / sqrt(0.75 * g / size)


def decayed(first: float, count: int, block: Block) -> Array:
    """Amplitudes [rad] from the first on: cos(alpha - |theta|) - cos(alpha) falls by r^2 at every impact."""
    alpha = atan(block.b / block.h_b)
    share = block.restitution ** (2.0 * np.arange(count))
    return alpha - np.arccos(cos(alpha) + share * (cos(alpha - first) - cos(alpha)))


def matrices(specimen: Specimen) -> tuple[Array, Array, Array]:
    """M, C, K of the frame, the spring grounded; the dashpots give the bare frame's modes their damping ratios."""
    f = specimen.frame
    mass = np.diag([f.m1, f.m2])
    stiffness = np.array([[f.k1 + f.k2, -f.k2], [-f.k2, f.k2]])
    root = np.diag(np.diag(mass) ** -0.5)
    squares, modes = np.linalg.eigh(root @ stiffness @ root)
    shapes = root @ modes
    lower, upper = np.diag([1.0, 0.0]), np.array([[1.0, -1.0], [-1.0, 1.0]])
    shares = np.column_stack([np.diag(shapes.T @ c @ shapes) for c in (lower, upper)])
    c1, c2 = np.linalg.solve(shares, 2.0 * np.array([f.xi1, f.xi2]) * np.sqrt(squares))
    return mass, c1 * lower + c2 * upper, stiffness + np.diag([specimen.k_c, 0.0])


def first_order(specimen: Specimen) -> Array:
    """The frame's matrix for [u1, u2, v1, v2]."""
    mass, damping, stiffness = matrices(specimen)
    inverse = np.linalg.inv(mass)
    return np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ stiffness, -inverse @ damping]])


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_tilted_block_rocks_as_on_fixed_ground(side: float) -> None:
    """Every impact and every amplitude, until they have decayed to a fifth."""
    bench, block = bench_with(replace(ALONE, tilt=0.09 * side), **LINEAR), Specimen().block
    counts = bench.run(np.zeros(16 * int(RATE)))
    theta, omega = side * bench.truth.theta, side * bench.truth.omega
    start = released(theta)
    assert 3.0 * RATE <= start <= 5.0 * RATE
    assert theta[0] == 0.09
    amplitudes = decayed(0.09, 40, block)
    amplitudes = amplitudes[amplitudes > 0.018]
    assert amplitudes.size > 15
    quarters = np.array([quarter(float(a), block, 9.81) for a in amplitudes])
    impacts = quarters[0] + np.concatenate([[0.0], np.cumsum(2.0 * quarters[1:])])

    before = np.flatnonzero(np.diff(np.sign(theta)) != 0)[: impacts.size]
    # from the tick before the impact at the angular acceleration of the upright block
    pull = 0.75 * 9.81 / hypot(block.b, block.h_b) * block.b / hypot(block.b, block.h_b)
    angle, speed = np.abs(theta[before]), np.abs(omega[before])
    crossings = (before - start) / RATE + 2.0 * angle / (speed + np.sqrt(speed**2 + 2.0 * pull * angle))
    np.testing.assert_allclose(crossings, impacts, atol=1e-7)

    channel = bench.channels[3]
    seen = side * rotation(channel.to_unit(counts[:, 3]), 0.35, block)
    for n, (begin, end) in enumerate(pairwise(before), start=1):
        sign = 1.0 if n % 2 == 0 else -1.0
        # between two ticks a peak is missed by theta'' / 8 f^2 = 1.4e-7 rad at most
        assert (sign * theta[begin:end]).max() == pytest.approx(amplitudes[n], abs=2e-7)
        # 25 um from steps of the laser's output, as much from noise and converter, over the 350 mm of the beam
        assert (sign * seen[begin : end + 15]).max() == pytest.approx(amplitudes[n], abs=1.5e-4)


def test_it_comes_to_rest_and_was_never_fallen() -> None:
    bench = bench_with(replace(ALONE, tilt=0.1))
    for _ in range(60):
        bench.run(np.zeros(int(RATE)))
        assert not bench.fallen
    assert not bench.arrangement.held
    assert np.abs(bench.truth.theta).max() == 0.0
    assert np.abs(bench.truth.x).max() == 0.0


def test_a_locked_table_does_not_move_whatever_the_amplifier_pushes() -> None:
    bench = bench_with(Arrangement(Specimen(beta=0.64), table_locked=True))
    counts = bench.run(np.concatenate([np.full(1000, 10.0), np.full(1000, -10.0)]))
    for motion in (bench.truth.x, bench.truth.v, bench.truth.a, bench.truth.u2, bench.truth.theta):
        assert np.abs(motion).max() == 0.0
    assert np.ptp(bench.channels[0].to_unit(counts[:, 0])) < 1e-4
    bench.mount(Arrangement(Specimen()))
    bench.run(np.full(1000, 1.0))
    assert np.abs(bench.truth.x).max() > 1e-3


def test_locking_puts_the_table_to_mid_stroke() -> None:
    bench = bench_with(Arrangement(Specimen()))
    bench.run(np.full(1000, 1.0))
    bench.mount(Arrangement(Specimen(), table_locked=True))
    bench.run(np.zeros(100))
    assert np.abs(bench.truth.x).max() == 0.0


@pytest.mark.parametrize(
    "arrangement",
    [
        Arrangement(Specimen(), table_locked=True, pull=0.02),
        Arrangement(Specimen(beta=0.64), table_locked=True, block_clamped=True, pull=-0.03),
    ],
)
def test_a_pulled_frame_swings_as_its_modes_say(arrangement: Arrangement) -> None:
    bench = bench_with(arrangement)
    bench.run(np.zeros(8 * int(RATE)))
    truth = bench.truth
    seen = np.column_stack([truth.u1, truth.u2, truth.v1, truth.v2])
    start = released(truth.u2)
    assert 3.0 * RATE <= start <= 5.0 * RATE
    _, _, stiffness = matrices(arrangement.specimen)
    held = np.linalg.solve(stiffness, [0.0, 1.0])
    np.testing.assert_allclose(
        seen[: start + 1, :2], arrangement.pull * np.tile(held / held[1], (start + 1, 1)), atol=1e-15
    )
    values, vectors = np.linalg.eig(first_order(arrangement.specimen))
    shares = np.linalg.solve(vectors, seen[start])
    t = np.arange(seen.shape[0] - start) / RATE
    expected = (np.exp(np.outer(t, values)) * shares @ vectors.T).real
    assert np.abs(expected[-1, 1]) < 0.99 * np.abs(arrangement.pull)
    np.testing.assert_allclose(seen[start:], expected, atol=1e-9)


def test_a_clamped_block_stays_down_and_its_spring_is_grounded() -> None:
    """A drive that topples a free block; storeys against the linear frame under the true table motion."""
    specimen = Specimen(beta=0.64)
    drive = 8.0 * np.sin(9.0 * np.arange(8000) / RATE)
    free, bench = bench_with(Arrangement(specimen)), bench_with(Arrangement(specimen, block_clamped=True))
    free.run(drive)
    assert free.fallen
    bench.run(drive)
    truth = bench.truth
    assert not bench.fallen
    assert np.abs(truth.theta).max() == 0.0
    assert np.abs(truth.u1).max() > 0.02
    # the storeys' absolute displacements under the table's displacement and velocity, which need no acceleration of it
    system = first_order(specimen)
    driven = -system @ np.kron(np.eye(2), np.ones((2, 1)))
    driven[:2] = 0.0
    table, t = np.column_stack([truth.x, truth.v]), np.arange(drive.size) / RATE
    _, expected, _ = signal.lsim((system, driven, np.eye(4), np.zeros((4, 2))), table, t)
    # straight lines between ticks leave a / 8 f^2 of the table's curve: 3e-7 m at 10 m/s2
    np.testing.assert_allclose([truth.u1 + truth.x, truth.u2 + truth.x], expected[:, :2].T, atol=5e-7)


def test_the_clamped_block_rides_on_the_table() -> None:
    """In its first half millisecond the coil moves m_t + M alone: the storeys' dashpots pull 1e-5 as much."""
    specimen = Specimen(beta=0.5)
    bench = bench_with(
        Arrangement(specimen, block_clamped=True), shaker={"force_noise": 0.0, "friction": 0.0, "c_s": 0.0}
    )
    bench.run(np.full(3, 1.0))
    shaker = bench.parameters.shaker
    total = shaker.moving_mass + specimen.block.mass
    rate = shaker.electric_damping / total
    t = 1.0 / RATE
    expected = shaker.force_per_volt / shaker.electric_damping * -np.expm1(-rate * t)
    assert bench.truth.v[1] == pytest.approx(expected, rel=1e-4)


HELD = [
    replace(ALONE, tilt=-0.08),
    Arrangement(Specimen(beta=0.64), pull=0.02),
    Arrangement(Specimen(beta=0.0), watched=0.3, tilt=0.05, pull=0.01),
]


@settings(max_examples=8, deadline=None)
@given(st.sampled_from(HELD), st.lists(st.integers(1, 900), min_size=5, max_size=12), st.integers(1, 3))
def test_counts_do_not_depend_on_how_a_release_is_cut(held: Arrangement, blocks: list[int], seed: int) -> None:
    """From 3 s, the earliest, to 5 s, the latest, in blocks and as a whole."""
    whole, cut = bench_with(held, seed), bench_with(held, seed)
    for bench in (whole, cut):
        bench.run(np.zeros(int(3.0 * RATE)))
        assert bench.arrangement.held
    volts = 0.2 * np.sin(0.02 * np.arange(2 * int(RATE) + 1))
    expected, start = whole.run(volts), 0
    while start < volts.size:
        for n in blocks:
            np.testing.assert_array_equal(cut.run(volts[start : start + n]), expected[start : start + n])
            start += n
    assert not whole.arrangement.held
    assert not cut.arrangement.held


def test_a_seed_says_when_the_hand_lets_go() -> None:
    one, same, other = (bench_with(HELD[0], seed) for seed in (5, 5, 6))
    played = [bench.run(np.zeros(6 * int(RATE))) for bench in (one, same, other)]
    np.testing.assert_array_equal(played[0], played[1])
    assert released(one.truth.theta) != released(other.truth.theta)


def test_a_hand_holds_on_while_the_rig_is_not_armed() -> None:
    bench = bench_with(HELD[0])
    bench.run(np.zeros(int(2.9 * RATE)))
    bench.disarm()
    bench.coast(10.0)
    assert (bench.truth.theta == -0.08).all()
    bench.arm()
    bench.run(np.zeros(int(2.9 * RATE)))
    assert (bench.truth.theta == -0.08).all()
    bench.run(np.zeros(int(2.2 * RATE)))
    assert not bench.arrangement.held


def test_laser_2_has_no_target_where_there_is_no_block() -> None:
    bench = bench_with(Arrangement(Specimen(), watched=0.3))
    low, high = bench.channels[3].valid
    counts = bench.run(np.zeros(2000))[:, 3]
    assert ((counts < low) | (counts > high)).all()


def test_a_block_is_not_held_beyond_its_catch() -> None:
    bench = bench_with(ALONE, catch_angle=0.06)
    with pytest.raises(InvalidInput, match=r"tilt.*catch"):
        bench.mount(replace(ALONE, tilt=0.07))
    assert bench.arrangement == ALONE
