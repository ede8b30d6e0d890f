"""alpha_2 and its uncertainty from cycles."""

import json
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.analysis.cycles import Cycle, fit_cycle
from bench.analysis.draws import Draws
from bench.analysis.gain import DRAWS, SEED, SensorAccuracy, SteadyPeak, gain, steady_peak
from bench.analysis.laser_calibration import LaserCalibration
from bench.analysis.linearity import LinearFrame
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.running_gain import shared_draws
from bench.analysis.sensor_uncertainty import SCALES, STEPS, SensorUncertainty
from bench.analysis.signals import ACCELERATION, DRIFT, LASER_2
from bench.analysis.unsteady_peaks import unsteady_peaks
from sim.specimen import Specimen
from tests.bench.calibrated import calibration
from tests.made_cycles import pure_cycle

EXACT = SensorAccuracy(laser_mismatch=0.0, laser_resolution=0.0, laser_timing=0.0, laser_linearity=0.0, table_scale=0.0)


def _sensors(accuracy: SensorAccuracy) -> SensorUncertainty:
    return SensorUncertainty(accuracy, (0.2, 0.2))


def _cycles(drifts: np.ndarray) -> list[Cycle]:
    made = []
    for k, drift in enumerate(drifts):
        amplitudes = np.zeros(7, dtype=complex)
        amplitudes[ACCELERATION], amplitudes[DRIFT] = 1.2j, drift
        made.append(pure_cycle(k, amplitudes))
    return made


def _peak(drift: float, scatter: float = 0.0, seen: float = 0.0, swing: float = 0.02) -> SteadyPeak:
    at = PeakReadings(drift, 1.0, (seen, seen + drift), (0.0, 0.0), np.zeros((2, 1)), (swing, swing), False)
    return SteadyPeak(drift, scatter, 0.0, 0.001, 1.2, 0.0, at, 24)


def test_the_gain_is_the_ratio_of_the_drifts() -> None:
    found = gain(_peak(0.008), _peak(0.04), _sensors(EXACT))
    assert found.alpha_2 == pytest.approx(0.2)
    assert found.uncertainty == 0.0


def test_what_both_tests_share_cancels_and_what_they_do_not_adds_up_in_squares() -> None:
    """To first order the relative error of alpha_2 by the lasers is (s_2 - s_1) (L1c / Dc - L1b / Db)."""
    accuracy = EXACT.model_copy(update={"laser_mismatch": 0.001})
    coupled, bare = _peak(0.010, 1e-5, 0.008), _peak(0.050, 1e-4, -0.020)
    by_scale = 0.001 * (0.008 / 0.010 + 0.020 / 0.050)
    by_scatter = np.hypot(1e-5 / 0.010, 1e-4 / 0.050)
    found = gain(coupled, bare, _sensors(accuracy))
    assert found.budget.parts[SCALES] == pytest.approx(0.2 * by_scale, rel=0.03)
    assert found.budget.parts["scatter of the cycles"] == pytest.approx(0.2 * by_scatter)
    assert found.uncertainty == pytest.approx(2.0 * 0.2 * np.hypot(by_scale, by_scatter), rel=0.03)
    # the storey sees the same multiple of its drift in both tests
    alike = gain(_peak(0.010, seen=-0.008), _peak(0.050, seen=-0.040), _sensors(accuracy))
    assert alike.uncertainty == pytest.approx(0.0, abs=1e-12)


def test_the_table_counts_as_far_as_the_gain_moves_with_its_amplitude() -> None:
    accuracy = EXACT.model_copy(update={"table_scale": 0.005})
    found = gain(_peak(0.010), _peak(0.050), _sensors(accuracy), amplitude_slope=-1.6)
    assert found.budget.dominating == "amplitude of the table"
    assert found.uncertainty == pytest.approx(2.0 * 0.2 * 1.6 * 0.005)


