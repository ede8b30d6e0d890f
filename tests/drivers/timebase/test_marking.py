"""Offsets of a sensor's clock from pulses that switch its beam off, against clocks known exactly."""

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.timebase.marking import (
    Mark,
    Rate,
    expected_uncertainty,
    golden_pulses,
    marked_point,
    observation_pulses,
    pulse_rate,
)

RATE = 4000.0
SENSOR = 1.0 + 37e-6
"""Seconds of the sample clock per second of the sensor."""


UNSURE = 40e-6
"""Standard uncertainty of a rate known from the arrivals alone."""


def seen(
    offset: float,
    *,
    true: float = SENSOR,
    given: float = SENSOR,
    spread: float = UNSURE,
    rough: float = 0.002,
    lost: slice | None = None,
) -> Mark | None:
    """The point found, where the sensor's second 0 is at `offset` of the sample clock, its rate is `true` and is taken
    as `given`."""
    pulses = golden_pulses(RATE)
    time = np.arange(-400, round((pulses.end + 0.05) * RATE)) / RATE
    at = offset + true * time
    since = np.mod(at - pulses.delay, pulses.high + pulses.low)
    dark = np.logical_and(since < pulses.high, np.logical_and(at >= pulses.delay, at < pulses.end))
    if lost is not None:
        kept = np.delete(np.arange(time.size), lost)
        time, dark = time[kept], dark[kept]
    return marked_point(pulses, time, ~dark, Rate(given, spread), offset + rough)


def error(offset: float, mark: Mark | None, true: float = SENSOR) -> float:
    assert mark is not None
    return mark.seconds - (offset + true * mark.time)


def differences(seed: int) -> Iterator[tuple[float, float, float]]:
    """Phases, true rates, and deviations of the given rates in standard uncertainties."""
    rng = np.random.default_rng(seed)
    for _ in range(200):
        yield rng.uniform(0.0, 1.0 / RATE), 1.0 + rng.uniform(-60e-6, 60e-6), rng.standard_normal()


@pytest.mark.parametrize("spread", [0.1e-6, 10e-6, UNSURE])
def test_the_clock_is_found_to_a_fraction_of_a_cycle_whatever_its_phase_and_rate(spread: float) -> None:
    found = [
        (seen(phase, true=true, given=true + spread * off, spread=spread), phase, true)
        for phase, true, off in differences(1)
    ]
    errors = np.array([error(phase, mark, true) for mark, phase, true in found])
    assert np.abs(errors).max() < 10e-6
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(expected_uncertainty(RATE), rel=0.15)
    stated = np.array([mark.uncertainty for mark, _, _ in found if mark is not None])
    assert np.mean(np.abs(errors) < 2.0 * stated) > 0.9
    assert np.sqrt(np.mean(stated**2)) == pytest.approx(expected_uncertainty(RATE), rel=0.2)


def test_clocks_that_agree_are_aligned_within_the_gaps_of_the_golden_ratio() -> None:
    """The widest gap between 89 phases is 1 / 76 of a cycle (three-gap theorem), and 1 / 73 with whole ticks."""
    phases = np.random.default_rng(2).uniform(0.0, 1.0 / RATE, 100)
    errors = [error(float(phase), seen(float(phase), true=1.0, given=1.0, spread=1e-9), 1.0) for phase in phases]
    assert np.abs(errors).max() < 0.5 / 73.0 / RATE + 1e-9


@pytest.mark.parametrize("timebase", [20e6, 80e6, 100e6])
@pytest.mark.parametrize("rate", [250.0, 1000.0, 4000.0, 8000.0])
def test_a_counter_outputs_the_pulses_without_rounding(rate: float, timebase: float) -> None:
    for pulses in (golden_pulses(rate), observation_pulses(rate)):
        ticks = timebase * np.array([pulses.delay, pulses.high, pulses.low])
        np.testing.assert_allclose(ticks, np.rint(ticks), atol=1e-6)


@pytest.mark.parametrize("rate", [250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0])
def test_the_pulses_before_a_run_take_little_time(rate: float) -> None:
    """The buffer of the output holds 2 s of drive in addition to the lead."""
    pulses = golden_pulses(rate)
    assert pulses.end < 1.6
    assert pulses.number > 20


