"""Motion with contact: against an independent solver, exact formulas of the free block, and the rules of the modes."""

from itertools import pairwise
from math import asin, hypot, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.linalg import expm

from sim.ensemble import simulate_many
from sim.errors import InvalidInput
from sim.excitation import Excitation, SampledRecord, SineProgram, Sweep
from sim.kernel import equations
from sim.kernel import rocking as kernel
from sim.linear import frame_matrices
from sim.rocking import REST_ANGLE, Mode, State, Status, simulate
from sim.specimen import Block, Specimen
from tests.sim.oracle import amplitude_after, printed_rates, quarter_period, reference_motion, uplift_moment
from tests.sim.runs import A_S, kernel_run

FREE = Specimen(beta=0.0)
"""A block without spring: it rocks on its own."""


def steady(duration: float, acceleration: float) -> SampledRecord:
    """A constant acceleration."""
    return SampledRecord(np.array([acceleration, acceleration]), duration)


def numbers(low: float, high: float, count: int) -> st.SearchStrategy[list[float]]:
    return st.lists(st.floats(low, high), min_size=count, max_size=count)


@settings(max_examples=60, deadline=None)
@given(
    numbers(-0.04, 0.04, 2), numbers(-1.0, 1.0, 3), st.floats(0.0, 1.4), st.floats(-5.0, 5.0), st.sampled_from([1, -1])
)
def test_rates_are_the_printed_equations(u: list[float], v: list[float], angle: float, a_g: float, corner: int) -> None:
    x = np.array([*u, *v[:2], corner * angle, v[2]])
    specimen, out = Specimen(beta=0.64), np.empty(6)
    equations.rates(specimen.packed(), float(corner), x, a_g, out)
    assert out == pytest.approx(printed_rates(specimen, corner, x, a_g), rel=1e-11, abs=1e-11)
    interpreted = np.empty(6)
    getattr(equations.rates, "py_func")(specimen.packed(), float(corner), x, a_g, interpreted)  # noqa: B009
    assert interpreted.tolist() == out.tolist()


def test_rates_at_rest_are_the_linear_frame() -> None:
    specimen, out, x = Specimen(beta=0.4), np.empty(6), np.array([0.01, -0.02, 0.1, 0.2, 0.0, 0.0])
    equations.rates(specimen.packed(), 0.0, x, 0.7, out)
    assert out == pytest.approx(printed_rates(specimen, 0, x, 0.7), rel=1e-12)


@pytest.mark.parametrize(("beta", "omega"), [(0.64, 17.0), (0.25, 14.0)])
def test_harmonic_motion_agrees_with_an_independent_solver(beta: float, omega: float) -> None:
    specimen, amplitude = Specimen(beta=beta), 1.3 * A_S
    start = np.array([0.005, -0.003, 0.02, 0.05, 0.02, -0.1])
    expected, impacts = reference_motion(
        specimen, lambda t: amplitude * float(np.sin(omega * t)), [0.0, 1.2], start, corner=1
    )
    motion = simulate(
        specimen, SineProgram([Sweep.dwell(1.2, amplitude, omega)]), state=State.from_array(start), tolerance=1e-12
    )
    assert motion.impacts == len(impacts) >= 4
    assert motion.end.as_array() == pytest.approx(expected, abs=2e-10)


def test_a_record_from_rest_agrees_with_an_independent_solver_breakpoint_by_breakpoint() -> None:
    specimen, dt = Specimen(beta=0.64), 0.05
    values = 2.2 * np.sin(14.0 * dt * np.arange(25)) * np.linspace(0.3, 1.0, 25)
    places = (dt * np.arange(25)).tolist()
    expected, impacts = reference_motion(
        specimen, lambda t: float(np.interp(t, places, values)), places, np.zeros(6), corner=0
    )
    motion = simulate(specimen, SampledRecord(values, dt), tolerance=1e-12)
    assert motion.impacts == len(impacts) >= 2
    assert motion.end.as_array() == pytest.approx(expected, abs=2e-10)


def test_bare_frame_under_a_record_is_the_matrix_exponential() -> None:
    mass, damping, stiffness = frame_matrices(Specimen().frame)
    values, dt = np.array([0.0, 1.0, -3.0, 2.0, 0.5, 0.5]), 0.04
    system = np.zeros((6, 6))  # [u, v, a_g, slope of a_g]
    system[:2, 2:4] = np.eye(2)
    system[2:4, :2], system[2:4, 2:4] = -np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)
    system[2:4, 4], system[4, 5] = -1.0, 1.0
    z, step = np.zeros(6), expm(system * dt)
    for value, following in pairwise(values):
        z[4:] = value, (following - value) / dt
        z = step @ z
    motion = simulate(Specimen(), SampledRecord(values, dt))
    assert motion.end.as_array()[:4] == pytest.approx(z[:4], abs=1e-13)
    assert motion.end_time == pytest.approx(0.2, abs=1e-15)


