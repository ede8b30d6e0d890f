"""Shift of the measured cycles by a decaying mode, against series whose limit is known."""

import numpy as np
import pytest

from bench.analysis.remaining_transient import remaining_transient

CYCLES, MEASURED, LIMIT, NOISE = 72, 24, 0.01, 2e-6


def errors(decay: float, angle: float, height: float) -> tuple[float, float]:
    """rms of the error of the mean of the measured cycles over its stated uncertainty, and the mean of the latter."""
    random, at = np.random.default_rng(3), np.arange(CYCLES)
    off, stated = [], []
    for _ in range(100):
        mode = height * LIMIT * decay**at * np.cos(angle * at + random.uniform(0.0, 2.0 * np.pi))
        series = LIMIT + mode + NOISE * random.standard_normal(CYCLES)
        stated.append(float(np.hypot(remaining_transient(series, MEASURED), NOISE / np.sqrt(MEASURED))))
        off.append((series[-MEASURED:].mean() - LIMIT) / stated[-1])
    return float(np.sqrt(np.mean(np.square(off)))), float(np.mean(stated))


@pytest.mark.parametrize("decay", [0.9, 0.96, 0.975])
@pytest.mark.parametrize("angle", [0.0, 0.14, 0.5, 2.1, 2.54, 3.12])
def test_the_shift_by_a_mode_is_covered(decay: float, angle: float) -> None:
    rms, _ = errors(decay, angle, 0.01)
    assert rms < 1.3


def test_a_mode_that_turns_by_a_large_angle_averages_out() -> None:
    bound = LIMIT * 0.0024 / np.sqrt(3.0)
    assert errors(0.98, 2.4, 0.01)[1] < 0.1 * bound


def test_without_a_transient_the_uncertainty_is_that_of_the_fit() -> None:
    assert errors(0.9, 0.0, 0.0)[1] < 4.0 * NOISE / np.sqrt(MEASURED)
