"""Running gain: the number of evaluations, and the same uncertainty as that of the result."""

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest

from bench.analysis import error_curve, remaining_transient, rounding, sensor_uncertainty
from bench.analysis.error_curve import Harmonics
from bench.analysis.gain import SteadyPeak, gain
from bench.analysis.peak_readings import PeakReadings
from bench.analysis.rounding import FittedPeak
from bench.analysis.running_gain import CHANGED, RunningGain, shared_draws
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.sensor_uncertainty import SensorUncertainty

SENSORS = SensorUncertainty(SensorAccuracy(), (0.2, 0.2))
PHASES = np.arange(32) * (2.0 * np.pi / 32)
SHARED = shared_draws()


def peak(drift: float, lag: float = 0.0) -> SteadyPeak:
    """Steady peak of two storeys that move as sines and differ by `drift` [m]."""
    first, second = 0.6 * drift * np.cos(PHASES - lag), 1.6 * drift * np.cos(PHASES)
    weights = np.cos(np.outer(PHASES, np.arange(1, 6))).sum(axis=1) / 16.0
    swings = (1.2 * drift, 3.2 * drift)
    lasers = (float(first[0]), float(second[0]))
    zero = np.stack((first, second))
    return SteadyPeak(
        drift,
        1e-6,
        1e-6,
        0.001,
        1.2,
        0.0,
        PeakReadings(drift, 1.0, lasers, (0, 0), zero, swings, False, weights),
        24,
    )


def checked(bare: SteadyPeak, waves: float) -> SteadyPeak:
    """The peak with the harmonics that a linearity error of `waves` over the range causes."""
    checks = list[Harmonics]()
    for readings in bare.readings.zero:
        error = 1.6e-4 * np.sin(2.0 * np.pi * waves * readings / 0.2 + 0.7)
        checks.append(Harmonics(readings, np.fft.fft(error)[2:10].conj() / 16.0, np.full(8, 5e-7)))
    return replace(bare, checks=(checks[0], checks[1]))


BARE = checked(peak(0.02), 1.5)


def test_a_steady_motion_evaluates_the_linearity_once_and_a_settling_one_at_every_change() -> None:
    drifts = [0.01 * (1.0 + 0.2 * 0.8**k) for k in range(40)]
    running = RunningGain(BARE, SENSORS, SHARED)
    with patch.object(sensor_uncertainty, "linearity_errors", wraps=sensor_uncertainty.linearity_errors) as evaluated:
        for drift in drifts[20:]:
            running.of(peak(drift))
        assert evaluated.call_count == 2, "both lasers once"
        for drift in drifts:
            running.of(peak(drift))
        assert evaluated.call_count <= 2 + 2 * 20


@pytest.mark.parametrize("waves", [0.5, 1.5, 3.0, 6.0])
@pytest.mark.parametrize("change", [0.9 * CHANGED, -0.9 * CHANGED])
@pytest.mark.parametrize("drift", [0.002, 0.01, 0.03])
def test_the_uncertainty_of_a_changed_motion_is_that_of_the_result_to_a_hundredth(
    drift: float, change: float, waves: float
) -> None:
    bare = checked(peak(0.02), waves)
    running = RunningGain(bare, SENSORS, SHARED)
    running.of(peak(drift))
    changed = peak(drift * (1.0 + change), lag=0.2 * change)
    with patch.object(sensor_uncertainty, "linearity_errors") as evaluated:
        found = running.of(changed)
    assert not evaluated.called
    expected = gain(changed, bare, SENSORS)
    assert found.alpha_2 == expected.alpha_2
    assert found.uncertainty == pytest.approx(expected.uncertainty, rel=0.01)


def fitted(found: SteadyPeak) -> SteadyPeak:
    """The peak with the harmonics of its readings, so that the variance due to their resolution is evaluated."""
    harmonics = np.zeros((2, 4, 6), dtype=np.complex128)
    harmonics[:, :, 1] = (0.5 * np.array(found.readings.swings))[:, None]
    return replace(found, readings=replace(found.readings, fitted=FittedPeak(harmonics, 0.0, 5)))


@pytest.mark.parametrize("change", [0.9 * CHANGED, -0.9 * CHANGED])
@pytest.mark.parametrize("drift", [0.002, 0.01, 0.03])
def test_the_resolution_is_evaluated_again_only_after_a_change(drift: float, change: float) -> None:
    bare = fitted(BARE)
    running = RunningGain(bare, SENSORS, SHARED)
    running.of(fitted(peak(drift)))
    nearby, further = (fitted(peak(drift * (1.0 + each))) for each in (change, 5.0 * change))
    with patch.object(rounding, "_values", wraps=rounding._values) as evaluated:
        found = running.of(nearby)
        assert not evaluated.called
        running.of(further)
        assert evaluated.called
    assert found.uncertainty == pytest.approx(gain(nearby, bare, SENSORS).uncertainty, rel=0.01)


def test_a_further_change_or_another_side_is_evaluated_again() -> None:
    running = RunningGain(BARE, SENSORS, SHARED)
    running.of(peak(0.01))
    for other in (peak(0.0104), peak(0.0104, lag=0.1), replace(BARE, readings=replace(BARE.readings, sign=-1.0))):
        assert running.of(other).uncertainty == pytest.approx(gain(other, BARE, SENSORS).uncertainty, rel=1e-9)


def test_the_modes_of_a_transient_are_computed_once_for_each_number_of_cycles() -> None:
    random = np.random.default_rng(3)
    with patch.object(np.linalg, "pinv", wraps=np.linalg.pinv) as inverted:
        for _ in range(20):
            series = 0.01 * (1.0 + 0.9 ** np.arange(13) + 1e-4 * random.standard_normal(13))
            remaining_transient.remaining_transient(series, 11)
    assert inverted.call_count <= 1 + 5, "the grid, and few refinements of it"


def test_a_campaign_of_many_frequencies_evaluates_its_checks_once_and_at_most_so_many() -> None:
    """A sweep over 50 frequencies: a look takes milliseconds, and memory does not grow with their number squared."""
    bares = [checked(peak(0.01 + 0.0005 * k), 1.5) for k in range(50)]
    checks = tuple(each.checks for each in bares if each.checks is not None)
    error_curve.posterior.cache_clear()
    sizes = list[int]()
    for drift in (0.01, 0.02, 0.03):
        # the plan hands its sensors over anew at every look
        running = RunningGain(bares[-1], replace(SENSORS, checks=checks), SHARED)
        running.of(peak(drift))
        sizes.append(error_curve.posterior.cache_info().misses)
    assert sizes == [2, 2, 2], "both lasers once"
    largest = error_curve.widest([both[1] for both in checks])
    assert [each.swing for each in largest] == [both[1].swing for both in checks[-error_curve.MOST :]]
    assert error_curve.widest([both[0] for both in checks[:4]]) == [both[0] for both in checks[:4]]