def test_the_budget_is_sorted_and_readable() -> None:
    found = gain(_peak(0.010, 1e-5, 0.008), _peak(0.050, 1e-4, -0.020), _sensors(SensorAccuracy()), 0.5)
    read = json.loads(found.budget.as_json)
    assert list(read.values()) == sorted(read.values(), reverse=True)
    assert next(iter(read)) == found.budget.dominating
    assert 2.0 * np.hypot.reduce(list(read.values())) == pytest.approx(found.uncertainty, rel=0.01)


@pytest.mark.parametrize("ratio", [100, 400])
def test_the_peak_of_the_mean_cycle_has_no_bias_of_the_largest_sample(ratio: int) -> None:
    """Noise of A / `ratio` and a zero that is off by as much: the largest sample of 24 cycles is far too large."""
    random, phase = np.random.default_rng(ratio), np.arange(629) * 0.01 * 1.0001
    pure = np.sin(phase) + 0.05 * np.sin(3.0 * phase + 0.4)
    fine = np.linspace(0.0, 2.0 * np.pi, 200_001)
    true = float(np.abs(np.sin(fine) + 0.05 * np.sin(3.0 * fine + 0.4)).max())
    found, largest = [], []
    for _ in range(30):
        noisy = np.zeros((24, phase.size, 7))
        noisy[:, :, DRIFT] = pure + (random.standard_normal((24, phase.size)) + random.choice([-1.0, 1.0])) / ratio
        cycles = [cycle for k, each in enumerate(noisy) if (cycle := fit_cycle(k, phase, each)) is not None]
        found.append(steady_peak(cycles, 1.0).drift / true - 1.0)
        largest.append(np.abs(noisy[:, :, DRIFT]).max() / true - 1.0)
    assert abs(np.mean(found)) < 5e-4
    assert np.mean(largest) > 3.0 / ratio


def test_the_scatter_of_independent_cycles_is_the_standard_error() -> None:
    draw = np.random.default_rng(1)
    errors = [steady_peak(_cycles(1.0 + 0.01 * draw.standard_normal(50)), 1.0).scatter for _ in range(100)]
    assert np.mean(errors) == pytest.approx(0.01 / np.sqrt(50), rel=0.25)


def test_correlated_cycles_count_less() -> None:
    draw = np.random.default_rng(2)
    covered = 0
    for _ in range(150):
        series = np.empty(60)
        series[0] = draw.standard_normal()
        for k in range(1, 60):
            series[k] = 0.7 * series[k - 1] + np.sqrt(1.0 - 0.49) * draw.standard_normal()
        peak = steady_peak(_cycles(10.0 + series), 1.0)
        covered += abs(peak.drift - 10.0) <= 2.0 * peak.scatter
    assert covered / 150 > 0.85  # two standard errors of independent samples would cover about 60 %


def test_an_unsteady_motion_counts_with_the_peaks_of_its_cycles() -> None:
    drifts = 1.0 + 0.3 * np.sin(np.arange(40))
    # sines, so that the drift does not jump between two cycles
    peaks = unsteady_peaks(_cycles(np.repeat(1.0j * drifts, 4)), 1.0, EXACT)
    assert peaks.least.drift == pytest.approx(drifts.min(), rel=1e-4)
    assert peaks.greatest.drift == pytest.approx(drifts.max(), rel=1e-4)


def test_a_bound_of_a_systematic_effect_counts_as_a_rectangular_distribution() -> None:
    peak = steady_peak(_cycles(np.full(24, 0.01)), 1.0, residual=0.0024)
    assert peak.transient == pytest.approx(0.01 * 0.0024 / np.sqrt(3.0))


STEP = 5e-5
"""Resolution of the lasers [m]."""

PHASE = np.arange(2000) * (2.0 * np.pi / 2000)


def _drift(amplitude: float) -> np.ndarray:
    """A motion whose peak is on one side, where it is `amplitude`."""
    return amplitude * (np.sin(PHASE) - 0.25 * np.cos(2.0 * PHASE)) / 1.25


