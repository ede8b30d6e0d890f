"""Linearity errors of unknown shape, against curves drawn by hand."""

from collections.abc import Callable
from math import tau

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from bench.analysis.error_curve import Harmonics
from bench.analysis.laser_calibration import LaserCurve
from bench.analysis.linearity import SMOOTH, Effect, expected_errors, linearity_errors

LIMIT, WHOLE = 0.00016, 0.2
PHASE = np.arange(64) * (tau / 64)
BARE, COUPLED = 0.040 * np.sin(PHASE), 0.012 * np.sin(PHASE) + 0.001 * np.sin(3.0 * PHASE)
SHARES = np.array([-1.0 / 0.05, 1.0 / 0.015])
NOISE = 5e-7


def peak(readings: np.ndarray) -> Effect:
    """Effect on the fundamental of a fitted cycle."""
    return Effect(readings, np.sin(PHASE) / 32.0)


def curve(waves: float, phase: float, x: np.ndarray) -> np.ndarray:
    return LIMIT * np.sin(tau * waves * x / WHOLE + phase)


def check(waves: float, phase: float, random: np.random.Generator) -> Harmonics:
    """Harmonics 2 to 10 of the reading of a pure sine."""
    spectrum = np.fft.fft(curve(waves, phase, BARE))[2:11].conj() / 32.0
    noise = NOISE * (random.standard_normal(9) + 1j * random.standard_normal(9))
    return Harmonics(BARE, spectrum + noise, np.full(9, NOISE))


@pytest.mark.parametrize("waves", [0.5, 1.0, 2.0, 4.0, 6.0, 10.0])
def test_without_a_check_no_curve_within_the_data_sheet_is_left_out(waves: float) -> None:
    effects = [peak(BARE), peak(COUPLED)]
    found = linearity_errors(effects, SHARES, LIMIT, WHOLE)
    stated = np.sqrt(SHARES @ found.moments @ SHARES)
    phases = np.arange(24) * (tau / 24)
    errors = [SHARES @ [each.weights @ curve(waves, phase, each.places) for each in effects] for phase in phases]
    assert np.abs(errors).max() <= 2.0 * stated


@pytest.mark.parametrize("waves", [0.7, 1.5, 3.0, 4.0, 6.0])
def test_harmonics_of_the_bare_frame_size_the_error(waves: float) -> None:
    effects, random = [peak(BARE), peak(COUPLED)], np.random.default_rng(5)
    worst = linearity_errors(effects, SHARES, LIMIT, WHOLE)
    off, sizes, numbers = [], [], []
    for phase in np.arange(24) * (tau / 24):
        found = linearity_errors(effects, SHARES, LIMIT, WHOLE, [check(waves, phase, random)])
        sizes.append(np.sqrt(SHARES @ found.moments @ SHARES))
        off.append(float(SHARES @ [each.weights @ curve(waves, phase, each.places) for each in effects]) / sizes[-1])
        numbers.append(found.waves)
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.15
    assert np.mean(np.abs(off) <= 2.0) >= 0.95
    assert np.mean(sizes) < 0.95 * np.sqrt(SHARES @ worst.moments @ SHARES)
    assert (np.mean(numbers) > SMOOTH) == (waves > 2.0)


@pytest.mark.parametrize("waves", [0.7, 1.5, 3.0, 4.0, 6.0])
def test_corrected_readings_keep_a_small_part_of_the_error_and_its_uncertainty(waves: float) -> None:
    effects, random = [peak(BARE), peak(COUPLED)], np.random.default_rng(5)
    raw, left, sizes, bounds = [], [], [], []
    for phase in np.arange(24) * (tau / 24):
        checks = [check(waves, phase, random)]
        raw.append(SHARES @ [each.weights @ curve(waves, phase, each.places) for each in effects])
        expected = SHARES @ [each.weights @ expected_errors(each.places, LIMIT, WHOLE, checks) for each in effects]
        left.append(raw[-1] - expected)
        for found, corrected in ((sizes, True), (bounds, False)):
            moments = linearity_errors(effects, SHARES, LIMIT, WHOLE, checks, corrected).moments
            found.append(np.sqrt(SHARES @ moments @ SHARES))
    assert np.sqrt(np.mean(np.square(left))) < 0.2 * np.sqrt(np.mean(np.square(raw)))
    assert np.mean(sizes) < 0.5 * np.mean(bounds)
    assert np.mean(np.abs(left) <= 2.0 * np.array(sizes)) >= 0.95


