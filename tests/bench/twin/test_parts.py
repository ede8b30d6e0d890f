"""Parts of the live twin against closed forms and against `scipy`."""

from dataclasses import replace
from math import nan, tau

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.signals import SignalMap
from bench.config.model import BenchConfiguration
from bench.config.sections import Simulation
from bench.testing.loopback import LoopbackRig
from bench.twin.ensemble import Gains, Measured, Members, draw_members
from bench.twin.estimator import Estimator, Limit, NoEstimate, Resampler, Residual, Setting, laser_lag
from drivers.hardware.parameters import Hardware, Lasers
from sim.excitation import SampledRecord
from sim.linear import steady_peaks
from sim.rocking import simulate
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.bench.calibrated import calibration

SENSORS = SensorUncertainty(SensorAccuracy(laser_linearity=5e-4), (0.2, 0.2))
COUPLED = Specimen().coupled(0.25)


@settings(max_examples=30, deadline=None)
@given(
    rate=st.sampled_from([800.0, 1000.0, 2048.0, 5000.0, 20_000.0]),
    late=st.floats(0.0, 2e-3),
    hertz=st.floats(0.5, 40.0),
    cuts=st.lists(st.integers(1, 400), min_size=1, max_size=30),
)
def test_a_sine_comes_out_whole_delayed_by_what_was_asked_for(
    rate: float, late: float, hertz: float, cuts: list[int]
) -> None:
    resampler = Resampler(rate, (late, 0.0))
    assert 600.0 <= 1.0 / resampler.dt <= 1500.0
    t = np.arange(round(0.6 * rate)) / rate
    wave = np.sin(tau * hertz * t)
    begin, came, at = 0, [], 0
    ends: list[float] = []
    while begin < t.size:
        n = cuts[at % len(cuts)]
        block = wave[begin : begin + n, None] * np.ones(2)
        samples, newer = resampler.push(block)
        begin, at = begin + len(block), at + 1
        came.append(samples)
        ends += [(begin - 1 - newer) / rate] if len(samples) else []
    out = np.concatenate(came)
    # how the signal was cut makes no difference
    assert np.array_equal(out, Resampler(rate, (late, 0.0)).push(wave[:, None] * np.ones(2))[0])
    moments = np.arange(len(out)) * resampler.dt - resampler.latency
    assert ends[-1] - resampler.latency == pytest.approx(moments[-1], abs=1e-9)
    settled = moments > resampler.latency + late + 1e-2
    for column, delay in enumerate((late, 0.0)):
        expected = np.sin(tau * hertz * (moments[settled] - delay))
        assert np.abs(out[settled, column] - expected).max() < 2e-3


def test_a_missing_value_spoils_what_the_filter_makes_of_it_and_nothing_else() -> None:
    resampler = Resampler(10_000.0, (0.0, 0.0))
    block = np.ones((4000, 2))
    block[2000, 1] = nan
    out, _ = resampler.push(block)
    assert np.isfinite(out[:, 0]).all()
    assert np.count_nonzero(np.isnan(out[:, 1])) == pytest.approx(12, abs=1)
    assert out[-1] == pytest.approx([1.0, 1.0])


def test_alpha_2_under_a_sine_is_over_the_exact_bare_response_at_the_achieved_amplitude() -> None:
    dt, omega, amplitude = 1e-3, 16.3, 1.3
    those = Members([COUPLED, COUPLED.with_spring(80.0)], np.array([1.0, 1.01]))
    gains = Gains(those, dt)
    t = np.arange(5000) * dt
    base, drift = amplitude * np.sin(omega * t + 0.3), np.stack((0.02 * np.sin(omega * t), 0.03 * np.cos(omega * t)))
    last = np.full(2, nan)
    for begin in range(0, 5000, 100):
        piece = slice(begin, begin + 100)
        measured = Measured(0.4, omega) if begin >= 1000 else None
        last = gains.push(base[piece], drift[:, piece], measured)
        assert np.isnan(last).all() == (begin < 1900)
    bare = steady_peaks(Specimen(), omega, amplitude).drift
    assert last == pytest.approx([0.02 / bare, 0.03 / (1.01 * bare)], rel=1e-4)


def test_alpha_2_under_a_record_compares_peaks_since_it_began_whenever_it_was_told() -> None:
    dt = 1e-3
    random = np.random.default_rng(4)
    base = np.convolve(random.standard_normal(4000), np.hanning(60), mode="same")
    base *= 1.3 / np.abs(base).max()
    record = SampledRecord(np.concatenate(([0.0], base)), dt)
    coupled, bare = (simulate(specimen, record).peaks.drift for specimen in (COUPLED, Specimen()))
    drift = 0.01 * np.abs(base)[None, :]
    gains = Gains(Members([COUPLED], np.ones(1)), dt)
    last = np.full(1, nan)
    for begin in range(0, 4000, 100):
        piece = slice(begin, begin + 100)
        last = gains.push(base[piece], drift[:, piece], Measured(nan, None) if begin >= 500 else None)
    # peaks of samples, every millisecond, for those of the motion
    assert last == pytest.approx([drift.max() / bare], rel=1e-4)
    assert coupled > 0.0


