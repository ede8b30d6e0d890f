"""The multisine: only the lines asked for, with the amplitudes asked for, and a low crest factor."""

import numpy as np
import pytest

from bench.control.identification import band_lines, drive_amplitudes, multisine
from sim.errors import InvalidInput
from sim.shaker import Shaker

RATE, SAMPLES = 2000.0, 8000


def test_lines_lie_in_the_band_ends_included() -> None:
    lines = band_lines(SAMPLES, RATE, (0.5, 80.0))
    assert lines[0] * 0.25 == 0.5
    assert lines[-1] * 0.25 == 80.0
    assert np.all(np.diff(lines) == 1)
    odd = band_lines(SAMPLES, RATE, (0.5, 80.0), odd=True)
    assert set(odd) == {line for line in lines if line % 2}


@pytest.mark.parametrize("band", [(0.0, 10.0), (5.0, 5.0), (1.0, 1000.0), (0.30, 0.45)])
def test_a_band_without_lines_is_refused(band: tuple[float, float]) -> None:
    with pytest.raises(InvalidInput, match="band of the multisine"):
        band_lines(SAMPLES, RATE, band)


def test_the_waveform_holds_the_lines_and_nothing_else() -> None:
    lines = band_lines(SAMPLES, RATE, (0.5, 80.0))
    amplitudes = np.linspace(0.5, 2.0, lines.size)
    signal = multisine(lines, amplitudes, SAMPLES, RATE, 1)
    # an independent sum of cosines
    t = np.arange(SAMPLES) / RATE
    direct = sum(
        abs(c) * np.cos(2 * np.pi * f * t + np.angle(c)) for f, c in zip(signal.frequency, signal.spectrum, strict=True)
    )
    np.testing.assert_allclose(signal.volts, direct, rtol=0.0, atol=1e-10)
    assert np.abs(signal.spectrum) == pytest.approx(amplitudes)
    assert signal.drive(3).size == 3 * SAMPLES
    np.testing.assert_allclose(signal.drive(3)[SAMPLES:], signal.drive(2), rtol=5e-7, atol=5e-13)


def test_seeds_make_realisations() -> None:
    lines = band_lines(SAMPLES, RATE, (0.5, 80.0))
    first, again, other = (multisine(lines, np.ones(lines.size), SAMPLES, RATE, seed) for seed in (1, 1, 2))
    assert np.array_equal(first.spectrum, again.spectrum)
    turned = np.angle(first.spectrum * np.conj(other.spectrum))
    # phases of two realisations have nothing to do with each other
    assert abs(np.mean(np.exp(1j * turned))) < 4.0 / np.sqrt(lines.size)


@pytest.mark.parametrize("seed", range(3))
def test_crest_factor_is_low_where_it_is_asked_for(seed: int) -> None:
    lines = band_lines(SAMPLES, RATE, (0.5, 80.0))
    flat = np.ones(lines.size)
    volts = multisine(lines, flat, SAMPLES, RATE, seed).volts
    assert np.abs(volts).max() / np.sqrt(np.mean(volts**2)) < 1.7
    table = Shaker().frequency_response(2 * np.pi * lines * 0.25)
    signal = multisine(lines, flat / np.abs(table), SAMPLES, RATE, seed, table)
    bins = np.zeros(SAMPLES // 2 + 1, complex)
    bins[lines] = signal.spectrum * table
    motion = np.fft.irfft(bins, SAMPLES)
    assert np.abs(motion).max() / motion.std() < 1.7


@pytest.mark.parametrize(("flat", "power"), [("acceleration", 0), ("velocity", 1), ("displacement", 2)])
def test_the_motion_is_flat_in_what_is_asked_for(flat: str, power: int) -> None:
    f = np.array([0.5, 1.0, 2.0, 4.0, 40.0])
    gain = np.abs(Shaker().frequency_response(2 * np.pi * f))
    motion = drive_amplitudes(f, gain, flat, 2.0) * gain  # type: ignore[arg-type]
    assert motion[:3] / (2 * np.pi * f[:3]) ** power == pytest.approx(np.full(3, motion[2] / (4 * np.pi) ** power))
    assert motion[2:] == pytest.approx(np.ones(3))


def test_scaled_to_a_peak_of_the_motion() -> None:
    lines = band_lines(SAMPLES, RATE, (0.5, 80.0))
    table = Shaker().frequency_response(2 * np.pi * lines * 0.25)
    signal = multisine(lines, np.ones(lines.size), SAMPLES, RATE, 1).scaled_to(0.6, table)
    t = np.arange(SAMPLES) / RATE
    motion = np.real(np.exp(2j * np.pi * np.outer(t, signal.frequency)) @ (signal.spectrum * table))
    assert np.abs(motion).max() == pytest.approx(0.6)
