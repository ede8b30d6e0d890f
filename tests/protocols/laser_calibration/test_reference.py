"""The error of the table's displacement sensor, found by the accelerometer, against errors that are known exactly."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from protocols.laser_calibration.curves import Pass, fit_curve
from protocols.laser_calibration.polynomial import PLACES
from protocols.laser_calibration.reference import ReferenceCurve, fit_reference

Array = NDArray[np.float64]

PHASES = np.arange(256) * 2.0 * np.pi / 256
LINEARITY, AMPLITUDE = 5e-4, 0.05
LIMIT = LINEARITY * 2.0 * AMPLITUDE
SCALE, GRAVITY = 1.004, 9.81


def bent(waves: float, turn: float = 0.7) -> Callable[[Array], Array]:
    """An error as large as the data sheet allows, with so many periods over the span, at a reading without it."""
    return lambda x: LIMIT * np.sin(np.pi * waves * x / AMPLITUDE + turn)


def made(
    error: Callable[[Array], Array], *, noise: float = 0.0, tilt: Callable[[Array], Array] | None = None, seed: int = 1
) -> list[Pass]:
    """Slow sines with a third harmonic. The displacement sensor has a scale, a delay and `error`; the accelerometer a
    scale, `noise` [m/s2] in the mean cycle, and measures the `tilt` [rad] of the table at its places [m].
    """
    random = np.random.default_rng(seed)
    found: list[Pass] = []
    for number in range(8):
        omega, amplitude = 4.0 if number < 4 else 8.0, AMPLITUDE * (1.0 - 0.01 * number)
        x = amplitude * (np.sin(PHASES) + 0.01 * np.sin(3.0 * PHASES + 0.5))
        v = omega * amplitude * (np.cos(PHASES) + 0.03 * np.cos(3.0 * PHASES + 0.5))
        false = noise * random.standard_normal(x.size) + (0.0 if tilt is None else GRAVITY * tilt(x))
        orders = np.arange(1, x.size // 2 + 1)
        spectrum = np.fft.rfft(false)
        spectrum[0] = 0.0
        spectrum[1:] /= -((orders * omega) ** 2)
        spectrum[22:] = 0.0
        integrated = 0.997 * x + np.fft.irfft(spectrum, x.size)
        late = SCALE * x - 3e-4 * v
        shown = late + error(late)
        found.append(Pass(omega, shown, v, (x, x), integrated))
    return found


def missed(curve: ReferenceCurve, error: Callable[[Array], Array]) -> float:
    """Rms difference between the curve and the true error minus the straight line through its ends [m]."""
    places = np.linspace(curve.low, curve.high, PLACES.size)
    without = places - error(places - error(places))
    true = places - without
    line = np.interp(places, [curve.low, curve.high], true[[0, -1]])
    return float(np.std(chebyshev.chebval(PLACES, curve.error) - (true - line)))


@pytest.mark.parametrize("waves", [0.5, 1.3, 2.0, 4.0])
def test_its_error_is_found_whatever_its_shape(waves: float) -> None:
    passes = made(bent(waves), noise=1e-4)
    curve = fit_reference(passes, LINEARITY)
    assert curve.corrects
    assert curve.plausible
    assert curve.remaining < 0.05 * LIMIT
    assert missed(curve, bent(waves)) < 3.0 * curve.uncertainty


def test_the_uncertainty_is_the_error_of_repetition() -> None:
    ratios = []
    for seed in range(12):
        error = bent(1.5, turn=0.2 * seed)
        curve = fit_reference(made(error, noise=3e-4, seed=seed), LINEARITY)
        ratios.append(missed(curve, error) / curve.uncertainty)
    assert 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.3


def test_a_sensor_without_an_error_is_known_as_well_as_the_noise_allows() -> None:
    for seed in range(4):
        curve = fit_reference(made(np.zeros_like, noise=1e-3, seed=seed), LINEARITY)
        assert missed(curve, np.zeros_like) < 2.0 * curve.uncertainty
        assert 1e-8 < curve.uncertainty < 1e-6


def test_a_table_that_tilts_widens_the_uncertainty() -> None:
    """50 urad of tilt are more than a wavy guide has, and 5 mrad those of one that is loose."""
    for size, corrects in ((50e-6, True), (5e-3, False)):
        passes = made(bent(1.5), tilt=lambda x, size=size: size * np.cos(np.pi * 2.0 * x / AMPLITUDE))
        curve = fit_reference(passes, LINEARITY)
        assert curve.corrects == corrects
        assert missed(curve, bent(1.5)) < 2.0 * curve.uncertainty
        if not corrects:
            assert curve.corrected(passes) == passes
            assert curve.remaining == pytest.approx(LINEARITY * (curve.high - curve.low))


def test_a_sensor_that_is_taken_to_be_linear_is_neither_corrected_nor_doubted() -> None:
    passes = made(bent(1.5))
    curve = fit_reference(passes, 0.0)
    assert (curve.corrects, curve.remaining, curve.plausible) == (False, 0.0, True)
    assert curve.corrected(passes) == passes


def test_an_error_beyond_the_data_sheet_is_not_plausible() -> None:
    assert not fit_reference(made(lambda x: 5.0 * bent(1.5)(x), noise=1e-4), LINEARITY).plausible


def test_the_scale_stays_as_it_is_and_the_lasers_are_compared_with_the_true_motion() -> None:
    passes = made(bent(1.5))
    corrected = fit_reference(passes, LINEARITY).corrected(passes)
    for before, after in zip(passes, corrected, strict=True):
        assert after.ratio == pytest.approx(before.ratio, abs=2.0 * LINEARITY)
        assert after.integrated is before.integrated
    # lasers without an error: all that is left is the scale of the sensor, which its own error changes by the slope
    curves = [fit_curve(each, 0, 0.0) for each in (passes, corrected)]
    bends = [float(np.abs(curve.error[2:]).sum()) for curve in curves]
    assert bends[1] < 0.02 * bends[0]
