"""From a record to a table motion: each step against another way to do it, and their order."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

from bench.config.model import BenchConfiguration
from bench.control.preparation import TAPER, TRIM, PreparedMotion, prepare
from bench.control.stroke_fit import Method
from bench.control.target import REST, Reach, integrated
from bench.prediction.requests import BandStudyRequest, SeismicRequest, StrokeFitRequest
from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from tests.bench.control.virtual_table import earthquake

Array = NDArray[np.float64]

BAND = (1.0, 40.0)
QUIET = Reach(10.0, 10.0)


def record(seed: int = 4) -> SampledRecord:
    return SampledRecord(*earthquake(seed))


def motion_of(prepared: PreparedMotion) -> tuple[Array, Array]:
    """Velocity and displacement at the samples: the antiderivatives of scipy's piecewise linear spline."""
    made = prepared.record
    t = np.arange(made.acceleration.size) * made.dt
    lines = make_interp_spline(t, made.acceleration, k=1)
    return lines.antiderivative(1)(t), lines.antiderivative(2)(t)


def test_the_peak_is_exactly_that_asked_for_within_the_band_and_the_table_ends_at_rest() -> None:
    # the record's own peak is a slow hump that the band takes away
    rough = record()
    t = np.arange(rough.acceleration.size) * rough.dt
    hump = 3.0 * np.abs(rough.acceleration).max() * np.exp(-(((t - t.mean()) / 2.0) ** 2))
    slow = SampledRecord(rough.acceleration + hump, rough.dt)
    prepared = prepare(slow, band=BAND, peak=1.4715)
    a = prepared.record.acceleration
    assert np.abs(a).max() == pytest.approx(1.4715, rel=1e-14)
    assert prepared.peak == np.abs(a).max()
    assert prepared.peak_before == np.abs(slow.acceleration).max()
    assert prepared.factor > 2.0 * 1.4715 / prepared.peak_before
    velocity, displacement = motion_of(prepared)
    assert abs(velocity[-1]) < 1e-12
    assert abs(displacement[-1]) < 1e-11
    assert prepared.motion.peak_velocity == pytest.approx(np.abs(velocity).max(), rel=1e-9)
    assert prepared.motion.peak_displacement == pytest.approx(np.abs(displacement).max(), rel=1e-9)
    assert [step.split()[0] for step in prepared.steps] == ["kept", "band", "scaled"]


def test_the_band_is_a_butterworth_there_and_back() -> None:
    whole = record()
    prepared = prepare(whole, band=(1.0, 1e4), peak=None, trim=None)
    rest = round(-prepared.begin / whole.dt)
    size = prepared.record.acceleration.size
    padded = np.zeros(size)
    padded[rest : rest + whole.acceleration.size] = whole.acceleration
    # at 1 Hz the bilinear transform bends nothing
    expected = sosfiltfilt(butter(4, 1.0, "highpass", fs=1.0 / whole.dt, output="sos"), padded)
    np.testing.assert_allclose(prepared.record.acceleration, expected, rtol=0.0, atol=2e-3 * np.abs(expected).max())
    assert prepared.factor == 1.0


def test_the_model_is_given_the_straight_lines_between_the_samples() -> None:
    prepared = prepare(record(), band=BAND, peak=1.4715)
    made, rows = prepared.record, prepared.record.packed()
    assert made.dt == record().dt
    assert rows.shape[0] == made.acceleration.size - 1
    assert rows[:, 8] + rows[:, 9] * made.dt == pytest.approx(made.acceleration[1:], abs=1e-14)