def test_without_the_acceleration_of_the_table_there_is_no_model_and_without_a_laser_no_residual() -> None:
    rig = LoopbackRig()
    names = [channel.name for channel in rig.channels]
    signals = SignalMap(rig.channels, "ground")
    setting = Setting(rig.sample_rate, True, (0.0, 0.0), SENSORS)
    values = np.zeros((1500, 4))
    values[:, names.index("laser_2")] = np.nan
    estimator = Estimator(1, setting, Members([COUPLED], np.ones(1)))
    estimate = estimator.take(0.0, 1500, signals.of(values), None)
    assert estimate is not None
    assert (estimate.drift, estimate.u1_measured, estimate.standing) == (0.0, 0.0, 1.0)
    assert np.isnan([estimate.u2_measured, estimate.drift_measured, estimate.residual, estimate.excess]).all()
    values[700, names.index("table_acceleration")] = np.nan
    with pytest.raises(NoEstimate, match="acceleration"):
        estimator.take(0.0, 3000, signals.of(values), None)


def test_without_a_block_there_is_no_alpha_2() -> None:
    gains = Gains(Members([Specimen()], np.ones(1)), 1e-3)
    assert np.isnan(gains.push(np.ones(100), np.ones((1, 100)), Measured(1.0, 16.0))).all()


def test_candidates_are_drawn_once_and_for_all() -> None:
    first, again = (draw_members(COUPLED, BenchConfiguration()) for _ in range(2))
    assert len(first.specimens) == 1 + BenchConfiguration().twin.members
    assert first.specimens == again.specimens
    assert np.array_equal(first.scales, again.scales)
    assert (first.specimens[0], first.scales[0]) == (COUPLED, 1.0)
    stiffness = np.array([one.frame.k1 for one in first.specimens[1:]]) / COUPLED.frame.k1
    assert 0.95 <= stiffness.min() < 0.96
    assert 1.04 < stiffness.max() <= 1.05


def test_a_residual_is_over_the_largest_drift_so_far_and_only_what_is_outside_is_excess() -> None:
    residual = Residual(1e-3, least=1e-4)
    t = np.arange(4000) * 1e-3
    measured = 0.02 * np.sin(tau * 2.0 * t)
    model = 1.1 * measured
    last = nan, nan
    for begin in range(0, 4000, 100):
        piece = slice(begin, begin + 100)
        band = model[piece] - 0.001, model[piece] + 0.001
        last = residual.push(measured[piece], model[piece], *band)
        assert np.isnan(last).all() == (begin < 900)
    assert last[0] == pytest.approx(0.1, rel=1e-6)
    outside = np.maximum(np.abs(0.1 * measured[-1000:]) - 0.001, 0.0)
    assert last[1] == pytest.approx(np.sqrt(np.mean(outside**2)) / (0.02 / np.sqrt(2.0)), rel=1e-6)
    # at rest what was large before counts on
    for _ in range(20):
        last = residual.push(np.zeros(100), np.full(100, 1e-5), np.zeros(100), np.zeros(100))
    assert last[0] == pytest.approx(1e-5 / (0.02 / np.sqrt(2.0)), rel=1e-6)
    assert np.isnan([residual.push(np.full(100, nan), *np.zeros((3, 100))) for _ in range(6)][-1]).all()


@given(st.lists(st.one_of(st.floats(0.0, 1.0), st.just(nan)), min_size=1, max_size=60))
def test_a_limit_counts_once_after_it_was_exceeded_long_enough(values: list[float]) -> None:
    limit = Limit(0.5, 1.0)
    counted = [k for k, value in enumerate(values) if limit.exceeded(value, 0.25 * k)]
    runs = [k for k in range(4, len(values)) if all(value > 0.5 for value in values[k - 4 : k + 1])]
    assert counted == runs[:1]
    assert not any(Limit(None, 0.0).exceeded(value, 0.0) for value in values)


@pytest.mark.parametrize(
    ("configuration", "expected"),
    [
        (BenchConfiguration(), (2.5 / 4000 - 0.5 / 2000, 2.5 / 4000)),
        (
            BenchConfiguration(simulation=Simulation(bench=VirtualBenchParameters(sample_rate=20_000.0))),
            (2.5 / 4000 - 0.5 / 20_000, 2.5 / 4000),
        ),
        (BenchConfiguration.model_validate({"twin": {"laser_lag": -0.001}}), (-0.001, -0.001)),
        (
            BenchConfiguration(
                backend="hardware", hardware=Hardware(lasers=Lasers(connection="analogue", rate=2000.0))
            ),
            (3.5 / 2000, 3.5 / 2000),
        ),
        (BenchConfiguration(backend="hardware"), (0.0, 0.0)),
    ],
)
def test_the_lag_of_the_lasers_is_what_their_settings_say(
    configuration: BenchConfiguration, expected: tuple[float, float]
) -> None:
    assert laser_lag(configuration) == pytest.approx(expected)


def test_the_band_has_the_calibrated_errors_only_where_the_lasers_are_calibrated() -> None:
    rig = LoopbackRig()
    names = [channel.name for channel in rig.channels]
    for reading, amplitude in ((0.005, np.hypot(np.sqrt(2.0) * 1e-5, 3e-5)), (0.02, 1e-4)):
        signals = SignalMap(rig.channels, "ground")
        sensors = replace(SENSORS, calibration=calibration(-0.01, 0.01))
        estimator = Estimator(1, Setting(rig.sample_rate, True, (0.0, 0.0), sensors), Members([COUPLED], np.ones(1)))
        values = np.zeros((1500, 4))
        signals.tare(values)
        values[:, names.index("laser_1")] = values[:, names.index("laser_2")] = reading
        found = estimator.take(0.0, 1500, signals.of(values), None)
        assert found is not None
        # a single member, so that the band is the errors of the lasers alone
        assert found.drift_high - found.drift_low == pytest.approx(2.0 * np.sqrt(2.0) * amplitude, rel=1e-6)