# smaller angles lose the digits of the formula itself: its two integrals cancel
@pytest.mark.parametrize("angle", [1e-3, 0.01, 0.06, 0.12])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_free_rocking_has_the_exact_period_and_decay(angle: float, side: float) -> None:
    segments = steady(60.0, 0.0).packed()
    start = np.array([0.0, 0.0, 0.0, 0.0, side * angle, 0.0])
    expected = quarter_period(FREE.block, FREE.g, angle)
    for impacts in range(1, 6):
        _, report, _ = kernel_run(FREE, segments, start, impacts=impacts)
        assert report[kernel.END] == pytest.approx(expected, rel=1e-11)
        expected += 2.0 * quarter_period(FREE.block, FREE.g, amplitude_after(FREE.block, angle, impacts))


def test_free_rocking_rises_to_the_exact_amplitude() -> None:
    start = np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0])
    for impacts in (1, 2, 7):
        after, _, _ = kernel_run(FREE, steady(60.0, 0.0).packed(), start, impacts=impacts)
        rise = amplitude_after(FREE.block, 0.1, impacts)
        past_the_top = steady(1.5 * quarter_period(FREE.block, FREE.g, rise), 0.0)
        motion = simulate(FREE, past_the_top, state=State.from_array(after), tolerance=1e-12)
        assert motion.impacts == 0
        assert motion.peaks.theta == pytest.approx(rise, rel=1e-11)


def test_free_rocking_comes_to_rest_at_the_accumulation_of_its_impacts() -> None:
    angle = 0.05
    time, impacts = quarter_period(FREE.block, FREE.g, angle), 0
    while impacts < 900:
        impacts += 1
        bounce = amplitude_after(FREE.block, angle, impacts)
        if bounce < 1e-11:  # below this the elliptic integrals cancel; the rest is a geometric series
            deceleration = FREE.block.b * FREE.g * FREE.block.mass / FREE.block.inertia
            time += 2.0 * np.sqrt(2.0 * bounce / deceleration) / (1.0 - FREE.block.restitution)
            break
        time += 2.0 * quarter_period(FREE.block, FREE.g, bounce)
    start = State(theta=angle)
    before = simulate(FREE, steady(time - 2e-3, 0.0), state=start)
    after = simulate(FREE, steady(time + 1e-6, 0.0), state=start)
    assert before.end.mode is not Mode.REST
    assert after.end.mode is Mode.REST
    assert 300 < after.impacts < 900
    assert (after.end.theta, after.end.omega) == (0.0, 0.0)


@given(st.sampled_from([-1.0, 1.0]), st.floats(0.0, 0.99999))
@settings(max_examples=20, deadline=None)
def test_nothing_lifts_below_the_uplift_acceleration(side: float, part: float) -> None:
    motion = simulate(FREE, steady(1.0, side * part * FREE.uplift_acceleration))
    assert motion.end.mode is Mode.REST
    assert motion.peaks.theta == 0.0


@pytest.mark.parametrize(("side", "mode"), [(1.0, Mode.ROCK_A), (-1.0, Mode.ROCK_B)])
def test_just_above_the_uplift_acceleration_the_block_lifts_to_its_side(side: float, mode: Mode) -> None:
    motion = simulate(FREE, steady(0.3, side * 1.0001 * FREE.uplift_acceleration))
    assert motion.end.mode is mode
    assert motion.impacts == 0


def test_exactly_at_the_threshold_the_block_stays() -> None:
    assert simulate(FREE, steady(5.0, FREE.uplift_acceleration)).end.mode is Mode.REST


def test_uplift_counts_the_spring() -> None:
    specimen = Specimen(beta=0.64)
    u1 = -0.01
    threshold = specimen.uplift_acceleration + specimen.k_c * u1 * specimen.frame.h1 / (
        specimen.block.mass * specimen.block.h_b
    )  # Eq. (9)
    assert uplift_moment(specimen, u1, threshold) == pytest.approx(specimen.block.b * specimen.g * specimen.block.mass)
    for factor, mode in ((0.9999, Mode.REST), (1.0001, Mode.ROCK_A)):
        motion = simulate(specimen, steady(1e-6, factor * threshold), state=State(u1=u1))
        assert motion.end.mode is mode


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_overturning_has_its_side_and_its_time(side: float) -> None:
    block, a_g = FREE.block, 2.0
    motion = simulate(FREE, steady(5.0, side * a_g), tolerance=1e-12)

    def slowness(z: float) -> float:
        # energy of the block under a constant acceleration; theta = z^2 removes the singularity of the start
        s, versine = np.sin(z * z), 2.0 * np.sin(0.5 * z * z) ** 2
        work = FREE.g * (block.h_b * versine - block.b * s) + a_g * (block.h_b * s + block.b * versine)
        return float(2.0 * z / np.sqrt(2.0 * block.mass * work / block.inertia))

    expected = quad(slowness, 0.0, np.sqrt(pi / 2), epsabs=1e-13, epsrel=1e-13)[0]
    assert motion.status is (Status.OVERTURNED_A if side > 0 else Status.OVERTURNED_B)
    assert motion.overturned == ("A" if side > 0 else "B")
    assert motion.end_time == pytest.approx(expected, rel=1e-10)
    assert motion.end.theta == pytest.approx(side * pi / 2, abs=1e-12)
    assert motion.peaks.theta == pytest.approx(pi / 2, abs=1e-12)


