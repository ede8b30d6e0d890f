"""Zero of the drift of a transient, from motions whose drift is known."""

from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.analysis.drift_zero import PLACES, drift_zero
from bench.analysis.linearity import LinearFrame
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.signals import DISPLACEMENT, DRIFT, LASER_1, LASER_2
from protocols.earthquake.observation import observe
from protocols.earthquake.uncertainty import with_better_zero
from sim.specimen import Specimen
from tests.benchmarks.coverage_record import motion_under
from tests.benchmarks.coverage_sensors import RATE, REST

Array = NDArray[np.float64]

STEP = 5e-5
"""Resolution of the lasers [m]."""

RANDOM = np.random.default_rng(4)
OFFSETS = RANDOM.uniform(-0.5, 0.5, (40, 2)) * STEP


@lru_cache(maxsize=8)
def moved(beta: float | None, *, grounded: bool = True) -> Array:
    """Signals without errors under a record that lets the block rock, after a rest, shape (n, 6)."""
    motion = motion_under("l-aquila", beta)
    x, u1, u2 = motion.x, motion.u1, motion.u2
    lasers = (x + u1, x + u2) if grounded else (u1, u2)
    return np.concatenate((np.zeros((REST, 6)), np.column_stack((motion.a, x, u1, u2 - u1, *lasers))))


def read(signals: Array, offsets: Array, step: float = STEP) -> Array:
    """The signals with lasers that round their readings, beginning at `offsets` [m] from a step, and their zero at
    rest.
    """
    found = signals.copy()
    for column, offset in zip((LASER_1, LASER_2), offsets, strict=True):
        shown = np.round((signals[:, column] + offset) / step) * step
        found[:, column] = shown - shown[:REST].mean()
    found[:, DRIFT] = found[:, LASER_2] - found[:, LASER_1]
    return found


def frame(stiffer: float = 1.0, *, grounded: bool = True) -> LinearFrame:
    whole = Specimen().frame
    changed = whole.model_copy(update={"k1": stiffer * whole.k1, "k2": stiffer * whole.k2})
    return LinearFrame(Specimen(frame=changed).bare(), grounded)


@pytest.mark.parametrize("stiffer", [1.0, 1.1])
@pytest.mark.parametrize("grounded", [True, False])
@pytest.mark.parametrize("beta", [None, 0.25, 0.97])
def test_a_shifted_zero_is_found_whatever_table_and_block_do(
    beta: float | None, grounded: bool, stiffer: float
) -> None:
    signals = moved(beta, grounded=grounded).copy()
    signals[:, [DRIFT, LASER_2]] += 3e-5
    found = drift_zero(signals, frame(stiffer, grounded=grounded), RATE)
    assert found is not None
    assert found.drift == pytest.approx(3e-5, abs=2e-7)


@pytest.mark.parametrize("beta", [None, 0.97])
def test_in_motion_rounding_averages_out(beta: float | None) -> None:
    signals, true = moved(beta), np.diff(OFFSETS - np.round(OFFSETS / STEP) * STEP)[:, 0]
    found = [drift_zero(read(signals, offsets), frame(), RATE) for offsets in OFFSETS]
    errors = np.array([each.drift if each else np.nan for each in found]) - true
    assert np.std(true) > 0.3 * STEP
    assert np.abs(errors).max() < 0.01 * STEP


def test_the_readings_have_the_mean_error_of_the_motion() -> None:
    """For errors that are any function of the reading."""
    signals = moved(0.97)
    found = drift_zero(signals, frame(), RATE)
    assert found is not None
    assert found.readings.shape == (2, PLACES)
    during = np.abs(signals[:, DRIFT]) >= 0.05 * np.abs(signals[:, DRIFT]).max()
    first, last = np.flatnonzero(during)[[0, -1]]
    for column, readings in zip((LASER_1, LASER_2), found.readings, strict=True):
        moving = signals[first : last + 1, column]
        weight = np.hanning(moving.size)
        for power in (1, 2, 3):
            scale = np.abs(moving).max() ** power
            assert np.mean(readings**power) / scale == pytest.approx(
                np.average(moving**power, weights=weight) / scale, abs=3e-3
            )


def test_the_peak_is_free_of_the_rounding_at_rest() -> None:
    signals, errors = moved(0.25), {True: [], False: []}
    true = np.abs(signals[:, DRIFT]).max()
    noise = 1e-6 * np.random.default_rng(1).standard_normal((len(signals), 6))
    for offsets in OFFSETS[:12]:
        seen = read(signals, offsets) + noise
        observed = observe(seen, REST, RATE, frame())
        assert observed.centred is not None
        assert observed.centred.zero is not None
        for momentum, peak in ((False, observed.drift), (True, observed.centred)):
            errors[momentum].append(peak.peak.value - true)
    assert np.std(errors[False]) > 0.3 * STEP
    assert np.std(errors[True]) < 0.4 * np.std(errors[False])


@pytest.mark.parametrize(("resolution", "linearity", "momentum"), [(STEP, 0.0, True), (0.0, 0.0008, False)])
def test_of_both_zeros_the_one_with_the_smaller_uncertainty_is_used(
    resolution: float, linearity: float, momentum: bool
) -> None:
    """Rounding enters at rest alone; the least favourable linearity error is larger relative to a mean, here."""
    tests = [observe(moved(beta), REST, RATE, frame()) for beta in (None, 0.97)]
    accuracy = SensorAccuracy(laser_resolution=resolution, laser_linearity=linearity, laser_timing=0.0)
    sensors = SensorUncertainty(accuracy, (0.2, 0.2))
    chosen = with_better_zero(tests[0], tests[1], sensors, 2000, 1)
    for test, found in zip(tests, chosen, strict=True):
        assert found.drift is (test.centred if momentum else test.drift)
        assert found.u1 is test.u1


def test_missing_samples_are_bridged_as_long_as_they_are_few() -> None:
    signals = moved(None).copy()
    signals[:, DRIFT] += 3e-5
    signals[::97, DRIFT] = signals[::97, LASER_2] = np.nan
    found = drift_zero(signals, frame(), RATE)
    assert found is not None
    assert found.drift == pytest.approx(3e-5, abs=1e-6)
    signals[::20, DRIFT] = np.nan
    assert drift_zero(signals, frame(), RATE) is None
    assert drift_zero(np.full((500, 6), np.nan), frame(), RATE) is None


def test_a_motion_of_few_periods_has_none() -> None:
    assert drift_zero(moved(None)[: REST + 1000], frame(), RATE) is None


def test_on_the_ground_the_table_is_not_needed() -> None:
    signals = moved(None).copy()
    signals[:, DISPLACEMENT] = np.nan
    assert drift_zero(signals, frame(), RATE) is not None
