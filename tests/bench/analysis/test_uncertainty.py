"""Means of repeats that scatter: coverage by Monte Carlo, and the closed forms of equal weights."""

import numpy as np
import pytest
from scipy.stats import t

from bench.analysis.uncertainty import enlarged, mean_of_repeats

TRIALS = 1500


@pytest.mark.parametrize("repeats", [2, 3, 5, 6])
@pytest.mark.parametrize("unequal", [False, True])
def test_covers_95_percent_of_what_scatters(repeats: int, unequal: bool) -> None:
    random = np.random.default_rng((7, repeats))
    stated = np.linspace(1.0, 3.0, repeats) if unequal else np.ones(repeats)
    drawn = random.normal(0.0, np.hypot(stated, 300.0)[:, None], (repeats, TRIALS))
    variances = np.tile(stated[:, None] ** 2, (1, TRIALS))
    found = mean_of_repeats(drawn, variances)
    u = np.sqrt(np.sum(found.weights**2 * variances, axis=0) + found.scatter**2)
    assert 0.93 < np.mean(np.abs(found.values) < 1.959964 * u) < 0.97


@pytest.mark.parametrize(("repeats", "least"), [(2, 0.85), (3, 0.89), (5, 0.92), (6, 0.92)])
@pytest.mark.parametrize("scatter", [0.0, 1.0, 2.0])
def test_holds_less_where_the_scatter_is_as_large_as_the_noise(repeats: int, least: float, scatter: float) -> None:
    # two repeats that agree by chance do not tell that others would not
    random = np.random.default_rng((8, repeats))
    drawn = random.normal(0.0, np.hypot(1.0, scatter), (repeats, TRIALS))
    found = mean_of_repeats(drawn, np.ones_like(drawn))
    u = np.sqrt(1.0 / repeats + found.scatter**2)
    assert least < np.mean(np.abs(found.values) < 1.959964 * u) < 0.985


def test_equal_uncertainties_have_the_student_interval_of_the_plain_mean() -> None:
    values = np.array([[1.0], [4.0], [7.0]])
    found = mean_of_repeats(values, np.full_like(values, 1e-12))
    assert found.values[0] == pytest.approx(4.0)
    assert 1.959964 * found.scatter[0] == pytest.approx(t.ppf(0.975, 2) * 3.0 / np.sqrt(3.0), rel=1e-6)
    assert found.birge[0] == pytest.approx(3.0e6)


def test_what_agrees_is_weighted_by_its_uncertainty_and_has_no_scatter() -> None:
    found = mean_of_repeats([[1.0], [1.5]], [[1.0], [4.0]])
    assert found.values[0] == pytest.approx((1.0 + 1.5 / 4.0) / 1.25)
    assert found.scatter[0] == 0.0
    assert found.birge[0] == pytest.approx(np.sqrt(0.25 / 5.0))


@pytest.mark.parametrize(("repeats", "birge", "consistent"), [(4, 1.1, False), (5, 1.1, True), (5, 1.3, False)])
def test_five_repeats_and_more_are_tested_for_consistency(repeats: int, birge: float, consistent: bool) -> None:
    # chi2 of 1.1^2 and 1.3^2 times 4 degrees of freedom have probabilities of 30 and 15 %, by its table
    values = np.linspace(-1.0, 1.0, repeats)[:, None]
    values *= birge / np.std(values, ddof=1)
    found = mean_of_repeats(values, np.ones_like(values))
    assert found.birge[0] == pytest.approx(birge)
    assert bool(found.scatter[0] == 0.0) is consistent


def test_a_single_one_is_kept() -> None:
    found = mean_of_repeats([[3.0, 4.0]], [[1.0, 2.0]])
    np.testing.assert_array_equal(found.values, [3.0, 4.0])
    np.testing.assert_array_equal(found.scatter, 0.0)
    assert np.isnan(found.birge).all()


def test_an_enlarged_covariance_keeps_its_correlations() -> None:
    covariance = np.array([[4.0, 1.0], [1.0, 1.0]])
    found = enlarged(covariance, np.array([3.0, 0.0]))
    np.testing.assert_allclose(np.diag(found), [13.0, 1.0])
    assert found[0, 1] / np.sqrt(found[0, 0] * found[1, 1]) == pytest.approx(0.5)