def _rounded(amplitudes: Sequence[float], offset: float) -> list[Cycle]:
    """Cycles of a drift that laser 2 reads, rounded to steps that are shifted by `offset` steps."""
    cycles = list[Cycle]()
    for number, amplitude in enumerate(amplitudes):
        values = np.zeros((PHASE.size, 7))
        values[:, LASER_2] = (np.round(_drift(amplitude) / STEP + offset) - offset) * STEP
        values[:, DRIFT] = values[:, LASER_2]
        cycle = fit_cycle(number, PHASE, values)
        assert cycle is not None
        cycles.append(cycle)
    return cycles


def _errors(amplitudes: Sequence[float]) -> float:
    """Rms error of the peak [m] over offsets of the steps."""
    peaks = [steady_peak(_rounded(amplitudes, offset), 1.0).drift for offset in (np.arange(25) + 0.5) / 25.0]
    return float(np.sqrt(np.mean((np.array(peaks) - np.mean(amplitudes)) ** 2)))


def _of_steps(amplitudes: Sequence[float]) -> float:
    """Stated standard uncertainty of the peak [m] due to the resolution; laser 1 stands still, so that it adds none."""
    accuracy = EXACT.model_copy(update={"laser_resolution": STEP})
    seen = (_peak(1.0, swing=1e9).readings, steady_peak(_rounded(amplitudes, 0.0), 1.0).readings)
    return float(_sensors(accuracy).drift_errors(seen, Draws(np.random.default_rng(1), 10_000))[STEPS][1].std())


@pytest.mark.parametrize("steps", [4, 20, 200, *(pytest.param(steps, marks=pytest.mark.soak) for steps in (8, 66))])
def test_the_steps_of_a_laser_shift_a_fitted_peak_as_far_as_stated(steps: float) -> None:
    """On average over sizes: whether a motion ends just before a step or behind it is not known."""
    sizes = [[(steps + part) * STEP] for part in np.arange(12) / 12.0]
    errors, stated = ([function(size) for size in sizes] for function in (_errors, _of_steps))
    assert np.hypot.reduce(errors) == pytest.approx(np.hypot.reduce(stated), rel=0.2)


def test_cycles_that_differ_by_parts_of_a_step_average_its_rounding() -> None:
    different, equal = (20.0 + np.arange(8) / 8.0) * STEP, np.full(8, 20.0 * STEP)
    assert _errors(different) < 0.5 * _errors(equal)
    assert _errors(different) < _of_steps(different) < 0.85 * _of_steps(equal)


def _calibrated() -> LaserCalibration:
    return calibration(-0.05, 0.03, rest=0.004, uncertainty=3e-6, common_linearity=1e-5)


def _reading(drift: float, sign: float, laser_1: float) -> PeakReadings:
    lasers = (laser_1, laser_1 + sign * drift)
    return PeakReadings(drift, sign, lasers, (0.0, 0.0), np.zeros((2, 1)), (0.02, 0.02), True)


def test_another_peak_of_a_test_does_not_choose_the_linearity_error() -> None:
    """The least favourable one is that for the ratio of the two peaks, whatever other peaks are almost as large."""
    sensors = SensorUncertainty(SensorAccuracy(), (0.2, 0.2), _calibrated())
    bare, coupled, other = _reading(0.010, 1.0, 0.008), _reading(0.006, 1.0, 0.005), _reading(0.0059, -1.0, -0.006)
    alone, beside = (sensors.shapes(seen) for seen in ([bare, coupled], [bare, coupled, other]))
    assert alone.common is not None
    assert beside.common is not None
    assert beside.common.waves == alone.common.waves
    np.testing.assert_allclose(beside.common.moments[:2, :2], alone.common.moments, rtol=1e-9)


