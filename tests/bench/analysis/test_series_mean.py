"""Standard uncertainty of the mean of correlated series, against the scatter of the means of many of them."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.analysis.series_mean import standard_error

Array = NDArray[np.float64]
N, SERIES = 60, 600


def autoregressive(random: np.random.Generator, r1: float) -> Array:
    found = random.standard_normal(N)
    for k in range(1, N):
        found[k] = r1 * found[k - 1] + np.sqrt(1.0 - r1**2) * found[k]
    return found


def repeating(random: np.random.Generator) -> Array:
    """Rounding errors of a motion that nearly repeats after three cycles, and noise."""
    pattern = np.array([1.0, -0.2, -0.8])
    turned = np.sin(2.0 * np.pi * (np.arange(N) * 0.3331 + random.uniform()))
    return pattern[np.arange(N) % 3] + turned + 0.3 * random.standard_normal(N)


def alternating(random: np.random.Generator) -> Array:
    return 1.5 * random.choice([-1.0, 1.0]) * np.tile([1.0, -1.0], N // 2)


@pytest.mark.parametrize(
    ("series", "least", "most"),
    [
        # positive correlation is estimated too low from few values
        (lambda random: autoregressive(random, 0.6), 0.75, 1.05),
        # half of the series of independent values seem to be positively correlated
        (lambda random: autoregressive(random, 0.0), 0.9, 1.15),
        (lambda random: autoregressive(random, -0.5), 0.95, 1.35),
        (repeating, 0.95, 1.15),
        (lambda random: autoregressive(random, 0.6) + alternating(random), 0.8, 1.1),
    ],
)
def test_the_stated_uncertainty_is_the_scatter_of_the_means(
    series: Callable[[np.random.Generator], Array], least: float, most: float
) -> None:
    random = np.random.default_rng(4)
    drawn = [series(random) for _ in range(SERIES)]
    stated = np.sqrt(np.mean([standard_error(each)[0] ** 2 for each in drawn]))
    assert least < stated / np.std([each.mean() for each in drawn]) < most


def test_degrees_of_freedom() -> None:
    random = np.random.default_rng(1)
    noisy = np.tile([1.0, -1.0], 30) + 0.1 * random.standard_normal(N)
    assert standard_error(noisy)[1] <= 19.0
    assert standard_error(noisy[:8])[1] == 7.0
    assert standard_error(np.cumsum(np.ones(N)))[1] == 1.0
    assert standard_error(np.ones(5)) == (0.0, 4.0)
    assert standard_error(np.array([1.0, 3.0])) == (2.0, 1.0)