def test_what_is_kept_of_a_long_record_is_untouched_and_its_ends_fade() -> None:
    middle = record()
    n, dt = middle.acceleration.size, middle.dt
    noise = 1e-4 * np.random.default_rng(2).standard_normal(20 * n)
    long = noise.copy()
    long[5 * n : 6 * n] += middle.acceleration
    prepared = prepare(SampledRecord(long, dt), band=None, peak=None)
    made, begin = prepared.record.acceleration, round(prepared.begin / dt)
    intensity = np.cumsum(long**2) / np.sum(long**2)
    kept = np.flatnonzero((intensity >= TRIM) & (intensity <= 1.0 - TRIM))
    assert np.array_equal(made[kept[0] - begin : kept[-1] + 1 - begin], long[kept])
    assert made.size * dt < kept.size * dt + 2.0 * TAPER + 3 * dt < long.size * dt / 10.0
    assert (made[0], made[-1]) == pytest.approx((0.0, 0.0), abs=1e-12)
    whole = prepare(SampledRecord(long, dt), band=None, peak=None, trim=None)
    assert np.array_equal(whole.record.acceleration, long)
    assert (whole.begin, whole.steps) == (0.0, ())


def test_time_goes_with_the_root_of_the_length_and_gravity_stays() -> None:
    prepared = prepare(record(), band=None, peak=None, trim=None, length_ratio=0.25)
    assert prepared.record.dt == 0.5 * record().dt
    assert np.array_equal(prepared.record.acceleration, record().acceleration)
    # the band is that of the table: it applies to the model's time
    fast = prepare(record(), band=BAND, peak=1.0, length_ratio=0.25)
    slow = prepare(record(), band=(BAND[0] / 2.0, BAND[1] / 2.0), peak=1.0, trim=TRIM)
    assert fast.motion.peak_velocity == pytest.approx(slow.motion.peak_velocity / 2.0, rel=1e-2)


def test_a_motion_in_model_time_states_where_it_begins_in_the_original_record() -> None:
    original = record()
    prepared = prepare(original, band=None, peak=None, trim=0.1, length_ratio=0.25)
    first, middle = round(prepared.begin_in_record / original.dt), prepared.record.acceleration.size // 2
    assert first > 0
    assert prepared.record.acceleration[middle] == pytest.approx(original.acceleration[first + middle], rel=1e-12)


@pytest.mark.parametrize("method", list(Method))
def test_the_stroke_is_fitted_after_the_scaling(method: Method) -> None:
    reach = Reach.of(BenchConfiguration())
    free = prepare(record(), band=None, peak=3.0)
    assert free.motion.peak_displacement > reach.displacement
    fitted = prepare(record(), band=None, peak=3.0, reach=reach, method=method)
    velocity, displacement = motion_of(fitted)
    assert np.abs(displacement).max() <= reach.displacement * (1.0 + 1e-9)
    assert np.abs(velocity).max() <= reach.velocity * (1.0 + 1e-9)
    assert abs(displacement[-1]) < 1e-11
    assert fitted.factor == free.factor
    assert fitted.fit is not None
    assert fitted.fit.done in fitted.steps[-1]
    # on the record's clock the fast parts coincide
    at = round((free.begin - fitted.begin) / free.record.dt)
    same = fitted.record.acceleration[at : at + free.record.acceleration.size]
    assert np.corrcoef(np.diff(same), np.diff(free.record.acceleration))[0, 1] > 0.9


def test_a_motion_that_fits_is_left_alone() -> None:
    free = prepare(record(), band=BAND, peak=1.0)
    fitted = prepare(record(), band=BAND, peak=1.0, reach=QUIET)
    assert np.array_equal(fitted.record.acceleration, free.record.acceleration)
    assert "unchanged" in fitted.steps[-1]


def test_the_target_of_the_table_is_the_motion_of_the_prediction() -> None:
    prepared = prepare(record(), band=BAND, peak=1.4715, trim=None)
    target = prepared.target(2000.0)
    t = np.arange(target.acceleration.size) / target.sample_rate
    made = prepared.record
    lines = np.interp(t, np.arange(made.acceleration.size) * made.dt, made.acceleration, right=0.0)
    # only what the lines hold above twice the band is missing
    np.testing.assert_allclose(target.acceleration, lines, rtol=0.0, atol=1e-2 * 1.4715)
    spectrum, support = np.abs(np.fft.rfft(target.acceleration)), target.support
    outside = (target.frequency <= support[0]) | (target.frequency >= support[1])
    assert spectrum[outside].max() < 1e-9 * spectrum.max()
    # another way: the lines of the record at the table's rate, filtered there by scipy, forwards and backwards
    rest = round(REST / BAND[0] * 2000.0)
    assert target.rest == rest
    given = record()
    fine = np.interp(
        np.arange(0.0, given.duration, 1 / 2000.0), given.dt * np.arange(given.acceleration.size), given.acceleration
    )
    other = prepared.factor * np.pad(fine, rest)
    for edge, kind in zip(BAND, ("highpass", "lowpass"), strict=True):
        other = sosfiltfilt(butter(4, edge, kind, fs=2000.0, output="sos"), other)
    size = min(other.size, target.acceleration.size)
    np.testing.assert_allclose(target.acceleration[:size], other[:size], rtol=0.0, atol=0.02 * 1.4715)


