"""Delays of lasers with held readings, whose ages are added up sample by sample."""

import numpy as np
import pytest

from protocols.check.held_readings import CLOCKS, Windows, covariance, delay_without_age

RATE, PARTS = 2000.0, 4
OMEGA = np.repeat((8.0, 12.0, 18.0, 27.0, 40.0), PARTS)
LENGTH = 4.0 * np.pi / OMEGA
WINDOWS = Windows(np.cumsum(LENGTH + np.where(np.arange(OMEGA.size) % PARTS, 0.0, 3.0)) - LENGTH, LENGTH)

LATENCY = 1e-3


def measured(period: float, rate: float, first: float, noise: float, random: np.random.Generator) -> np.ndarray:
    """Delays in the windows of a laser with `rate` measurements per second and the first age `first` [T], and with
    `noise` [s] in the first window.
    """
    shown = list[float]()
    for begin, length in zip(WINDOWS.begin, WINDOWS.length, strict=True):
        samples = np.arange(round(begin * RATE), round((begin + length) * RATE))
        shown.append(LATENCY + period * float(np.mean(np.mod(first + samples * rate / RATE, 1.0))))
    return np.array(shown) + noise * np.sqrt(LENGTH[0] / LENGTH) * random.standard_normal(OMEGA.size)


@pytest.mark.parametrize(
    ("period", "clock", "most"),
    [
        # with equal clocks, the age is the same in all windows and only its range is known
        (1.0 / 3000.0, 0.0, 0.3),
        (2.5e-4, 2e-5, 0.1),
        (1.0 / 3000.0, -CLOCKS, 0.1),
        pytest.param(2.5e-4, 0.0, 0.3, marks=pytest.mark.soak),
        pytest.param(1.0 / 3000.0, 2e-5, 0.1, marks=pytest.mark.soak),
        pytest.param(2.5e-4, -CLOCKS, 0.1, marks=pytest.mark.soak),
    ],
)
def test_the_interval_covers_the_mean_over_all_ages(period: float, clock: float, most: float) -> None:
    """At least 17 of 20 intervals, as would intervals of 95 % with a probability of 0.98; their u is below `most`
    periods. An interval from scatter alone would cover nothing for equal clocks.
    """
    random = np.random.default_rng(3)
    inside, widths = 0, list[float]()
    for first in random.uniform(0.0, 1.0, 20):
        shown = measured(period, (1.0 + clock) / period, first, 1e-5, random)
        found = delay_without_age(WINDOWS, shown, period, RATE)
        inside += abs(found.value - LATENCY - 0.5 * period) <= 2.0 * found.uncertainty
        widths.append(found.uncertainty / period)
    assert inside >= 17
    assert np.mean(widths) < most


def test_where_many_ages_follow_each_other_their_mean_is_known() -> None:
    """0.32 ms is 0.64 samples: 16 ages within 16 samples leave 1/16 of the range."""
    random = np.random.default_rng(4)
    found = delay_without_age(WINDOWS, measured(3.2e-4, 3125.0, 0.4, 1e-7, random), 3.2e-4, RATE)
    assert abs(found.value - LATENCY - 1.6e-4) <= 2.0 * found.uncertainty
    assert found.uncertainty < 3.2e-4 / 16.0 / np.sqrt(12.0) * 1.5


def test_it_is_as_exact_as_the_samples_where_clocks_run_apart() -> None:
    random = np.random.default_rng(5)
    noise = 2e-5
    shown = measured(2.5e-4, 4000.0 * (1.0 + 6e-5), 0.1, noise, random)
    of_mean = noise * np.sqrt(LENGTH[0] / LENGTH.sum())
    assert 0.7 * of_mean < delay_without_age(WINDOWS, shown, 2.5e-4, RATE).uncertainty < 2.0 * of_mean


def test_the_noise_of_the_table_is_in_both_delays() -> None:
    """The uncertainty of their difference is then smaller than of independent delays, but still not too small."""
    random = np.random.default_rng(6)
    scored, without = list[float](), list[float]()
    for _ in range(30):
        shared = 2e-5 * np.sqrt(LENGTH[0] / LENGTH) * random.standard_normal(OMEGA.size)
        first, second = (
            delay_without_age(
                WINDOWS, measured(2.5e-4, 4000.0 * (1.0 + clock), age, 1e-5, random) + shared, 2.5e-4, RATE
            )
            for clock, age in zip((6e-5, -4e-5), random.uniform(0.0, 1.0, 2), strict=True)
        )
        whole = first.uncertainty**2 + second.uncertainty**2
        scored.append((second.value - first.value) ** 2 / (whole - 2.0 * covariance(WINDOWS, first, second)))
        without.append((second.value - first.value) ** 2 / whole)
    assert 1.1 * np.sqrt(np.mean(without)) < np.sqrt(np.mean(scored)) < 1.2


def test_short_periods_take_no_longer_and_change_nothing() -> None:
    """With readings held for a microsecond, the delay and its uncertainty are those of a weighted mean."""
    random = np.random.default_rng(7)
    shown = measured(1e-6, 1e6 * (1.0 + 3e-5), 0.3, 1e-5, random)
    found = delay_without_age(WINDOWS, shown, 1e-6, RATE)
    mean = WINDOWS.weight @ shown
    scatter = np.sqrt(WINDOWS.weight @ (shown - mean) ** 2 / (OMEGA.size - 3))
    assert found.value == pytest.approx(mean, abs=1e-6)
    assert found.uncertainty == pytest.approx(scatter, rel=0.1)
