import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import SeedSequence
from numpy.typing import NDArray

from sim.filter_unit import FilterUnit
from sim.sensors import PORTION, Accelerometer, Converter, DisplacementSensor, Laser, NormalNumbers

Array = NDArray[np.float64]

IDEAL = Laser(noise=0.0, linearity=0.0, output_bits=24, clock_error=0.0)


def reading(
    laser: Laser, displacement: Array, velocity: Array | None = None, rate: float = 2000.0, seed: int = 1
) -> Array:
    """Output [V] at the ticks."""
    v = np.zeros_like(displacement) if velocity is None else velocity
    return laser.stream(rate, SeedSequence(seed)).read(displacement, v)


def at_rest(laser: Laser, displacement: float) -> float:
    """Output [V] for a standing storey."""
    return float(reading(laser, np.full(50, displacement))[-1])


@pytest.mark.parametrize(
    ("displacement", "volts"), [(0.0, 6.0), (-0.1, 2.0), (0.1, 10.0), (0.025, 7.0), (0.102, 10.08)]
)
def test_the_output_is_4_to_20_ma_over_500_ohm(displacement: float, volts: float) -> None:
    assert at_rest(IDEAL, displacement) == pytest.approx(volts, abs=1e-6)


@pytest.mark.parametrize("displacement", [0.1021, -0.1021, 0.5])
def test_outside_the_range_and_its_reserve_the_error_current_flows(displacement: float) -> None:
    assert at_rest(IDEAL, displacement) == pytest.approx(0.003 * 500.0)
    assert not IDEAL.valid_volts[0] <= at_rest(IDEAL, displacement) <= IDEAL.valid_volts[1]


def test_nominal_calibration_inverts_the_output_and_does_not_know_the_scale_error() -> None:
    slope, offset = IDEAL.nominal
    assert slope * at_rest(IDEAL, 0.037) + offset == pytest.approx(0.037, abs=1e-7)
    wrong = IDEAL.model_copy(update={"scale_error": 0.02})
    assert slope * at_rest(wrong, 0.037) + offset == pytest.approx(1.02 * 0.037, abs=1e-7)


def test_the_output_moves_in_steps_of_its_bits() -> None:
    laser = IDEAL.model_copy(update={"output_bits": 12})
    slow = np.linspace(-0.01, 0.01, 40_000)
    steps = np.unique(np.round(reading(laser, slow) / (8.0 / 4096), 6))
    np.testing.assert_allclose(np.diff(steps), 1.0, atol=1e-5)


def test_the_linearity_error_has_its_size_and_a_seeded_phase() -> None:
    laser = IDEAL.model_copy(update={"linearity": 0.001})
    slope, offset = laser.nominal
    slow = np.linspace(-0.09, 0.09, 40_000)
    errors = [slope * reading(laser, slow, rate=2000.0, seed=seed) + offset - slow for seed in (1, 1, 2)]
    assert np.abs(errors[0][100:]).max() == pytest.approx(0.001 * 0.2, rel=0.05)
    np.testing.assert_array_equal(errors[0], errors[1])
    assert np.abs(errors[0] - errors[2]).max() > 1e-5


def test_normal_numbers_do_not_depend_on_how_they_are_taken() -> None:
    taken = NormalNumbers(np.random.default_rng(1), np.random.default_rng(2))
    parts = [taken.take(n) for n in (0, 3, PORTION, 1, 2 * PORTION + 5, 200)]
    found = np.concatenate(parts, axis=1)
    for row, seed in zip(found, (1, 2), strict=True):
        np.testing.assert_array_equal(row, np.random.default_rng(seed).standard_normal(row.size))


def test_noise_of_a_measurement_is_that_stated() -> None:
    laser = IDEAL.model_copy(update={"noise": 2e-5})
    slope, offset = laser.nominal
    seen = slope * reading(laser, np.zeros(20_000), rate=4000.0) + offset
    assert seen.std() == pytest.approx(2e-5, rel=0.03)


@pytest.mark.parametrize("latency", [0, 2, 5])
@pytest.mark.parametrize("rate", [2000.0, 20_000.0])
def test_the_output_is_between_latency_and_one_measurement_more_behind(latency: int, rate: float) -> None:
    laser = IDEAL.model_copy(update={"latency": latency})
    slope, offset = laser.nominal
    speed = 0.05
    t = np.arange(int(rate)) / rate
    behind = t - (slope * reading(laser, speed * t, np.full(t.size, speed), rate) + offset) / speed
    settled = behind[t > 0.01]
    assert settled.min() >= (latency - 1e-3) / laser.rate
    assert settled.max() <= (latency + 1 + 1e-3) / laser.rate
    if rate > laser.rate:
        # the value is held from one measurement to the next
        assert settled.max() - settled.min() > 0.5 / laser.rate


def test_between_ticks_the_laser_sees_a_smooth_curve() -> None:
    """A cubic motion is followed exactly; the age of the value is known from a ramp seen by the same laser."""
    laser, rate, speed = IDEAL, 1000.0, 0.05
    slope, offset = laser.nominal
    t = np.arange(150) / rate
    ramp = slope * reading(laser, speed * t, np.full(t.size, speed), rate) + offset
    seen_at = ramp[10:] / speed
    cubic = slope * reading(laser, 15.0 * t**3 - 2.0 * t**2, 45.0 * t**2 - 4.0 * t, rate) + offset
    # 24 bits over 0.2 m are 1.2e-8 m, which is also 2.4e-7 s of the ramp
    np.testing.assert_allclose(cubic[10:], 15.0 * seen_at**3 - 2.0 * seen_at**2, rtol=0, atol=2e-7)


