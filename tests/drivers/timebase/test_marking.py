"""Offsets of a sensor's clock from pulses that switch its beam off, against clocks known exactly."""

import numpy as np
import pytest

from drivers.timebase.marking import Mark, expected_uncertainty, golden_pulses, marked_point

RATE = 4000.0
SENSOR = 1.0 + 37e-6
"""Seconds of the sample clock per second of the sensor."""


def seen(offset: float, *, given: float = SENSOR, rough: float = 0.002, lost: slice | None = None) -> Mark | None:
    """The point found, where the sensor's second 0 is at `offset` of the sample clock and its rate is taken as
    `given`."""
    pulses = golden_pulses(RATE)
    time = np.arange(-400, round((pulses.end + 0.05) * RATE)) / RATE
    at = offset + SENSOR * time
    since = np.mod(at - pulses.delay, pulses.high + pulses.low)
    dark = np.logical_and(since < pulses.high, np.logical_and(at >= pulses.delay, at < pulses.end))
    if lost is not None:
        kept = np.delete(np.arange(time.size), lost)
        time, dark = time[kept], dark[kept]
    return marked_point(pulses, time, ~dark, given, offset + rough)


def error(offset: float, mark: Mark | None) -> float:
    assert mark is not None
    return mark.seconds - (offset + SENSOR * mark.time)


@pytest.mark.parametrize("given", [SENSOR, SENSOR + 60e-6, 1.0])
def test_the_clock_is_found_to_a_fraction_of_a_cycle_whatever_its_phase(given: float) -> None:
    phases = np.random.default_rng(1).uniform(0.0, 1.0 / RATE, 200)
    marks = [seen(float(phase), given=given) for phase in phases]
    errors = np.array([error(float(phase), mark) for phase, mark in zip(phases, marks, strict=True)])
    # a 30th of a cycle of 250 us lies between the bounds
    assert np.abs(errors).max() < 10e-6
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(expected_uncertainty(RATE), rel=0.1)
    stated = np.array([mark.uncertainty for mark in marks if mark is not None])
    assert np.mean(np.abs(errors) < 2.0 * stated) > 0.9
    assert np.sqrt(np.mean(stated**2)) == pytest.approx(expected_uncertainty(RATE), rel=0.2)


@pytest.mark.parametrize("rough", [-0.006, 0.0, 0.006])
def test_a_rough_offset_to_half_a_pulse_is_enough(rough: float) -> None:
    assert abs(error(1e-4, seen(1e-4, rough=rough))) < 8e-6


def test_lost_values_cost_their_edges_only() -> None:
    assert abs(error(1e-4, seen(1e-4, lost=slice(700, 1100)))) < 20e-6
    # all of the later edges
    assert seen(1e-4, lost=slice(1000, None)) is None


def test_a_beam_that_is_not_switched_marks_nothing() -> None:
    time = np.arange(2000) / RATE
    assert marked_point(golden_pulses(RATE), time, np.ones(2000, np.bool_), 1.0, 0.0) is None
    assert marked_point(golden_pulses(RATE), time, time < 0.1, 1.0, 0.0) is None
