"""Records made to fit the stroke: exact kinematics, an optimum that is one, and half the harm of a high-pass."""

from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from bench.analysis.response_spectrum import pseudo_acceleration
from bench.analysis.table_motion import table_motion, with_final_rest
from bench.config.model import BenchConfiguration
from bench.control import least_change
from bench.control.least_change import Infeasible, SineModes, oscillator_peak, shortest
from bench.control.stroke_fit import PERIODS, Method, StrokeFit, fit_stroke, high_passed, periods_of
from bench.control.target import Reach
from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.specimen import Frame

Array = NDArray[np.float64]


def ground_motion(seed: int, duration: float = 30.0, dt: float = 0.005, low: float = 0.05) -> Array:
    """Filtered noise with a rich low end, PGA 3 m/s2, that moves the ground by some 0.3 m and leaves it at rest.

    Kanai-Tajimi (2.5 Hz, 0.6), without what is below `low` [Hz], growing for 6 s and then decaying.
    """
    n = round(duration / dt) + 1
    t = np.arange(n) * dt
    f = np.fft.rfftfreq(n, dt)
    ratio = f / 2.5
    soil = np.abs((1.0 + 1.2j * ratio) / (1.0 - ratio**2 + 1.2j * ratio))
    slow = 1.0 / (1.0 + (low / np.maximum(f, 1e-9)) ** 4)
    noise = np.fft.rfft(np.random.default_rng(seed).standard_normal(n))
    motion = np.fft.irfft(noise * soil * slow / (1.0 + (f / 15.0) ** 4), n)
    motion *= (t / 6.0) ** 2 * np.exp(2.0 - t / 3.0) * np.clip(t / 0.5, 0.0, 1.0) * np.clip((t[-1] - t) / 0.5, 0.0, 1.0)
    passed = high_passed(motion, dt, 0.12)
    kept = passed.acceleration[max(passed.lead - 200, 0) : passed.lead + n + 200]
    return with_final_rest(3.0 * kept / np.abs(kept).max(), dt)


def test_straight_lines_are_integrated_exactly() -> None:
    t = np.arange(201) * 0.01
    motion = table_motion(2.0 + 3.0 * t, 0.01)
    assert motion.velocity == pytest.approx(2.0 * t + 1.5 * t**2, abs=1e-13)
    assert motion.displacement == pytest.approx(t**2 + 0.5 * t**3, abs=1e-13)


def test_a_record_is_brought_to_rest_by_its_two_slowest_sines() -> None:
    a = np.random.default_rng(5).standard_normal(4001)
    closed = with_final_rest(a, 0.005)
    motion = table_motion(closed, 0.005)
    assert abs(motion.velocity[-1]) < 1e-14 * motion.peak_velocity * a.size
    assert abs(motion.displacement[-1]) < 1e-14 * motion.peak_displacement * a.size
    assert (closed[0], closed[-1]) == pytest.approx((a[0], a[-1]), abs=1e-12)
    place = np.linspace(0.0, pi, a.size)
    change = a - closed
    shapes = np.array([np.sin(place), np.sin(2.0 * place)])
    assert np.linalg.lstsq(shapes.T, change)[0] @ shapes == pytest.approx(change, abs=1e-12)


@pytest.mark.parametrize(("lowest", "first"), [(0.0, 1), (0.55, 6)])
def test_the_modes_move_the_table_as_the_integration_says(lowest: float, first: int) -> None:
    modes = SineModes(501, 0.01, 2.0, lowest)
    assert modes.frequencies[0] == pytest.approx(0.1 * first)
    assert modes.frequencies[-1] == pytest.approx(2.0)
    samples = np.array([0, 1, 2, 77, 499, 500])
    velocity, displacement = modes.motions(samples)
    weights = np.random.default_rng(1).standard_normal(501)
    products = modes.products(weights)
    for k in (0, 1, modes.frequencies.size - 1):
        size = np.zeros(modes.frequencies.size)
        size[k] = 1.0
        mode = modes.sum(size)
        assert mode == pytest.approx(np.sin((k + first) * pi * np.arange(501) / 500), abs=1e-12)
        motion = table_motion(mode, 0.01)
        assert velocity[:, k] == pytest.approx(motion.velocity[samples], abs=1e-12)
        assert displacement[:, k] == pytest.approx(motion.displacement[samples], abs=1e-12)
        assert products[k] == pytest.approx(weights @ mode, abs=1e-10)


@pytest.mark.parametrize("period", [0.1, 0.5, 2.0])
def test_an_oscillators_peak_is_the_spectrums_and_the_sum_of_its_weights(period: float) -> None:
    a = ground_motion(1)
    peak = oscillator_peak(a, 0.005, period, 0.05)
    assert peak.weights @ a == pytest.approx(peak.value, rel=1e-10)
    # at the nearest sample the peak of the fastest oscillator is missed by up to (omega dt / 2)^2 / 2 = 1.2 %
    assert abs(peak.value) == pytest.approx(pseudo_acceleration(a, 0.005, np.array([period]))[0], rel=0.013)


