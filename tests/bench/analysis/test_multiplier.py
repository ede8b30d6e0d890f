"""Multipliers from series of coefficients: against exact maps, and the coverage of their uncertainties."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from bench.analysis.multiplier import SHORTEST, dominant_multiplier, linear_part
from bench.config.model import BenchConfiguration
from sim.gain import predict_gain
from sim.return_map import images, jacobians, parameters, scales
from sim.specimen import Specimen
from sim.steady import Orbit
from sim.table_orbit import TablePeriod, table_orbit

Array = NDArray[np.float64]

AMPLITUDE = 1.01 * Specimen().uplift_acceleration
POINTS = [(15.0, 0.97), (12.5, 0.64), (13.0, 0.64), (16.0, 0.4), (15.6, 0.97)]


def orbit(omega: float, beta: float) -> Orbit:
    found = predict_gain(Specimen().coupled(beta), omega, AMPLITUDE).rocking
    assert found is not None
    return found.orbit


def near(transition: Array, pair: complex) -> Array:
    """Direction of the eigenvectors of `pair`."""
    values, vectors = np.linalg.eig(transition)
    direction = vectors[:, int(np.argmin(np.abs(values - pair)))].real
    return direction / np.linalg.norm(direction)


def iterated(step: Callable[[Array], Array], start: Array, cycles: int) -> Array:
    rows = [start]
    for _ in range(cycles):
        rows.append(step(rows[-1]))
    return np.array(rows)


@pytest.mark.parametrize(("omega", "beta"), POINTS)
def test_the_multipliers_of_the_exact_map_on_fixed_ground(omega: float, beta: float) -> None:
    """Also where the moduli of two pairs differ by 0.007 (15.6 rad/s); the start is 20 % off the slowest pair."""
    exact = orbit(omega, beta)
    q = parameters(exact.specimen, omega, AMPLITUDE)
    size = scales(q)[0]
    direction = near(jacobians(q, exact.section[None])[0] * size / size[:, None], exact.slowest)
    direction += 0.2 * np.random.default_rng(3).standard_normal(6) / np.sqrt(6.0)
    start = exact.section + 1e-3 * size * direction
    found = dominant_multiplier(iterated(lambda x: images(q, x[None])[0][0], start, 80) / size)
    assert found is not None
    assert found.modulus == pytest.approx(exact.multiplier, abs=1e-3)
    assert found.angle == pytest.approx(float(np.angle(exact.slowest)), abs=np.radians(0.1))


@pytest.mark.parametrize(("omega", "beta"), POINTS[:3])
def test_the_multipliers_of_the_bench(omega: float, beta: float) -> None:
    """On the table, driven by a voltage, from a deviation of 3 % along the slowest pair."""
    shaker = BenchConfiguration().simulated_shaker
    exact = table_orbit(orbit(omega, beta), shaker, 5)
    period = TablePeriod(Specimen().coupled(beta), shaker, omega)
    size = period.scales(exact.start)
    jacobian = period.jacobian(exact.start, exact.drive) * size / size[:, None]
    start = exact.start + 0.03 * size * near(jacobian, exact.slowest)
    series = iterated(lambda y: period.run(y, exact.drive)[0], start, 60)[:, 2:] / size[2:]
    found = dominant_multiplier(series[linear_part(series, exact.start[2:] / size[2:])])
    assert found is not None
    assert found.modulus == pytest.approx(abs(exact.slowest), abs=1e-3)
    assert found.angle == pytest.approx(float(np.angle(exact.slowest)), abs=np.radians(0.1))


def spiral(
    multiplier: complex,
    cycles: int,
    first: float,
    noise: float,
    seed: int,
    second: complex = 0j,
    *,
    excitation: float = 0.0,
) -> Array:
    """A series of 12 coefficients about a unit vector with correlated noise, and a second pair of equal size. Random
    changes of rms `excitation` are added to the first pair in each cycle, and carried on by its multiplier.
    """
    rng = np.random.default_rng(seed)
    orbit = rng.standard_normal(12)
    orbit /= np.linalg.norm(orbit)
    n = np.arange(cycles)[:, None]
    direction = rng.standard_normal(12) + 1j * rng.standard_normal(12)
    motion = first * multiplier**n
    if excitation:
        changes = np.random.default_rng([seed, 1]).standard_normal((2, cycles)) * excitation / np.sqrt(2.0)
        motion += lfilter([0.0, 1.0], [1.0, -multiplier], changes[0] + 1j * changes[1])[:, None]
    series = orbit + (direction / np.linalg.norm(direction) * motion).real
    if second:
        other = rng.standard_normal(12) + 1j * rng.standard_normal(12)
        series += (first * other / np.linalg.norm(other) * second**n).real
    mixing = np.eye(12) + 0.5 * rng.standard_normal((12, 12)) / np.sqrt(12.0)
    return series + noise * rng.standard_normal((cycles, 12)) @ mixing


SPIRALS = [(1.0464, 165.4, 55, 0.02), (1.009, 156.0, 120, 0.02), (0.97, 134.9, 60, 0.1), (0.999, 90.0, 24, 0.02)]


EXCITED = [(0.989, 155.0, 60, 0.05), (1.0, 157.0, 60, 0.05), (1.012, 157.0, 60, 0.05)]


def covered(modulus: float, degrees: float, cycles: int, first: float, seeds: int, excitation: float = 0.0) -> Array:
    """Numbers of seeds with the modulus and with the angle within the expanded uncertainty."""
    truth = modulus * np.exp(1j * np.radians(degrees))
    inside = np.zeros(2)
    for seed in range(seeds):
        found = dominant_multiplier(spiral(truth, cycles, first, 5e-4, seed, excitation=excitation))
        assert found is not None
        if not excitation:
            assert abs(found.modulus - modulus) < 0.005
            assert abs(found.angle - np.radians(degrees)) < np.radians(1.0)
        inside[0] += abs(found.modulus - modulus) <= 2.0 * found.modulus_uncertainty
        inside[1] += abs(found.angle - np.radians(degrees)) <= 2.0 * found.angle_uncertainty
    return inside


def test_intervals_cover_the_truth() -> None:
    """95 % of all are expected within the expanded uncertainty, and at least 16 of 20 with a probability of 0.997."""
    inside = sum(covered(*each, seeds=5) for each in SPIRALS)
    assert np.min(inside) >= 16


def test_intervals_of_an_excited_motion_cover_the_truth() -> None:
    """Random excitation of the size of the scatter, such as that by a table's noise, which a fit of scatter alone takes
    for a change of the multiplier. At least 12 of 15 are expected with a probability of 0.995.
    """
    inside = sum(covered(*each, seeds=5, excitation=5e-4) for each in EXCITED)
    assert np.min(inside) >= 12


@pytest.mark.soak
@pytest.mark.parametrize(("modulus", "degrees", "cycles", "first"), SPIRALS)
def test_intervals_of_every_motion_cover_the_truth(modulus: float, degrees: float, cycles: int, first: float) -> None:
    """At least 89 of 100 with a probability of 0.996."""
    assert covered(modulus, degrees, cycles, first, seeds=100).min() >= 89


@pytest.mark.soak
@pytest.mark.parametrize("excitation", [1e-4, 2e-4, 4e-4])
@pytest.mark.parametrize(("modulus", "degrees", "cycles", "first"), EXCITED)
def test_intervals_of_every_excited_motion_cover_the_truth(
    modulus: float, degrees: float, cycles: int, first: float, excitation: float
) -> None:
    """At least 89 of 100 with a probability of 0.996."""
    assert covered(modulus, degrees, cycles, first, 100, excitation).min() >= 89


@pytest.mark.parametrize(("seeds", "most"), [(16, 3.3), pytest.param(40, 3.0, marks=pytest.mark.soak)])
def test_noise_does_not_reduce_the_modulus(seeds: int, most: float) -> None:
    """A regression of each cycle on its predecessor is biased towards zero; the joint fit is not: its mean error is
    within `most` standard uncertainties with a probability of 0.995, by Student's t.
    """
    truth = 1.0 * np.exp(2.8j)
    found = [dominant_multiplier(spiral(truth, 60, 0.02, 3e-3, seed)) for seed in range(seeds)]
    errors = [each.modulus - 1.0 for each in found if each is not None]
    assert len(errors) == seeds
    assert abs(np.mean(errors)) < most * np.std(errors, ddof=1) / np.sqrt(seeds)
    series = spiral(truth, 60, 0.02, 3e-3, 0)
    moved = series - series.mean(axis=0)
    axes = np.linalg.svd(moved, full_matrices=False)[2][:2].T
    plane = moved @ axes
    regression = np.linalg.lstsq(plane[:-1], plane[1:], rcond=None)[0]
    assert np.abs(np.linalg.eigvals(regression)).max() < 0.97


def test_a_second_pair_is_separated_from_the_dominant_one() -> None:
    first, second = 1.01 * np.exp(2.75j), 0.96 * np.exp(2.8j)
    found = dominant_multiplier(spiral(first, 100, 0.05, 3e-4, 1, second))
    assert found is not None
    assert found.pairs == 2
    assert found.modulus == pytest.approx(1.01, abs=max(2e-4, 3.0 * found.modulus_uncertainty))


def test_a_pair_that_is_not_fitted_is_a_part_of_the_uncertainty() -> None:
    """Two similar pairs and one that decays soon. At least 12 of 16 are covered with a probability of 0.999. The
    contribution of pairs that are not fitted is an order of magnitude above that without the decaying pair.
    """
    first, second, third = 0.998 * np.exp(2.723j), 0.967 * np.exp(2.724j), 0.76 * np.exp(2.53j)
    inside, others = 0, np.zeros(2)
    for seed in range(16):
        decaying = spiral(third, 60, 0.015, 0.0, 100 + seed)
        series = spiral(first, 60, 0.05, 1e-4, seed, second)
        alone, found = (dominant_multiplier(each) for each in (series, series + decaying - decaying[-1]))
        assert alone is not None
        assert found is not None
        assert found.pairs == 2
        inside += abs(found.modulus - abs(first)) <= 2.0 * np.hypot(found.modulus_uncertainty, found.modulus_other)
        others += alone.modulus_other**2, found.modulus_other**2
    assert inside >= 12
    assert others[1] > 100.0 * others[0]


def test_noise_alone_has_no_multiplier() -> None:
    rng = np.random.default_rng(5)
    assert not any(dominant_multiplier(1.0 + 1e-3 * rng.standard_normal((60, 12))) for _ in range(4))


def test_a_series_that_is_short_constant_or_not_finite() -> None:
    series = spiral(np.exp(2.8j), SHORTEST - 1, 0.1, 0.0, 1)
    assert dominant_multiplier(series) is None
    # too short to be compared with its part without the first cycles
    for n in range(SHORTEST, SHORTEST + 3):
        assert dominant_multiplier(spiral(np.exp(2.8j), n, 0.1, 1e-4, 1)) is None
    assert dominant_multiplier(spiral(np.exp(2.8j), SHORTEST + 3, 0.1, 1e-4, 1)) is not None
    assert dominant_multiplier(np.ones((40, 12))) is None
    with pytest.raises(ValueError, match="not finite"):
        dominant_multiplier(np.full((40, 12), np.nan))


def test_the_linear_part_is_the_longest_run_within_the_bound() -> None:
    deviation = np.array([0.3, 0.1, 0.3, 0.1, 0.14, 0.05, 0.2])
    series = (1.0 + deviation)[:, None] * np.array([0.6, 0.8])
    assert linear_part(series, np.array([0.6, 0.8])) == slice(3, 6)
    assert linear_part(series, np.array([0.6, 0.8]), 0.01) == slice(0, 0)