@pytest.mark.parametrize("method", list(Method))
def test_the_target_of_a_fitted_record_keeps_its_stroke_and_is_the_motion_of_the_prediction(method: Method) -> None:
    """A band that begins low: what the fit adds must lie where the table's band keeps it."""
    reach, slow = Reach(0.03, 0.9), (0.25, 25.0)
    free = prepare(record(), band=slow, peak=1.4715)
    assert free.motion.peak_displacement > 1.3 * reach.displacement
    fitted = prepare(record(), band=slow, peak=1.4715, reach=reach, method=method)
    target = fitted.target(2000.0)
    assert target.peaks["displacement"] <= 1.002 * reach.displacement
    assert target.peaks["displacement"] > 0.95 * reach.displacement
    assert target.peaks["velocity"] <= reach.velocity
    # by integration in time, at the table's rate, from rest
    _, asked = integrated(target.acceleration, 2000.0)
    t = np.arange(asked.size) / 2000.0
    made = np.interp(t, np.arange(fitted.record.acceleration.size) * fitted.record.dt, fitted.motion.displacement)
    np.testing.assert_allclose(asked, made, rtol=0.0, atol=0.02 * reach.displacement)
    spectrum, frequency = np.abs(np.fft.rfft(target.acceleration)), target.frequency
    assert spectrum[frequency <= slow[0] / 2.0].max() < 1e-9 * spectrum.max()


def test_a_band_that_takes_away_what_the_stroke_needs_is_refused() -> None:
    fitted = prepare(record(), band=(0.25, 25.0), peak=1.4715, reach=Reach(0.03, 0.9), method=Method.HIGH_PASS)
    with pytest.raises(InvalidInput, match="incompatible"):
        replace(fitted, reach=Reach(0.025, 0.9)).target(2000.0)
    with pytest.raises(InvalidInput, match="scale"):
        prepare(record(), band=(8.0, 25.0), peak=9.0, reach=Reach(1e-5, 0.01))


@pytest.mark.parametrize(
    ("said", "options"),
    [
        ("band", {"band": (5.0, 4.0)}),
        ("band", {"band": (0.0, 4.0)}),
        ("band", {"band": (400.0, 500.0)}),
        ("peak", {"peak": 0.0}),
        ("peak", {"peak": float("nan")}),
        ("trim", {"trim": 0.6}),
        ("length_ratio", {"length_ratio": 0.0}),
    ],
)
def test_what_has_no_meaning_is_refused(said: str, options: dict[str, object]) -> None:
    with pytest.raises(InvalidInput, match=said):
        prepare(record(), **{"band": None, "peak": 1.0, **options})


def test_a_silent_record_is_refused_and_a_table_needs_a_band() -> None:
    with pytest.raises(InvalidInput, match="record"):
        prepare(SampledRecord(np.zeros(100), 0.01), band=None, peak=1.0)
    prepared = prepare(record(), band=None, peak=1.0)
    with pytest.raises(InvalidInput, match="band"):
        prepared.target(2000.0)
    with pytest.raises(InvalidInput, match="band"):
        prepare(record(), band=(1.0, 100.0), peak=1.0).target(300.0)


def test_the_default_of_the_trimming_is_one() -> None:
    assert {SeismicRequest().trim, BandStudyRequest().trim, StrokeFitRequest().trim} == {TRIM}
