"""Closed forms that are exact for the nonlinear rocking block, and exact limits and symmetries of the model."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sim.excitation import SampledRecord, SineProgram, Sweep
from sim.gain import predict_gain
from sim.kernel import rocking as kernel
from sim.kernel.equations import energy
from sim.rocking import Mode, State, Status, simulate
from sim.specimen import Block, Frame, Specimen
from tests.sim.runs import A_S, kernel_run

mp = pytest.importorskip("mpmath", reason="mpmath is not installed: the exact formulas need its elliptic integrals")

FREE = Specimen(beta=0.0)
DIGITS = 50


def still(duration: float) -> NDArray[np.float64]:
    """A base that does not move."""
    return np.array([[duration, *[0.0] * 9]])


def tilted(theta: float, omega: float = 0.0) -> NDArray[np.float64]:
    return np.array([0.0, 0.0, 0.0, 0.0, theta, omega])


def impact(specimen: Specimen, start: NDArray[np.float64], number: int) -> tuple[float, NDArray[np.float64]]:
    """Time of an impact and the state just after it."""
    x, report, _ = kernel_run(specimen, still(100.0), start, impacts=number, order=24, tolerance=1e-15)
    assert report[kernel.IMPACTS] == number
    return float(report[kernel.END]), x


class Free:
    """The exact free block, to DIGITS digits: alpha, p^2 = M g R / J, and what follows from them.

    mpmath ships no types.
    """

    def __init__(self, specimen: Specimen) -> None:
        mp.mp.dps = DIGITS
        block = specimen.block
        radius = mp.hypot(block.b, block.h_b)
        self.alpha = mp.atan2(block.b, block.h_b)
        self.p = mp.sqrt(mp.mpf(block.mass) * mp.mpf(specimen.g) * radius / mp.mpf(block.inertia))
        self.r = mp.mpf(block.restitution)

    def quarter_period(self, theta: Any) -> Any:
        """From rest at theta to the impact: (1/p) [K(m) - F(psi, m)], with m and psi from the energy integral."""
        m = mp.cos((self.alpha - theta) / 2) ** 2
        psi = mp.asin(mp.cos(self.alpha / 2) / mp.cos((self.alpha - theta) / 2))
        return (mp.ellipk(m) - mp.ellipf(psi, m)) / self.p

    def rise(self, theta: Any, impacts: int) -> Any:
        """Angle after some impacts: cos(alpha - theta_n) = cos alpha + r^2n (cos(alpha - theta_0) - cos alpha)."""
        gap = mp.cos(self.alpha - theta) - mp.cos(self.alpha)
        return self.alpha - mp.acos(mp.cos(self.alpha) + self.r ** (2 * impacts) * gap)


@pytest.mark.parametrize("slenderness", [1.0, 2.0, 8.0, 50.0])
@pytest.mark.parametrize("part", [1e-10, 1e-6, 1e-3, 0.1, 0.5, 0.9, 0.999])
def test_exact_nonlinear_period(slenderness: float, part: float) -> None:
    # measured: 7e-15 at 0.999 alpha, where the fall itself magnifies rounding, and 4e-16 elsewhere
    specimen = Specimen(beta=0.0, block=Block(b=0.2 / slenderness))
    exact = Free(specimen)
    theta = part * float(exact.alpha)
    for side in (1.0, -1.0):
        time, _ = impact(specimen, tilted(side * theta), 1)
        assert time == pytest.approx(float(exact.quarter_period(mp.mpf(theta))), rel=1e-13)


@pytest.mark.parametrize("slenderness", [1.5, 8.0, 30.0])
def test_restitution_is_housners(slenderness: float) -> None:
    specimen = Specimen(beta=0.0, block=Block(b=0.2 / slenderness))
    exact = Free(specimen)
    r = 1 - 3 * mp.sin(exact.alpha) ** 2 / 2
    assert specimen.block.restitution == pytest.approx(float(r), rel=1e-14)
    theta = 0.5 * float(exact.alpha)
    before = exact.p * mp.sqrt(2 * (mp.cos(exact.alpha - mp.mpf(theta)) - mp.cos(exact.alpha)))
    _, after = impact(specimen, tilted(theta), 1)
    assert after[5] == pytest.approx(-float(r * before), rel=1e-13)


def test_restitution_is_not_changed_by_the_elastic_spring() -> None:
    # a short flight just before the impact: the angular velocity jumps by r, the frame's velocities do not
    specimen, start = Specimen(beta=0.97), np.array([0.01, 0.02, 0.3, -0.2, 1e-9, -0.5])
    time, after = impact(specimen, start, 1)
    assert time < 3e-9
    assert after[5] == pytest.approx(-0.5 * specimen.block.restitution, rel=1e-7)
    assert after[:4] == pytest.approx(start[:4], abs=1e-7)


@pytest.mark.parametrize("impacts", [1, 10, 100, 300, 600])
def test_exact_decay(impacts: int) -> None:
    # measured: 3e-13 after 600 impacts, that is half a rounding for each
    exact = Free(FREE)
    _, after = impact(FREE, tilted(0.1), impacts)
    rise = exact.rise(mp.mpf(0.1), impacts)
    past_the_top = SampledRecord(np.zeros(2), float(1.5 * exact.quarter_period(rise)))
    motion = simulate(FREE, past_the_top, state=State.from_array(after), tolerance=1e-14)
    assert motion.impacts == 0
    assert motion.peaks.theta == pytest.approx(float(rise), rel=1e-12)


def test_exact_time_to_rest() -> None:
    # the sum of the exact half periods; measured 7e-15, over 1420 impacts down to a bounce of 1e-30 rad
    theta, exact = 0.1, Free(FREE)
    time, n = exact.quarter_period(mp.mpf(theta)), 0
    while True:
        n += 1
        bounce = exact.rise(mp.mpf(theta), n)
        if bounce < 1e-14:  # from here on a geometric series, to a part in 1e13 of the little that is left
            time += 2 * exact.quarter_period(bounce) / (1 - exact.r)
            break
        time += 2 * exact.quarter_period(bounce)
    options = {"rest_angle": 1e-30, "order": 24, "tolerance": 1e-15}
    _, report, _ = kernel_run(FREE, still(60.0), tilted(theta), **options)
    last = int(report[kernel.IMPACTS])
    x, report, _ = kernel_run(FREE, still(60.0), tilted(theta), impacts=last, **options)
    assert x.tolist() == [0.0] * 6
    assert report[kernel.END] == pytest.approx(float(time), rel=1e-12)


def test_without_restitution_one_half_swing_is_all() -> None:
    dead = Specimen(beta=0.0, block=Block(restitution_factor=0.0))
    time, after = impact(dead, tilted(0.1), 1)
    assert after.tolist() == [0.0] * 6
    assert time == pytest.approx(float(Free(dead).quarter_period(mp.mpf(0.1))), rel=1e-13)
    assert simulate(dead, SampledRecord(np.zeros(2), 9.0), state=State(theta=0.1)).impacts == 1


@pytest.mark.parametrize("beta", [0.0, 0.64, 0.97])
def test_full_restitution_without_damping_keeps_the_energy(beta: float) -> None:
    # measured: 5e-14 after 100 impacts
    block = Block(restitution_factor=1.0 / Block().restitution)
    specimen = Specimen(frame=Frame(xi1=0.0, xi2=0.0), beta=beta, block=block)
    start = np.array([0.005, 0.0, 0.0, 0.05, 0.05, 0.0])
    _, after = impact(specimen, start, 100)
    packed = specimen.packed()
    assert energy(packed, 1.0, after) == pytest.approx(energy(packed, 1.0, start), rel=2e-13)


@pytest.mark.parametrize("omega", [14.0, 16.0, 18.0])
def test_a_spring_that_vanishes_leaves_no_gain(omega: float) -> None:
    gains: list[tuple[float, float]] = []
    for beta in (0.0, 1e-3, 1e-4, 1e-5):
        branch = predict_gain(Specimen(beta=beta), omega, A_S).rocking
        assert branch is not None
        gains.append((branch.alpha_1 - 1.0, branch.alpha_2 - 1.0))
    found = np.abs(gains)
    assert found[0].max() < 1e-12  # measured 1e-13
    assert found[1:-1] / found[2:] == pytest.approx(np.full((2, 2), 10.0), rel=0.05)  # first order in beta


def test_a_block_that_weighs_nothing_leaves_the_frame_alone() -> None:
    # the block follows the first storey and its weight is all that the frame feels: an effect of first order in M
    drive, times = SineProgram([Sweep.dwell(6.0, 1.5 * A_S, 9.0)]), np.linspace(0.0, 6.0, 200)
    bare = simulate(Specimen(), drive, sample_times=times).samples
    assert bare is not None
    left: list[float] = []
    for density in (1.0, 0.1, 0.01):
        motion = simulate(Specimen(beta=0.25, block=Block(rho=density)), drive, sample_times=times)
        assert motion.samples is not None
        assert motion.status is Status.COMPLETED
        left.append(float(np.abs(motion.samples[:, :2] - bare[:, :2]).max() / np.abs(bare[:, :2]).max()))
    assert left[0] / left[1] == pytest.approx(10.0, rel=0.05)
    assert left[1] / left[2] == pytest.approx(10.0, rel=0.05)


def test_a_block_four_times_as_large_takes_twice_as_long() -> None:
    # p goes with the square root of the size: the same angles, on a clock that runs at half the speed
    large = Specimen(beta=0.0, block=Block(b=4.0 * FREE.block.b, h_b=4.0 * FREE.block.h_b))
    for number in (1, 20, 200):
        (time, after), (later, same) = impact(FREE, tilted(0.1), number), impact(large, tilted(0.1), number)
        assert later == pytest.approx(2.0 * time, rel=1e-13)
        assert 2.0 * same[5] == pytest.approx(after[5], rel=1e-12)


def test_a_mirrored_record_gives_the_mirrored_motion_bit_for_bit() -> None:
    # from rest, so that uplift, rest after chatter and overturning have their mirror images too
    values = np.random.default_rng(5).normal(size=600) * np.linspace(0.0, 2.6, 600)
    times = np.linspace(0.0, 11.98, 700)
    one, other = (simulate(FREE, SampledRecord(sign * values, 0.02), sample_times=times) for sign in (1.0, -1.0))
    assert one.samples is not None
    assert other.samples is not None
    assert one.impacts == other.impacts > 20
    assert (one.samples == -other.samples).all()
    assert (one.peaks, one.end_time) == (other.peaks, other.end_time)


@pytest.mark.parametrize("zeros", [1, 7, 5000])
def test_a_record_that_starts_later_gives_the_same_motion_later(zeros: int) -> None:
    specimen, values = Specimen(beta=0.64), 2.0 * np.random.default_rng(3).normal(size=400)
    at_once = simulate(specimen, SampledRecord(np.append(0.0, values), 0.01))
    later = simulate(specimen, SampledRecord(np.append(np.zeros(zeros + 1), values), 0.01))
    assert at_once.impacts > 10
    assert later.end == at_once.end  # bit for bit: a step knows only the time within its segment
    assert later.peaks == at_once.peaks
    assert later.end_time - at_once.end_time == pytest.approx(0.01 * zeros, abs=1e-13)


def test_a_block_at_rest_stays_at_rest() -> None:
    motion = simulate(Specimen(beta=0.64), SampledRecord(np.zeros(2000), 0.1))
    assert motion.end == State()
    assert motion.end.mode is Mode.REST