def test_a_lower_limit_of_overturning_is_met_earlier() -> None:
    motion = simulate(FREE, steady(5.0, 2.0), overturning_angle=0.3)
    assert motion.end.theta == pytest.approx(0.3, abs=1e-12)
    assert motion.overturned == "A"


def test_samples_stop_where_the_block_overturns() -> None:
    times = np.linspace(0.0, 5.0, 501)
    motion = simulate(FREE, steady(5.0, 2.0), sample_times=times)
    assert motion.samples is not None
    assert len(motion.samples) == np.count_nonzero(times <= motion.end_time)
    assert np.isfinite(motion.samples).all()


@pytest.mark.parametrize("amplitude", [1.05, 1.6, 2.5])
def test_mirrored_input_gives_mirrored_motion_bit_for_bit(amplitude: float) -> None:
    # without a spring the two corners are mirror images; with it they are not
    start, times = State(0.01, -0.02, 0.1, 0.3, 0.02, 0.1), np.linspace(0.0, 3.0, 50)
    mirror = State.from_array(-start.as_array())
    one, other = (
        simulate(FREE, SineProgram([Sweep.dwell(3.0, side * amplitude, 9.0)]), state=state, sample_times=times)
        for side, state in ((1.0, start), (-1.0, mirror))
    )
    assert one.impacts == other.impacts
    assert one.samples is not None
    assert other.samples is not None
    assert (one.samples == -other.samples).all()
    assert one.peaks == other.peaks


def test_the_spring_breaks_the_mirror() -> None:
    specimen, start = Specimen(beta=0.64), State(theta=0.05)
    one = simulate(specimen, steady(0.5, 0.0), state=start)
    other = simulate(specimen, steady(0.5, 0.0), state=State(theta=-0.05))
    assert abs(one.end.u1 + other.end.u1) > 1e-6


def test_a_run_cut_in_two_is_the_same_run() -> None:
    specimen, omega, cut = Specimen(beta=0.64), 17.0, 1.234
    whole = simulate(specimen, SineProgram([Sweep.dwell(3.0, 1.3 * A_S, omega)]), tolerance=1e-12)
    first = simulate(specimen, SineProgram([Sweep.dwell(cut, 1.3 * A_S, omega)]), tolerance=1e-12)
    rest = SineProgram([Sweep.dwell(3.0 - cut, 1.3 * A_S, omega)], phase=omega * cut)
    second = simulate(specimen, rest, state=first.end, tolerance=1e-12)
    assert second.end.as_array() == pytest.approx(whole.end.as_array(), abs=1e-9)
    assert first.impacts + second.impacts == whole.impacts > 0


def test_samples_and_window_of_the_peaks() -> None:
    specimen, times = Specimen(beta=0.64), np.linspace(0.0, 4.0, 40_001)
    drive = SineProgram([Sweep.dwell(4.0, 1.2 * A_S, 17.0)])
    motion = simulate(specimen, drive, sample_times=times, peaks_from=2.5)
    assert motion.samples is not None
    assert motion.samples[-1] == pytest.approx(motion.end.as_array(), abs=1e-12)
    window = motion.samples[times >= 2.5]
    drift = np.abs(window[:, 1] - window[:, 0]).max()
    for exact, sampled in (
        (motion.peaks.u1, np.abs(window[:, 0]).max()),
        (motion.peaks.drift, drift),
        (motion.peaks.theta, np.abs(window[:, 4]).max()),
    ):
        # a sampled peak is low, by at most an eighth of the curvature times the step squared
        assert sampled - 1e-12 <= exact <= sampled * (1.0 + 1e-5)
    # velocities are the derivatives of the displacements
    speeds = np.gradient(motion.samples[:, 0], times)
    np.testing.assert_allclose(speeds[1:-1], motion.samples[1:-1, 2], rtol=0.0, atol=2e-4)


