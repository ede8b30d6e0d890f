"""Correction of readings for the linearity errors that a check of the lasers found."""

from dataclasses import replace
from math import tau

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from bench.analysis.error_curve import Checks, Harmonics
from bench.analysis.reading_correction import ReadingCorrection
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.signals import ACCELERATION, DISPLACEMENT, DRIFT, LASER_1, LASER_2, SIGNALS, U1
from tests.bench.calibrated import calibration

SENSORS = SensorUncertainty(SensorAccuracy(), (0.2, 0.2))
WAVES = 2.0
SWINGS = 0.04, 0.06
PHASE = np.arange(64) * (tau / 64)


def error(x: np.ndarray, laser: int) -> np.ndarray:
    """Error of laser 0 or 1 [m] at a reading relative to the rest position, relative to the error there."""
    return 1.6e-4 * (np.sin(tau * WAVES * x / 0.2 + 1.0 + laser) - np.sin(1.0 + laser))


def checked() -> SensorUncertainty:
    found = list[Harmonics]()
    for laser, swing in enumerate(SWINGS):
        readings = swing * np.sin(PHASE)
        spectrum = np.fft.fft(error(readings, laser))[2:11].conj() / 32.0
        found.append(Harmonics(readings, spectrum, np.full(9, 1e-7)))
    return SENSORS.corrected_by((found[0], found[1]))


def motion() -> tuple[np.ndarray, np.ndarray]:
    """True signals, and those that the lasers show."""
    true = np.zeros((400, len(SIGNALS)))
    time = np.arange(400) / 400.0
    true[:, ACCELERATION], true[:, DISPLACEMENT] = np.sin(tau * 3.0 * time), 0.01 * np.sin(tau * 2.0 * time)
    true[:, LASER_1], true[:, LASER_2] = 0.03 * np.sin(tau * 5.0 * time), -0.05 * np.sin(tau * 4.0 * time)
    seen = true.copy()
    for column, laser in ((LASER_1, 0), (LASER_2, 1)):
        seen[:, column] += error(true[:, column], laser)
    for each in (true, seen):
        each[:, U1], each[:, DRIFT] = each[:, LASER_1] - each[:, DISPLACEMENT], each[:, LASER_2] - each[:, LASER_1]
    return true, seen


def test_readings_u1_and_drift_lose_all_but_a_change_of_scale() -> None:
    true, seen = motion()
    before = seen.copy()
    found = ReadingCorrection(checked())(seen)
    np.testing.assert_array_equal(seen, before)
    for column in (ACCELERATION, DISPLACEMENT):
        np.testing.assert_array_equal(found[:, column], seen[:, column])
    for column in (LASER_1, LASER_2):
        off, left = (each[:, column] - true[:, column] for each in (seen, found))
        scale = true[:, column] @ left / (true[:, column] @ true[:, column])
        assert np.std(left - scale * true[:, column]) < 0.1 * np.std(off)
        assert np.std(left) < np.std(off)
    np.testing.assert_allclose(found[:, DRIFT], found[:, LASER_2] - found[:, LASER_1], atol=1e-15)
    np.testing.assert_allclose(found[:, U1], found[:, LASER_1] - found[:, DISPLACEMENT], atol=1e-15)


def test_a_missing_reading_stays_missing_and_the_rest_position_stays_zero() -> None:
    signals = np.zeros((3, len(SIGNALS)))
    signals[1, [LASER_2, DRIFT]] = np.nan
    found = ReadingCorrection(checked())(signals)
    np.testing.assert_allclose(found, signals, atol=1e-15)


def test_nothing_is_corrected_without_a_check_or_calibration() -> None:
    _, seen = motion()
    assert ReadingCorrection(SENSORS)(seen) is seen
    assert ReadingCorrection(SENSORS.corrected_by(None))(seen) is seen
    assert ReadingCorrection(SENSORS.checked_by(checked().checks[0]))(seen) is seen


@pytest.mark.parametrize("checks", [None, checked().checks[0]])
def test_a_calibration_is_continued_beyond_its_readings_and_left_alone_within(checks: Checks | None) -> None:
    span, rest, places = 0.035, 0.002, np.linspace(-1.0, 1.0, 301)
    fitted = [
        chebyshev.chebfit(places, error(span * places - rest, laser) + 0.002 * span * places, 20) for laser in (0, 1)
    ]
    found = calibration(-span, span, rest, uncertainty=1e-7)
    curves = [curve.model_copy(update={"error": tuple(each)}) for curve, each in zip(found.lasers, fitted, strict=True)]
    found = found.model_copy(update={"laser_1": curves[0], "laser_2": curves[1]})
    true, _ = motion()
    seen = true.copy()
    for laser, column in enumerate((LASER_1, LASER_2)):
        x = true[:, column]
        seen[:, column] = curves[laser].corrected(x + error(x, laser) + 0.002 * x + rest) - rest
    seen[:, U1], seen[:, DRIFT] = seen[:, LASER_1] - seen[:, DISPLACEMENT], seen[:, LASER_2] - seen[:, LASER_1]
    corrected = ReadingCorrection(replace(SENSORS, calibration=found).corrected_by(checks))(seen)
    np.testing.assert_array_equal(corrected[:, LASER_1], seen[:, LASER_1])
    beyond = np.abs(true[:, LASER_2]) > span + abs(rest)
    within = np.abs(seen[:, LASER_2]) < span - abs(rest)
    np.testing.assert_array_equal(corrected[within], seen[within])
    off, left = (each[beyond, LASER_2] - true[beyond, LASER_2] for each in (seen, corrected))
    level = np.mean((seen - true)[within, LASER_2])
    assert np.sqrt(np.mean((left - level) ** 2)) < 0.1 * np.sqrt(np.mean((off - level) ** 2))
    np.testing.assert_allclose(corrected[:, DRIFT], corrected[:, LASER_2] - corrected[:, LASER_1], atol=1e-15)