def test_of_a_curve_found_by_its_harmonics_only_a_straight_line_is_unknown() -> None:
    """Within the swing of the check, for waves that it resolves; the error at rest is subtracted."""
    random, x = np.random.default_rng(3), np.linspace(-0.038, 0.038, 39)
    straight = np.vander(x, 2)
    for phase in np.arange(8) * (tau / 8):
        found = expected_errors(np.append(x, 0.0), LIMIT, WHOLE, [check(3.0, phase, random)])
        assert abs(found[-1]) < 1e-15
        off = curve(3.0, phase, x) - found[:-1]
        off -= straight @ np.linalg.lstsq(straight, off, rcond=None)[0]
        assert np.std(off) < 0.03 * LIMIT


SPAN, REST = 0.08, 0.004
"""Half of the calibrated readings, and the reading at rest [m]; the readings of the laser are to WHOLE / 2."""


def calibrated(error: Callable[[np.ndarray], np.ndarray], noise: float, random: np.random.Generator) -> LaserCurve:
    """What a calibration with this standard uncertainty finds of an error curve of the reading."""
    nodes = SPAN * chebyshev.chebpts1(200)
    found = chebyshev.chebfit(nodes / SPAN, error(nodes), 20)
    found = found + noise * (2.0 / 20) ** 0.5 * random.standard_normal(21)
    return LaserCurve(
        sensor="drawn",
        lowest=-SPAN,
        highest=SPAN,
        rest=REST,
        error=tuple(found),
        uncertainty=noise,
        scale=1.0,
        delay=0.0,
        delay_uncertainty=0.0,
    )


@pytest.mark.parametrize(("waves", "left"), [(0.6, 0.01), (1.2, 0.02), (2.4, 0.1), (4.8, 0.4)])
def test_a_calibrated_curve_is_extrapolated_with_an_honest_uncertainty(waves: float, left: float) -> None:
    """A scale error of 0.4 % is part of the curve; 8 mm beyond the calibrated readings, waves of 42 mm and more."""
    random, off, sizes = np.random.default_rng(4), [], []
    for phase in np.arange(24) * (tau / 24):

        def error(x: np.ndarray, phase: float = float(phase)) -> np.ndarray:
            return curve(waves, phase, x) + 0.004 * x

        checks = [calibrated(error, NOISE, random).harmonics]
        for end, place in ((-SPAN, -SPAN - 0.008), (SPAN, SPAN + 0.008)):
            places = np.array([place, end])
            expected = np.diff(expected_errors(places - REST, LIMIT, WHOLE, checks))[0]
            effect = Effect(places - REST, np.array([-1.0, 1.0]))
            moments = linearity_errors([effect], np.ones(1), LIMIT, WHOLE, checks, corrected=True).moments
            off.append(np.diff(error(places))[0] - expected)
            sizes.append(moments[0, 0] ** 0.5)
    worst = linearity_errors([effect], np.ones(1), LIMIT, WHOLE).moments[0, 0] ** 0.5
    assert np.sqrt(np.mean(np.square(sizes))) < left * worst
    # none of these numbers of waves is one that is compared
    assert 0.4 < np.sqrt(np.mean(np.square(off) / np.square(sizes))) < 1.3
    assert np.mean(np.abs(off) <= 2.0 * np.array(sizes)) >= 0.85


def test_an_exactly_known_straight_error_is_continued() -> None:
    known = calibrated(lambda x: 0.003 * x + 1e-4, 0.0, np.random.default_rng(1)).harmonics
    places = np.array([-0.098, -SPAN, 0.0, SPAN, 0.098])
    found = expected_errors(places - REST, LIMIT, WHOLE, [known])
    np.testing.assert_allclose(np.diff(found), 0.003 * np.diff(places), atol=1e-3 * LIMIT)


def test_without_a_linearity_error_nothing_is_expected() -> None:
    assert not expected_errors(BARE, 0.0, WHOLE, [check(1.5, 0.3, np.random.default_rng(1))]).any()


def test_equal_motions_have_equal_errors() -> None:
    found = linearity_errors([peak(BARE), peak(BARE)], SHARES, LIMIT, WHOLE)
    first, second = found.draws(np.random.default_rng(1).standard_normal((2, 100)))
    # a matrix product may sum its rows in different orders, depending on the processor
    np.testing.assert_allclose(first, second, rtol=4.0 * np.finfo(float).eps)
    assert np.std(first) > 0.0