def test_the_clock_of_the_laser_drifts_by_its_error() -> None:
    """Measuring at the ticks' own rate the age stays; with an error of 1e-3 it walks through a whole interval."""
    t = np.arange(4000) / 4000.0
    ages: list[float] = []
    for error in (0.0, 1e-3):
        laser = IDEAL.model_copy(update={"clock_error": error})
        slope, offset = laser.nominal
        age = t - (slope * reading(laser, 0.05 * t, np.full(t.size, 0.05), 4000.0) + offset) / 0.05
        ages.append(float(np.ptp(age[20:]) * 4000.0))
    assert ages[0] < 0.01
    assert ages[1] > 0.95


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(1, 40), min_size=1, max_size=20), st.sampled_from([500.0, 2000.0, 7919.0, 20_000.0]))
def test_a_laser_fed_in_blocks_gives_the_same_samples(blocks: list[int], rate: float) -> None:
    t = np.arange(sum(blocks)) / rate
    x, v = 0.05 * np.sin(60.0 * t), 3.0 * np.cos(60.0 * t)
    whole = Laser().stream(rate, SeedSequence(5)).read(x, v)
    stream, start, parts = Laser().stream(rate, SeedSequence(5)), 0, list[Array]()
    for n in blocks:
        parts.append(stream.read(x[start : start + n], v[start : start + n]))
        start += n
    np.testing.assert_array_equal(np.concatenate(parts), whole)


@pytest.mark.parametrize("sensor", [Accelerometer(scale_error=0.01), DisplacementSensor(scale_error=0.01)])
def test_linear_sensors_have_their_sensitivity_and_noise(sensor: Accelerometer | DisplacementSensor) -> None:
    """White noise of density S sampled at f_s has the variance S^2 f_s / 2."""
    value = np.full(40_000, 0.03)
    volts = sensor.volts(value, 2000.0, np.random.default_rng(1))
    assert volts.mean() == pytest.approx(1.01 * sensor.sensitivity * 0.03, rel=0.01)
    assert volts.std() == pytest.approx(1.01 * sensor.sensitivity * sensor.noise_density * 1000.0**0.5, rel=0.03)
    assert sensor.nominal[0] * sensor.sensitivity * 0.03 + sensor.nominal[1] == pytest.approx(0.03)


@pytest.mark.parametrize("order", [1, 4, 8])
def test_the_filter_is_butterworth_and_the_same_in_every_channel(order: int) -> None:
    """|H|^2 = 1 / (1 + (w/w_c)^2n) at the bilinear transform's warped frequencies."""
    rate, unit = 2000.0, FilterUnit(order=order, cutoff=100.0)
    t = np.arange(8000) / rate
    for frequency in (20.0, 100.0, 250.0):
        sine = np.sin(2.0 * np.pi * frequency * t)
        filtered = unit.stream(rate).read(np.vstack([sine, 2.0 * sine]))
        np.testing.assert_allclose(filtered[1], 2.0 * filtered[0], rtol=0, atol=1e-12)
        ratio = np.tan(np.pi * frequency / rate) / np.tan(np.pi * unit.cutoff / rate)
        gain = np.sqrt(2.0) * filtered[0, 4000:].std()
        assert gain == pytest.approx((1.0 + ratio ** (2 * order)) ** -0.5, rel=1e-6)


def test_the_filter_has_been_on_before_the_first_sample() -> None:
    steady = np.array([[2.0], [-3.0]]) * np.ones(100)
    np.testing.assert_allclose(FilterUnit().stream(2000.0).read(steady), steady, rtol=1e-9)


@pytest.mark.parametrize("bits", [14, 16])
def test_the_converter_has_its_step_and_stays_at_its_last_code(bits: int) -> None:
    converter = Converter(bits=bits, noise=0.0)
    top = 2 ** (bits - 1)
    assert converter.lsb == 10.0 / top
    volts = np.array([0.0, 0.49 * converter.lsb, 0.51 * converter.lsb, -1.0, 9.999999, 10.0, 40.0, -10.0, -40.0])
    counts = converter.counts(volts, np.random.default_rng(1))
    assert counts.dtype == np.int16
    assert counts.tolist() == [0, 0, 1, round(-top / 10), top - 1, top - 1, top - 1, -top, -top]


def test_converter_noise_is_that_stated() -> None:
    converter = Converter(noise=0.01)
    counts = converter.counts(np.zeros(40_000), np.random.default_rng(1))
    assert counts.std() * converter.lsb == pytest.approx(0.01, rel=0.02)


@pytest.mark.parametrize("bits", [8, 14, 16])
def test_counts_are_those_of_the_array_formula_bit_for_bit(bits: int) -> None:
    converter = Converter(bits=bits, noise=0.0 if bits == 8 else 0.0004)
    volts = np.random.default_rng(2).uniform(-11.0, 11.0, (4, 3000))
    # halves between two counts are rounded to the even one
    volts[0] = (np.arange(3000) - 1500.5) * converter.lsb
    lowest, highest = converter.codes
    noise = converter.noise * np.random.default_rng(1).standard_normal((3000, 4))
    expected = np.clip(np.rint((noise + volts.T) / converter.lsb), lowest, highest).astype(np.int16)
    found = converter.counts(volts.T, np.random.default_rng(1))
    np.testing.assert_array_equal(found, expected)
    assert found.flags.f_contiguous
