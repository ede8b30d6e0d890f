"""The identification of the table: against a linear system known exactly, planted noise and distortion, and the
virtual shaker's own equations."""

from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from bench.config.validation import validated
from bench.control.identification import (
    Multisine,
    band_lines,
    line_amplitudes,
    line_response,
    sensor_agreement,
    steady_periods,
)
from bench.control.table_model import TableModel
from sim.errors import InvalidInput
from sim.shaker import Shaker
from sim.specimen import Frame, Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.bench.control.virtual_table import IDENTIFIED, RATE, bench_with, closed_form, identify

Array = NDArray[np.float64]

SAMPLES = 2000
SPACING = RATE / SAMPLES
LINES = band_lines(SAMPLES, RATE, (1.0, 120.0))
FREQUENCY = LINES * SPACING


def gaussian_drive(realisations: int, periods: int, amplitude: float = 0.1) -> Array:
    """Random-phase multisines that nobody has made less Gaussian, shape (realisations, periods, SAMPLES)."""
    random = np.random.default_rng(8)
    drive = np.empty((realisations, periods, SAMPLES))
    for r in range(realisations):
        spectrum = amplitude * np.exp(2j * np.pi * random.uniform(size=LINES.size))
        drive[r] = Multisine(LINES, spectrum, SAMPLES, RATE).volts
    return drive


