"""Bias of the largest of several values with errors."""

import numpy as np
import pytest

from bench.analysis.selection import LEFT, selection_bias


@pytest.mark.parametrize(
    ("distances", "within", "covered"),
    [
        ([0.0, 30.0], 1.1, 0.94),
        ([0.0, 1.0, 2.0, 30.0], 1.1, 0.94),
        (np.arange(40) * 0.5, 1.1, 0.94),
        ([0.0, 0.0, 0.5, 30.0, 40.0], 1.1, 0.94),
        # of equal values, at most the bias that equal values leave
        ([0.0] * 9, 1.3, 0.88),
    ],
)
def test_the_largest_of_several_values_is_corrected_for_its_selection(
    distances: list[float], within: float, covered: float
) -> None:
    random, true = np.random.default_rng(1), -2.0 * np.array(distances)
    seen = true + 2.0 * random.standard_normal((600, true.size))
    added = np.array([selection_bias(each, np.diag(np.full(true.size, 4.0))) for each in seen])
    largest = seen.max(axis=1)
    stated = np.sqrt(4.0 + (LEFT * added) ** 2)
    assert np.mean(np.abs(largest - added) < 2.0 * stated) > covered
    assert 0.8 < np.sqrt(np.mean(((largest - added) / stated) ** 2)) < within
    # two thirds of what selection adds to equal values are left
    assert -0.2 < np.mean(largest - added) < 0.7 * np.mean(largest) + 0.2


def test_errors_that_values_have_in_common_are_not_due_to_selection() -> None:
    values, common = np.array([0.0, -0.1, -0.2]), np.full((3, 3), 4.0)
    assert selection_bias(values, common) == pytest.approx(0.0, abs=0.1)
    assert selection_bias(values, common + np.eye(3)) == pytest.approx(selection_bias(values, np.eye(3)), abs=0.15)
    assert selection_bias(values, np.zeros((3, 3))) == 0.0