@pytest.mark.parametrize("rough", [-0.006, 0.0, 0.006])
def test_a_rough_offset_to_half_a_pulse_is_enough(rough: float) -> None:
    assert abs(error(1e-4, seen(1e-4, rough=rough))) < 8e-6


def test_lost_values_cost_their_edges_only() -> None:
    assert abs(error(1e-4, seen(1e-4, lost=slice(700, 1100)))) < 20e-6
    # all of the later edges
    assert seen(1e-4, lost=slice(1000, None)) is None


def test_a_beam_that_is_not_switched_marks_nothing() -> None:
    time = np.arange(2000) / RATE
    rate = Rate(1.0, UNSURE)
    assert marked_point(golden_pulses(RATE), time, np.ones(2000, np.bool_), rate, 0.0) is None
    assert marked_point(golden_pulses(RATE), time, time < 0.1, rate, 0.0) is None


SPACING = observation_pulses(RATE).spacing


def free(
    seconds: float, phase: float, *, true: float = SENSOR, jitter: float = 0.0, begin: float = 1e6
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Times and beam of a sensor, on for weeks, under pulses between the runs; exposures scatter by `jitter` [s]."""
    index = np.arange(round(seconds * RATE))
    at = true * index / RATE + phase + jitter * np.random.default_rng(3).standard_normal(index.size)
    return begin + index / RATE, np.mod(at, SPACING) >= observation_pulses(RATE).high


@pytest.mark.parametrize(("seconds", "largest"), [(5.0, 1e-6), (10.0, 0.3e-6), (20.0, 0.1e-6)])
def test_pulses_give_the_rate_to_a_fraction_of_a_ppm(seconds: float, largest: float) -> None:
    """10 us over 30 s are 0.3 ppm."""
    errors: list[float] = []
    stated: list[float] = []
    for phase, true, _ in list(differences(4))[:40]:
        rate = pulse_rate(SPACING, *free(seconds, phase, true=true), 1.0)
        assert rate is not None
        errors.append(rate.value - true)
        stated.append(rate.uncertainty)
    assert np.mean(np.abs(errors) < 2.0 * np.array(stated)) > 0.9
    for found in (errors, stated):
        assert np.sqrt(np.mean(np.square(found))) < largest


@pytest.mark.parametrize("jitter", [2e-6, 20e-6])
def test_jitter_of_the_sensor_is_in_the_uncertainty_of_the_rate(jitter: float) -> None:
    rate = pulse_rate(SPACING, *free(10.0, 0.003, jitter=jitter), 1.0)
    assert rate is not None
    assert abs(rate.value - SENSOR) < 2.0 * rate.uncertainty < 2.5e-6


def test_a_hand_in_the_beam_does_not_change_the_rate() -> None:
    time, is_lit = free(10.0, 0.002)
    is_lit[20_050:22_017] = False
    is_lit[30_011:30_030] = False
    rate = pulse_rate(SPACING, time, is_lit, 1.0)
    assert rate is not None
    assert abs(rate.value - SENSOR) < 0.2e-6
    # waved about all the time
    is_lit[::23] = False
    assert pulse_rate(SPACING, time, is_lit, 1.0) is None


def test_few_pulses_or_none_give_no_rate() -> None:
    assert pulse_rate(SPACING, *free(0.05, 0.002), 1.0) is None
    time, is_lit = free(10.0, 0.002)
    assert pulse_rate(SPACING, time, np.ones_like(is_lit), 1.0) is None
    assert pulse_rate(SPACING, time[:0], is_lit[:0], 1.0) is None


def test_a_rate_is_less_certain_when_it_is_old_and_more_certain_when_measured_twice() -> None:
    old = Rate(SENSOR, 0.1e-6).aged(-1000.0)
    assert old.value == SENSOR
    assert 1e-6 < old.uncertainty < 5e-6
    both = Rate(1.0, 3e-6).combined(Rate(1.0 + 25e-6, 4e-6))
    assert both.value == pytest.approx(1.0 + 9e-6, abs=1e-12)
    assert both.uncertainty == pytest.approx(2.4e-6)
