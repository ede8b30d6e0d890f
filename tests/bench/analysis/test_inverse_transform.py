"""Inverse transforms of lengths with and without a large prime factor agree with numpy's."""

import numpy as np
import pytest

from bench.analysis.inverse_transform import real_inverse


@pytest.mark.parametrize("n", [2, 7, 60, 1583, 2 * 1583, 3 * 1583, 40 * 1583, 67 * 71, 30600, 30601])
def test_it_is_numpys_to_rounding(n: int) -> None:
    random = np.random.default_rng(n)
    spectrum = random.standard_normal(n // 2 + 1) + 1j * random.standard_normal(n // 2 + 1)
    expected = np.fft.irfft(spectrum, n)
    np.testing.assert_allclose(real_inverse(spectrum, n), expected, rtol=0, atol=2e-14 * np.abs(expected).max())
