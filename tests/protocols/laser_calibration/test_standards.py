"""Standards of length of a laser calibration: stated uncertainties against errors of drawn curves."""

from math import hypot, sqrt, tau

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from bench.analysis.sensor_accuracy import SensorAccuracy
from protocols.laser_calibration.curves import ErrorCurve
from protocols.laser_calibration.standards import IMPLAUSIBLE, Standards, standards

WHOLE, HALF = 0.2, 0.0465
LIMIT = SensorAccuracy().laser_linearity * WHOLE


def curve(error: np.ndarray, rest: float) -> ErrorCurve:
    return ErrorCurve(
        low=rest - HALF,
        high=rest + HALF,
        error=error,
        delay=0.0,
        scores=np.full(12, 1e-6),
        residual=5e-7,
        without=np.zeros((8, 3)),
        finest=np.zeros((8, 13)),
        delays=np.zeros(8),
    )


def drawn(waves: float, random: np.random.Generator, bent: np.ndarray) -> tuple[ErrorCurve, float]:
    """A curve with a sine, relative to a displacement sensor with the error `bent`, and the slope of the sine."""
    phase, rest = random.uniform(0.0, tau), random.uniform(-0.002, 0.002)

    def sine(place: np.ndarray) -> np.ndarray:
        return LIMIT * np.sin(tau * waves * (rest + HALF * place) / WHOLE + phase)

    found = chebyshev.chebinterpolate(sine, 12)
    ends = sine(np.array([-1.0, 1.0]))
    return curve(found + bent, rest), float(ends[1] - ends[0]) / (2.0 * HALF)


@pytest.mark.parametrize("waves", [(1.0, 1.0), (2.0, 2.0), (0.5, 2.0), (3.0, 6.0)])
def test_the_scale_of_the_lasers_is_as_uncertain_as_stated(waves: tuple[float, float]) -> None:
    random, seen, u = np.random.default_rng(7), list[float](), list[float]()
    for _ in range(150):
        bent = np.append([0.0, 0.0], 5e-5 * random.standard_normal(11))
        one, two = (drawn(float(random.uniform(*waves)), random, bent) for _ in range(2))
        found = standards((one[0], two[0]), SensorAccuracy(laser_mismatch=0.0), (WHOLE, WHOLE))
        seen.append(0.5 * (one[1] + two[1]))
        u.append(found.lasers)
    ratio = sqrt(np.mean(np.square(seen)) / np.mean(np.square(u)))
    # independent errors at both ends give 1.41 for one wave and 0.31 for two
    exact = 1.0 - np.mean([np.cos(tau * n * 2.0 * HALF / WHOLE) for n in np.linspace(*waves, 99)])
    assumed = LIMIT / (2.0 * HALF) / sqrt(2.0)
    assert np.mean(np.square(seen)) == pytest.approx(exact * assumed**2, rel=0.3)
    assert abs(np.log(ratio)) < abs(np.log(sqrt(exact))) + 0.02 if waves[0] == waves[1] else 0.9 < ratio < 1.15


def test_lasers_without_errors_are_exact_but_for_the_scale() -> None:
    one = curve(np.zeros(4), 0.0)
    found = standards((one, one), SensorAccuracy(laser_linearity=0.0, laser_mismatch=0.001), (WHOLE, WHOLE))
    # two scales with a difference of 0.1 %, of which the mean has half
    assert found.lasers == pytest.approx(0.0005)
    assert found.apart == pytest.approx(0.001)


def test_a_plausible_accelerometer_is_a_standard_and_another_one_is_not() -> None:
    given = Standards(lasers=0.003, table=0.004)
    ratio, u = given.combined(1.0 / 1.005)
    # weights 1 / u^2
    assert ratio == pytest.approx(1.0 + 0.005 * 9.0 / 25.0)
    assert u == pytest.approx(0.003 * 0.004 / hypot(0.003, 0.004))
    # its weight decreases with the scatter of the repetitions, which are not part of the result
    assert given.combined(1.0 / 1.005, 0.012)[0] == pytest.approx(1.0 + 0.005 * 9.0 / 169.0)
    for other in (1.0 + 1.01 * IMPLAUSIBLE * 0.005, 1.0 - 1.01 * IMPLAUSIBLE * 0.005, float("nan")):
        assert given.combined(other) == (1.0, 0.003)
    assert Standards(0.0, 0.0).combined(1.2) == (1.0, 0.0)
