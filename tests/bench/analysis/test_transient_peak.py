"""The peak of noisy transients against peaks that are known in closed form: bias, coverage, equal maxima, refusals."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from bench.analysis.transient_peak import RunningPeak, running_peak, transient_peak
from sim.errors import InvalidInput

Array = NDArray[np.float64]

RATE, REST = 1000.0, 2000
CARD = signal.butter(4, 100.0, fs=RATE, output="sos")
T = np.arange(0.0, 10.0, 1.0 / RATE)


def damped(t: Array) -> Array:
    """exp(-s t) sin(w t) and its turning point, where tan(w t) = w / s: peak w / hypot(w, s) exp(-s t)."""
    return np.where(t > 0.0, np.exp(-0.8 * t) * np.sin(11.0 * t), 0.0)


DAMPED = 11.0 / np.hypot(11.0, 0.8) * np.exp(-0.8 * np.arctan2(11.0, 0.8) / 11.0)


def noise(random: np.random.Generator, size: int, sigma: float) -> Array:
    """White noise behind the filter card, scaled to the standard deviation that it has there."""
    raw = np.asarray(signal.sosfilt(CARD, random.standard_normal(size + 500)))[500:]
    return sigma * raw / np.sqrt(2.0 * 100.0 / RATE * 1.0264)  # equivalent noise bandwidth of the card


def test_no_noise_no_error() -> None:
    rest = 1e-12 * np.random.default_rng(1).standard_normal(REST)
    found = transient_peak(np.concatenate((np.zeros(2000), damped(T))), rest, RATE)
    assert found.value == pytest.approx(DAMPED, rel=2e-6)
    assert found.time == pytest.approx(2.0 + np.arctan2(11.0, 0.8) / 11.0, abs=1e-4)
    assert (found.sign, found.rivals) == (1, 0)
    below = transient_peak(-np.concatenate((np.zeros(2000), damped(T))), rest, RATE)
    assert (below.value, below.sign) == (found.value, -1)


@pytest.mark.parametrize("ratio", [100.0, 1000.0])
def test_unbiased_and_covered_where_the_largest_sample_is_not(ratio: float) -> None:
    """Amplitude over noise as on the bench: 5 to 60 mm over 5 to 10 um and quantisation."""
    random = np.random.default_rng(7)
    lead = np.concatenate((np.zeros(2000), damped(T)))
    errors, stated, picked = [], [], []
    for _ in range(80):
        noisy = noise(random, REST + lead.size, DAMPED / ratio)
        found = transient_peak(lead + noisy[REST:], noisy[:REST], RATE)
        errors.append(found.value / DAMPED - 1.0)
        stated.append(found.uncertainty / DAMPED)
        picked.append(np.abs(lead + noisy[REST:]).max() / DAMPED - 1.0)
    scatter = float(np.std(errors))
    # within three standard errors of the mean; the largest sample is farther off
    assert abs(np.mean(errors)) < 3.0 * scatter / np.sqrt(len(errors)) + 1e-5
    assert np.mean(picked) > 2.0 * abs(np.mean(errors))
    assert scatter < 0.7 / ratio
    assert np.sqrt(np.mean(np.square(stated))) == pytest.approx(scatter, rel=0.2)
    covered = np.mean(np.abs(errors) <= 2.0 * np.array(stated))
    assert 0.88 <= covered <= 0.99


def test_several_equal_maxima_do_not_add_up_their_noise() -> None:
    """24 maxima of exactly 1: the largest of as many noisy values is 1.95 standard deviations too large."""
    random = np.random.default_rng(3)
    ends = np.clip(np.minimum((T - 1.0) / 2.0, (9.0 - T) / 2.0), 0.0, 1.0)
    wave = np.where(ends >= 1.0, 1.0, np.sin(0.5 * np.pi * ends) ** 2) * np.sin(3.0 * 2.0 * np.pi * T)
    assert np.count_nonzero(np.isclose(np.abs(wave), 1.0, atol=1e-6)) >= 6
    errors, stated, rivals = [], [], []
    for _ in range(40):
        noisy = noise(random, REST + T.size, 0.005)
        found = transient_peak(wave + noisy[REST:], noisy[:REST], RATE)
        errors.append(found.value - 1.0)
        stated.append(found.uncertainty)
        rivals.append(found.rivals)
    assert min(rivals) >= 2
    assert abs(np.mean(errors)) < 0.6 * np.mean(stated)
    assert np.mean(np.abs(errors) <= 2.0 * np.array(stated)) > 0.9


def test_the_stated_bias_bounds_what_the_degree_leaves() -> None:
    """A sine of known peak and a noise that asks for a wide window."""
    random = np.random.default_rng(5)
    wave = np.exp(-(((T - 6.0) / 1.5) ** 2)) * np.cos(20.0 * (T - 6.0))
    found = transient_peak(wave, 0.02 * random.standard_normal(REST), RATE)
    assert abs(found.value - 1.0) <= found.bias
    assert found.bias < 0.002
    assert 0.5 < 20.0 * found.window < np.pi / 2


def test_missing_samples() -> None:
    random = np.random.default_rng(2)
    wave = np.concatenate((np.zeros(2000), damped(T)))
    rest = 1e-4 * random.standard_normal(REST)
    holed = wave + 1e-4 * random.standard_normal(wave.size)
    holed[random.choice(holed.size, holed.size // 20, replace=False)] = np.nan
    assert transient_peak(holed, rest, RATE).value == pytest.approx(DAMPED, rel=5e-4)
    holed[2100:2180] = np.nan
    with pytest.raises(InvalidInput, match="too few valid samples"):
        transient_peak(holed, rest, RATE)


def test_a_gap_that_hides_the_largest_half_cycle_is_refused() -> None:
    random = np.random.default_rng(2)
    wave = np.concatenate((np.zeros(2000), damped(T)))
    rest = 1e-4 * random.standard_normal(REST)
    noisy = wave + 1e-4 * random.standard_normal(wave.size)
    hidden = noisy.copy()
    # from one zero to the next: the values beside the gap are small
    hidden[2000 : 2000 + round(np.pi / 11.0 * RATE)] = np.nan
    with pytest.raises(InvalidInput, match="the largest peak may lie there"):
        transient_peak(hidden, rest, RATE)
    late = noisy.copy()
    late[2000 + round(3.5 * RATE) : 2000 + round(3.8 * RATE)] = np.nan
    assert transient_peak(late, rest, RATE).value == pytest.approx(DAMPED, rel=5e-4)


def test_refusals() -> None:
    random = np.random.default_rng(4)
    with pytest.raises(InvalidInput, match="not exceed the noise"):
        transient_peak(random.standard_normal(5000), random.standard_normal(REST), RATE)
    with pytest.raises(InvalidInput, match="rest before"):
        transient_peak(damped(T), np.zeros(10), RATE)
    with pytest.raises(InvalidInput, match="no valid sample"):
        transient_peak(np.full(5000, np.nan), random.standard_normal(REST), RATE)


def test_running_peaks_of_blocks_are_those_of_the_whole() -> None:
    random = np.random.default_rng(6)
    values = random.standard_normal(1000)
    values[:150] = np.nan
    values[random.choice(1000, 50)] = np.nan
    whole, running = running_peak(values), RunningPeak()
    for end in np.cumsum(random.integers(1, 60, 20)):
        found = running.push(values[running.samples : end])
        np.testing.assert_equal(found, whole[end - 1])
        np.testing.assert_equal(found, np.nan if end <= 150 else np.nanmax(np.abs(values[:end])))