@pytest.mark.parametrize("duration", [0.86, 0.92, 0.98, 1.04, 1.10])  # some while the motion falls
def test_the_window_of_the_peaks_may_open_inside_a_step(duration: float) -> None:
    drive = SineProgram([Sweep.dwell(duration, 1.2 * A_S, 17.0)])
    motion = simulate(Specimen(beta=0.64), drive, state=State(theta=0.03), peaks_from=duration - 1e-9)
    assert motion.peaks.u1 == pytest.approx(abs(motion.end.u1), abs=1e-8)
    assert motion.peaks.theta == pytest.approx(abs(motion.end.theta), abs=1e-8)


def test_an_inelastic_block_stops_at_its_first_impact() -> None:
    block = Specimen(beta=0.0, block=Block(restitution_factor=0.0))
    motion = simulate(block, steady(3.0, 0.0), state=State(theta=0.05))
    assert motion.impacts == 1
    assert motion.end.mode is Mode.REST


def test_stopping_errs_by_less_than_the_stated_angle() -> None:
    specimen, start = Specimen(beta=0.64), np.array([0.0, 0.0, 0.0, 0.0, 0.02, 0.0])
    segments = steady(12.0, 0.0).packed()
    times = np.linspace(0.0, 12.0, 200)
    _, _, fine = kernel_run(specimen, segments, start, times=times, rest_angle=REST_ANGLE / 100.0)
    _, _, usual = kernel_run(specimen, segments, start, times=times, rest_angle=REST_ANGLE)
    assert np.abs(fine[:, 4] - usual[:, 4]).max() <= 3.0 * REST_ANGLE
    assert np.abs(fine[:, :2] - usual[:, :2]).max() <= 3.0 * REST_ANGLE


def test_an_absurd_acceleration_fails_and_says_so() -> None:
    motion = simulate(Specimen(beta=0.64), steady(1.0, 1e300))
    assert motion.status is Status.FAILED
    assert np.isfinite(motion.end.as_array()).all()
    assert motion.end_time < 1.0


def test_many_runs_are_the_single_runs_in_order() -> None:
    specimens = [Specimen(beta=beta) for beta in (0.2, 0.4, 0.6)]
    drive = SineProgram([Sweep.dwell(2.0, 1.2 * A_S, 16.0)])
    many = simulate_many(specimens, drive, states=State(theta=0.01))
    single = [simulate(specimen, drive, state=State(theta=0.01)) for specimen in specimens]
    assert [motion.end for motion in many] == [motion.end for motion in single]
    with pytest.raises(InvalidInput, match="simulate_many"):
        simulate_many(specimens, [drive, drive])


class Table:
    """An excitation with any table."""

    duration = 1.0

    def __init__(self, rows: NDArray[np.float64]) -> None:
        self._rows = rows

    def packed(self) -> NDArray[np.float64]:
        return self._rows


GOOD = steady(1.0, 0.0)


@pytest.mark.parametrize(
    ("item", "specimen", "excitation", "options"),
    [
        ("u1", FREE, GOOD, {"state": State(u1=float("nan"))}),
        ("theta", Specimen(), GOOD, {"state": State(theta=0.1)}),
        ("theta", FREE, GOOD, {"state": State(theta=2.0)}),
        ("u1", Specimen(beta=0.4), GOOD, {"state": State(u1=0.2)}),
        ("tolerance", FREE, GOOD, {"tolerance": 0.0}),
        ("tolerance", FREE, GOOD, {"tolerance": float("nan")}),
        ("peaks_from", FREE, GOOD, {"peaks_from": -1.0}),
        ("peaks_from", FREE, GOOD, {"peaks_from": 1.0}),
        ("overturning_angle", FREE, GOOD, {"overturning_angle": 2.0}),
        ("sample_times", FREE, GOOD, {"sample_times": [0.0, 2.0]}),
        ("sample_times", FREE, GOOD, {"sample_times": [0.5, 0.2]}),
        ("excitation", FREE, Table(np.empty((0, 10))), {}),
        ("excitation", FREE, Table(np.zeros((1, 10))), {}),
        ("excitation", FREE, Table(np.full((1, 10), np.inf)), {}),
    ],
)
def test_bad_input_is_refused_by_name(
    item: str, specimen: Specimen, excitation: Excitation, options: dict[str, object]
) -> None:
    with pytest.raises(InvalidInput, match=f"^{item} = "):
        simulate(specimen, excitation, **options)  # pyright: ignore[reportArgumentType]  # wrong on purpose


def test_formulas_of_the_free_block_start_from_the_right_angle() -> None:
    # the oracle's own check: no impacts, no decay; and the small-angle limit of the quarter period is sqrt(2 theta / a)
    block = FREE.block
    assert amplitude_after(block, 0.07, 0) == pytest.approx(0.07)
    deceleration = block.mass * FREE.g * hypot(block.b, block.h_b) / block.inertia
    deceleration *= np.sin(asin(block.b / hypot(block.b, block.h_b)))
    assert quarter_period(block, FREE.g, 1e-5) == pytest.approx(np.sqrt(2e-5 / deceleration), rel=1e-3)