def filtered(drive: Array) -> tuple[Array, NDArray[np.complex128]]:
    """What a Butterworth filter makes of periodic drives in steady state, and its response at the lines."""
    b, a = signal.butter(2, 60.0, fs=RATE)
    _, whole = signal.freqz(b, a, 2 * np.pi * np.arange(SAMPLES // 2 + 1) / SAMPLES)
    return np.fft.irfft(np.fft.rfft(drive, axis=-1) * whole, SAMPLES, axis=-1), whole[LINES]


def test_a_linear_system_without_noise_is_found_exactly() -> None:
    drive = gaussian_drive(2, 2)
    output, truth = filtered(drive)
    found = line_response(line_amplitudes(drive, LINES), line_amplitudes(output, LINES), FREQUENCY, SPACING)
    assert found.response == pytest.approx(truth, abs=1e-12)
    assert found.coherence == pytest.approx(np.ones(LINES.size))
    assert np.all(found.uncertainty < 1e-12)


def test_planted_noise_is_recovered_and_not_taken_for_distortion() -> None:
    drive = gaussian_drive(6, 5)
    output, truth = filtered(drive)
    sigma = 0.02
    output += sigma * np.random.default_rng(9).standard_normal(output.shape)
    found = line_response(line_amplitudes(drive, LINES), line_amplitudes(output, LINES), FREQUENCY, SPACING)
    # white noise of one-sided density sigma sqrt(2 / rate); 24 x 120 x 2 degrees of freedom: 1.3 % of scatter
    assert np.sqrt(np.mean(found.noise_density**2)) == pytest.approx(sigma * np.sqrt(2 / RATE), rel=0.04)
    # variance of a line's mean: density^2 x 2 spacing / (periods x realisations), over the drive's amplitude
    expected = sigma * np.sqrt(2 / RATE) * np.sqrt(2 * SPACING / 30) / 0.1
    assert np.sqrt(np.mean(found.noise**2)) == pytest.approx(expected, rel=0.04)
    assert np.sqrt(np.mean(found.uncertainty**2)) == pytest.approx(expected, rel=0.2)
    errors = np.abs(found.response - truth)
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(expected, rel=0.15)
    assert np.median(found.distortion) < 1.5 * expected * np.sqrt(6)


def test_planted_cubic_distortion_is_recovered_beside_noise() -> None:
    # y = u + c u^3 of a Gaussian u: the best linear gain is 1 + 3 c sigma^2, and what is left has the spectrum
    # 6 c^2 S * S * S (Bussgang; Price), S the two-sided power of u
    drive = gaussian_drive(60, 2)
    cubic = 0.02
    noise = 0.004
    output = drive + cubic * drive**3 + noise * np.random.default_rng(10).standard_normal(drive.shape)
    found = line_response(line_amplitudes(drive, LINES), line_amplitudes(output, LINES), FREQUENCY, SPACING)
    two_sided = np.zeros(2 * LINES[-1] + 1)
    two_sided[LINES[-1] + LINES] = two_sided[LINES[-1] - LINES] = 0.1**2 / 4
    third = np.convolve(np.convolve(two_sided, two_sided), two_sided)
    expected = np.sqrt(4 * 6 * cubic**2 * third[3 * LINES[-1] + LINES]) / 0.1
    variance = drive[0, 0].var()
    assert np.mean(found.response.real) == pytest.approx(1 + 3 * cubic * variance, rel=2e-3)
    assert np.sqrt(np.mean(found.distortion**2)) == pytest.approx(np.sqrt(np.mean(expected**2)), rel=0.06)
    assert np.sqrt(np.mean(found.noise_density**2)) == pytest.approx(noise * np.sqrt(2 / RATE), rel=0.04)
    assert np.all(found.coherence < 1.0)


def test_one_realisation_tells_no_distortion() -> None:
    drive = gaussian_drive(1, 3)
    output, _ = filtered(drive)
    found = line_response(line_amplitudes(drive, LINES), line_amplitudes(output, LINES), FREQUENCY, SPACING)
    assert np.isnan(found.distortion).all()


def test_sensors_that_disagree_are_told() -> None:
    drive = gaussian_drive(3, 3)
    motion, _ = filtered(drive)
    random = np.random.default_rng(11)
    bins = 2j * np.pi * np.arange(SAMPLES // 2 + 1) * SPACING
    bins[0] = 1.0
    late = np.fft.rfft(motion, axis=-1) * np.exp(-bins * 0.0004)
    acceleration = np.fft.irfft(late, SAMPLES, axis=-1) + 1e-3 * random.standard_normal(motion.shape)
    place = -1.03 * np.fft.irfft(np.fft.rfft(motion, axis=-1) / bins**2, SAMPLES, axis=-1)
    place += 1e-7 * random.standard_normal(place.shape)
    a, x = (
        line_response(line_amplitudes(drive, LINES), line_amplitudes(output, LINES), FREQUENCY, SPACING)
        for output in (acceleration, place)
    )
    gain, lead = sensor_agreement(a, x)
    assert gain == pytest.approx(-1.03, rel=2e-3)
    assert lead == pytest.approx(0.0004, rel=0.02)


def test_periods_are_cut_and_the_first_ones_left_out() -> None:
    record = np.arange(45.0)
    assert np.array_equal(steady_periods(record, 10, 1), record[10:40].reshape(3, 10))
    with pytest.raises(InvalidInput, match="at least two must remain"):
        steady_periods(record, 10, 3)
    record[20] = np.nan
    with pytest.raises(InvalidInput, match="every sample"):
        steady_periods(record, 10, 1)


def test_the_virtual_table_against_its_own_equations() -> None:
    # a frame that settles within the discarded period; guides without friction
    specimen = Specimen(frame=Frame(xi1=0.3, xi2=0.3))
    shaker = Shaker(friction=0.0)
    model = identify(bench_with(specimen, parameters=VirtualBenchParameters(shaker=shaker)), periods=4)
    f = np.array(model.frequency)
    truth = closed_form(f, shaker, specimen, RATE)
    found = model.response(f)
    assert np.abs(found / truth - 1.0).max() < 0.02
    error = np.abs(found - truth) / np.array(model.uncertainty)
    # three realisations give an uncertainty with four degrees of freedom
    assert np.median(error) < 2.0
    assert np.sum(np.abs(found - truth) ** 2) < 2.0 * np.sum(np.array(model.uncertainty) ** 2)
    assert np.min(model.coherence) > 0.99
    # accelerometer 2e-4, converter 0.5 mV rms, and 0.005 N of force on some 52 kg
    high = f > 10.0
    assert np.median(np.array(model.noise)[high]) == pytest.approx(2.2e-4, rel=0.1)


def test_friction_shows_as_distortion() -> None:
    rough, smooth = (
        identify(bench_with(Specimen(), parameters=VirtualBenchParameters(shaker=Shaker(friction=friction))), level=0.3)
        for friction in (3.0, 0.0)
    )
    assert np.median(rough.distortion) > 5.0 * np.median(smooth.distortion)


@pytest.fixture(scope="module")
def model() -> TableModel:
    return identify(bench_with(Specimen()), periods=2, realisations=2)


def test_a_model_is_written_and_read_back(model: TableModel, tmp_path: Path) -> None:
    path = tmp_path / "table.json"
    model.write(path)
    assert TableModel.read(path) == model
    with pytest.raises(InvalidInput, match="never overwritten"):
        model.write(path)


@pytest.mark.parametrize(
    ("text", "says"), [("{", "cannot be read as JSON"), ("{}", "date"), ('{"date": "2026-05-04T12:00:00"}', "date")]
)
def test_a_file_that_holds_no_model_is_refused(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "table.json"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=says):
        TableModel.read(path)
    with pytest.raises(InvalidInput, match="no such file"):
        TableModel.read(tmp_path / "absent.json")


def test_a_model_holds_within_its_band_only(model: TableModel) -> None:
    assert model.band == (0.5, 80.0)
    between = model.response(np.array([7.3125]))[0]
    neighbours = model.response(np.array([7.25, 7.375]))
    assert between == pytest.approx(neighbours.mean())
    for frequency in (0.4, 80.1):
        with pytest.raises(InvalidInput, match="wider band"):
            model.response(np.array([5.0, frequency]))
    with pytest.raises(InvalidInput, match="identified at 2000"):
        model.require_rate(1000.0)


def test_a_model_grows_old(model: TableModel) -> None:
    model.require_fresh(IDENTIFIED + timedelta(hours=11))
    model.require_fresh(IDENTIFIED + timedelta(hours=30), longest=timedelta(hours=48))
    for age in (timedelta(hours=13), timedelta(hours=-1)):
        with pytest.raises(InvalidInput, match="identify the table again"):
            model.require_fresh(IDENTIFIED + age)


def test_a_model_whose_parts_do_not_belong_together_is_refused(model: TableModel) -> None:
    data = model.model_dump(mode="json")
    for change in ({"noise": model.noise[:-1]}, {"frequency": model.frequency[::-1]}):
        with pytest.raises(InvalidInput):
            validated(TableModel, {**data, **change})