def test_the_first_storey_has_the_errors_of_the_reference_sensor_too() -> None:
    sensors = SensorUncertainty(SensorAccuracy(), (0.2, 0.2), _calibrated())
    seen = [_reading(0.010, 1.0, 0.02), _reading(0.006, 1.0, 0.015)]
    draws = 40_000
    own = sensors.linearity(0, seen, Draws(np.random.default_rng(1), draws)).std(axis=1)
    # the same reading of laser and reference sensor has the same error; at rest, that of the laser alone remains
    same, apart = (
        sensors.u1_linearity(seen, table, Draws(np.random.default_rng(1), draws)).std(axis=1)
        for table in ((0.02, 0.015), (0.0, 0.0))
    )
    np.testing.assert_allclose(same, own, rtol=0.02)
    # at most the limit of an unfavourable curve, at its two places
    added = np.sqrt(apart**2 - own**2)
    assert (added > 0.1 * 1e-5).all()
    assert (added < 2.0 * 1e-5).all()


def test_a_zero_at_rest_has_an_error_of_the_calibrated_curve_too() -> None:
    sensors = SensorUncertainty(SensorAccuracy(), (0.2, 0.2), _calibrated())
    at_rest = _reading(0.010, 1.0, 0.008)
    seen = [at_rest, replace(at_rest, at_rest=False)]
    found = sensors.linearity(0, seen, Draws(np.random.default_rng(1), 40_000)).std(axis=1)
    np.testing.assert_allclose(found, [3e-6 * np.sqrt(2.0), 3e-6], rtol=0.02)


def test_cycles_with_the_fundamental_alone_are_no_check_of_the_lasers() -> None:
    cycles, frame = _cycles(np.full(24, 0.02)), LinearFrame(Specimen().bare(), grounded=True)
    assert steady_peak(cycles, 16.0, frame=frame).checks is None


_READING = st.floats(-0.1, 0.1)


@st.composite
def _steady(draw: st.DrawFn) -> SteadyPeak:
    drift, sign = draw(st.floats(1e-4, 0.1)), draw(st.sampled_from((1.0, -1.0)))
    at_rest, speeds = draw(st.booleans()), draw(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)))
    swings = draw(st.tuples(st.floats(0.0, 0.2), st.floats(0.0, 0.2)))
    zero = np.zeros((2, 1)) if at_rest else np.array(draw(st.lists(_READING, min_size=64, max_size=64))).reshape(2, 32)
    lasers = draw(st.tuples(_READING, _READING))
    return SteadyPeak(
        drift, 1e-5, 1e-5, 0.001, 1.2, 0.0, PeakReadings(drift, sign, lasers, speeds, zero, swings, at_rest), 24
    )


@settings(max_examples=30, deadline=None)
@given(
    bare=_steady(),
    coupled=_steady(),
    calibration=st.sampled_from((None, _calibrated())),
    resolution=st.sampled_from((0.0, 5e-5)),
)
def test_a_running_gain_with_shared_draws_has_the_uncertainty_of_the_result(
    bare: SteadyPeak, coupled: SteadyPeak, calibration: LaserCalibration | None, resolution: float
) -> None:
    sensors = SensorUncertainty(SensorAccuracy(laser_resolution=resolution), (0.2, 0.2), calibration)
    expected = gain(coupled, bare, sensors)
    for found in (gain(coupled, bare, sensors, shared=SHARED.again()) for _ in range(2)):
        assert found.alpha_2 == expected.alpha_2
        assert found.uncertainty == pytest.approx(expected.uncertainty, rel=1e-9)
        assert found.budget.parts == pytest.approx(expected.budget.parts, rel=1e-6, abs=1e-9 * expected.uncertainty)


SHARED = shared_draws()


def test_shared_draws_are_those_of_a_new_generator_and_are_made_once() -> None:
    shared, new = shared_draws(), Draws(np.random.default_rng(SEED), DRAWS)
    first = [shared.uniform(-0.5, 0.5), shared.normal(2), shared.normal()]
    for found, expected in zip(first, (new.uniform(-0.5, 0.5), new.normal(2), new.normal()), strict=True):
        np.testing.assert_array_equal(found, expected)
    again = shared.again()
    repeated = [again.uniform(-0.5, 0.5), again.normal(2), again.normal()]
    assert [id(each) for each in repeated] == [id(each) for each in first]
    other, new = shared.again().normal(), Draws(np.random.default_rng(SEED), DRAWS)
    np.testing.assert_array_equal(other, new.normal())