@pytest.mark.parametrize("seed", range(5))
def test_the_shortest_vector_fulfils_the_optimality_conditions(seed: int) -> None:
    """y = A' mu + G' lambda with lambda >= 0 where G y = h and 0 elsewhere; and it is what SLSQP finds."""
    random = np.random.default_rng(seed)
    a, b = random.standard_normal((2, 12)), random.standard_normal(2)
    g, h = random.standard_normal((9, 12)), random.standard_normal(9)
    y = shortest((a, b), (g, h))
    slack = g @ y - h
    assert a @ y == pytest.approx(b, abs=1e-10)
    assert slack.min() > -1e-10
    active = slack < 1e-8
    rows = np.vstack((a, g[active]))
    multipliers = np.linalg.lstsq(rows.T, y)[0]
    assert multipliers @ rows == pytest.approx(y, abs=1e-9)
    assert (multipliers[2:] >= -1e-9).all()
    other = minimize(
        lambda x: 0.5 * x @ x,
        np.zeros(12),
        jac=lambda x: x,
        method="SLSQP",
        constraints=[{"type": "eq", "fun": lambda x: a @ x - b}, {"type": "ineq", "fun": lambda x: g @ x - h}],
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert y == pytest.approx(other.x, abs=1e-5)


def test_contradicting_inequalities_have_no_shortest_vector() -> None:
    g = np.array([[1.0, 2.0, 0.0], [-1.0, -2.0, 0.0]])
    with pytest.raises(Infeasible):
        shortest((np.array([[0.0, 0.0, 1.0]]), np.array([1.0])), (g, np.array([1.0, 1.0])))


def test_the_fit_is_the_least_change_that_slsqp_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    """A short record with every sample as a constraint, sines integrated one by one, and the weight written out."""
    monkeypatch.setattr(least_change, "SPECTRUM", 0.0)
    dt, n = 0.02, 301
    t = np.arange(n) * dt
    a = 2.0 * np.sin(2.0 * pi * 0.6 * t) * np.sin(pi * t / t[-1]) + np.sin(2.0 * pi * 3.0 * t)
    reach = Reach(0.04, 0.2)
    fitted = least_change.fit_by_least_change(a, dt, reach, np.array([0.5]), 0.05)

    orders = np.arange(1, 25)
    shapes = np.sin(pi * np.outer(orders, np.arange(n)) / (n - 1))
    weight = (orders / (2.0 * t[-1]) / 0.5) ** 2
    velocity, displacement = (np.array(part) for part in zip(*(table_motion(s, dt) for s in shapes), strict=True))
    own = table_motion(a, dt)
    kept = np.concatenate((own.velocity / reach.velocity, own.displacement / reach.displacement))
    made = np.concatenate((velocity / reach.velocity, displacement / reach.displacement), axis=1) / weight[:, None]
    ends = [n - 1, 2 * n - 1]
    limit = 1.0 - least_change.CLOSER
    other = minimize(
        lambda y: 0.5 * y @ y,
        np.zeros(orders.size),
        jac=lambda y: y,
        method="SLSQP",
        constraints=[
            {"type": "eq", "fun": lambda y: (kept - y @ made)[ends], "jac": lambda _: -made[:, ends].T},
            {"type": "ineq", "fun": lambda y: limit - (kept - y @ made), "jac": lambda _: made.T},
            {"type": "ineq", "fun": lambda y: limit + (kept - y @ made), "jac": lambda _: -made.T},
        ],
        options={"ftol": 1e-13, "maxiter": 1000},
    )
    assert other.success
    sizes = 2.0 / (n - 1) * shapes @ (a - fitted)
    assert np.sum((weight * sizes) ** 2) == pytest.approx(other.x @ other.x, rel=2e-3)
    assert sizes == pytest.approx(other.x / weight, abs=0.02 * np.abs(sizes).max())


@pytest.mark.parametrize("stroke", [0.075, 0.05, 0.03])
@pytest.mark.parametrize("seed", [0, pytest.param(2, marks=pytest.mark.soak)])
def test_the_least_change_does_at_most_half_the_harm_of_a_high_pass(seed: int, stroke: float) -> None:
    record, reach = SampledRecord(ground_motion(seed), 0.005), Reach(stroke, 0.6)
    periods = periods_of(Frame())
    assert 2.0 * pi / Frame().natural_frequencies[0] in periods
    good, simple = (fit_stroke(record, reach, method, periods) for method in Method)
    for fit in (good, simple):
        assert fit.before.peak_displacement > 0.2
        _within(fit, reach)
    assert good.after.peak_displacement == pytest.approx(stroke, rel=1e-3)
    assert simple.after.peak_displacement == pytest.approx(stroke, rel=1e-3)
    assert np.linalg.norm(good.change) < 0.5 * np.linalg.norm(simple.change)
    assert np.abs(good.change).max() < 0.6 * np.abs(simple.change).max()


def _within(fit: StrokeFit, reach: Reach) -> None:
    motion = table_motion(fit.record.acceleration, fit.record.dt)
    assert np.abs(motion.displacement).max() <= reach.displacement
    assert np.abs(motion.velocity).max() <= reach.velocity
    assert abs(motion.velocity[-1]) < 1e-13
    assert abs(motion.displacement[-1]) < 1e-13
    assert fit.after.peak_displacement == np.abs(motion.displacement).max()


def test_a_velocity_limit_binds_as_a_stroke_does() -> None:
    record, reach = SampledRecord(ground_motion(3), 0.005), Reach(0.2, 0.15)
    for method in Method:
        fit = fit_stroke(record, reach, method)
        _within(fit, reach)
        assert fit.after.peak_velocity == pytest.approx(0.15, rel=1e-3)
        assert fit.after.peak_displacement < 0.2


def test_a_raw_record_that_drifts_away_is_brought_back() -> None:
    """One cycle of a sine of A = 3 m/s2 and one second ends at rest, but A / 2 pi away."""
    t = np.arange(2001) * 0.005
    a = np.where(t < 1.0, 3.0 * np.sin(2.0 * pi * t), 0.0)
    fit = fit_stroke(SampledRecord(a, 0.005), Reach(0.06, 0.6))
    assert fit.before.displacement[-1] == pytest.approx(3.0 / (2.0 * pi), rel=1e-3)
    _within(fit, Reach(0.06, 0.6))
    assert np.abs(fit.record.acceleration - a).max() < 3.0


def test_what_fits_already_is_left_alone() -> None:
    first = fit_stroke(SampledRecord(ground_motion(0), 0.005), Reach(0.05, 0.6))
    again = fit_stroke(first.record, Reach(0.05, 0.6))
    assert np.array_equal(again.record.acceleration, first.record.acceleration)
    assert "unchanged" in again.done
    assert not again.change.any()


def test_a_record_of_five_minutes_fits() -> None:
    a = np.concatenate([ground_motion(seed, 38.0, 0.01) * scale for seed, scale in enumerate((1.0, *(0.3,) * 7))])
    record, reach = SampledRecord(a, 0.01), Reach(0.12, 0.6)
    assert record.duration > 300.0
    good, simple = (fit_stroke(record, reach, method, PERIODS[::2]) for method in Method)
    _within(good, reach)
    _within(simple, reach)
    assert np.linalg.norm(good.change) < 0.5 * np.linalg.norm(simple.change)


def test_the_high_pass_halves_its_corner_and_starts_early_enough() -> None:
    """Forward and backward: the gain is |H|^2 = 1/2 at the corner, and the phase is none."""
    dt, corner = 0.01, 0.5
    t = np.arange(12001) * dt
    a = np.sin(2.0 * pi * corner * t)
    passed = high_passed(a, dt, corner)
    middle = slice(4000, 8000)
    shifted = passed.acceleration[passed.lead :][: a.size]
    np.testing.assert_allclose(shifted[middle], 0.5 * a[middle], rtol=0.0, atol=1e-3)


@pytest.mark.parametrize(
    ("method", "frequency", "says"),
    [(Method.LEAST_CHANGE, 10.0, "below 2 Hz"), (Method.HIGH_PASS, 12.0, "high-passed at 5 Hz")],
)
def test_what_cannot_fit_is_refused_with_the_reason(method: Method, frequency: float, says: str) -> None:
    t = np.arange(4001) * 0.005
    a = 3.0 * np.sin(2.0 * pi * frequency * t) * np.sin(pi * t / t[-1]) ** 2
    with pytest.raises(InvalidInput, match=says):
        fit_stroke(SampledRecord(a, 0.005), Reach(0.5 * 3.0 / (2.0 * pi * frequency) ** 2, 1.0), method)


def test_a_record_without_motion_is_refused() -> None:
    with pytest.raises(InvalidInput, match="not all of them zero"):
        fit_stroke(SampledRecord(np.zeros(100), 0.005), Reach(0.05, 0.5))
    with pytest.raises(InvalidInput, match="positive number"):
        Reach(0.0, 0.5)


def test_the_reach_of_a_bench_is_a_share_of_the_narrower_of_stroke_and_limit() -> None:
    bench = BenchConfiguration()
    assert Reach.of(bench, 0.9).displacement == pytest.approx(0.9 * 0.060)
    assert Reach.of(bench, 0.9).velocity == pytest.approx(0.9 * 0.60)
    wide = bench.model_copy(update={"limits": bench.limits.model_copy(update={"displacement": 0.2})})
    assert Reach.of(wide, 1.0).displacement == pytest.approx(0.075)
