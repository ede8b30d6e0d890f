import numpy as np
import pytest

from drivers.timebase.common_motion import common_motion
from sim.errors import InvalidInput
from tests.drivers.lines import complex_amplitudes

OMEGA = 2.0 * np.pi * np.array([1.0, 2.3, 4.1, 6.7, 9.2])
AMPLITUDES = np.array([3.0, 2.0 + 1.0j, -1.5j, 1.0 - 0.5j, 0.7])


def motion(t: np.ndarray) -> np.ndarray:
    return np.sum([(a * np.exp(1j * w * t)).real for a, w in zip(AMPLITUDES, OMEGA, strict=True)], axis=0)


def test_amplitudes_of_lines_that_do_not_fit_the_record_are_exact() -> None:
    t = np.arange(3777) / 1000.0
    np.testing.assert_allclose(complex_amplitudes(motion(t) + 40.0, 1000.0, OMEGA), AMPLITUDES, atol=1e-9)


@pytest.mark.parametrize("delay", [-2.0e-3, 0.0, 1.25e-3, 40.0e-3])
@pytest.mark.parametrize("factor", [0.5, -1.75])
def test_delay_sign_and_scale_of_the_same_motion_are_found(delay: float, factor: float) -> None:
    t = np.arange(8000) / 2000.0
    first = complex_amplitudes(motion(t), 2000.0, OMEGA)
    second = complex_amplitudes(factor * motion(t - delay) - 0.2, 2000.0, OMEGA)
    found = common_motion(OMEGA, first, second)
    assert found.delay == pytest.approx(delay, abs=1e-9)
    assert found.polarity == np.sign(factor)
    assert found.scale == pytest.approx(abs(factor))
    assert found.uncertainty < 1e-9
    assert found.scatter < 1e-6


def test_the_uncertainty_is_the_scatter_of_the_delay() -> None:
    """Equal amplitudes with phases off by 10 mrad: the delay scatters by 10 mrad / sqrt(sum of omega squared)."""
    rng = np.random.default_rng(5)
    omega = 2.0 * np.pi * np.linspace(1.0, 10.0, 19)
    noise = rng.normal(0.0, 0.01, (400, omega.size))
    found = [common_motion(omega, np.ones(19, complex), np.exp(1j * (off - omega * 1e-3))) for off in noise]
    expected = 0.01 / np.sqrt(np.sum(omega**2))
    assert np.std([one.delay for one in found]) == pytest.approx(expected, rel=0.12)
    assert np.mean([one.uncertainty for one in found]) == pytest.approx(expected, rel=0.12)
    assert np.mean([one.scatter for one in found]) == pytest.approx(0.01, rel=0.12)


def test_a_weak_line_counts_little() -> None:
    first = np.array([1.0, 1.0, 1.0, 1e-4], dtype=complex)
    second = first * np.exp(-1j * OMEGA[:4] * 1e-3) * np.exp(1j * np.array([0.0, 0.0, 0.0, 0.5]))
    assert common_motion(OMEGA[:4], first, second).delay == pytest.approx(1e-3, abs=1e-9)


def test_the_order_of_the_frequencies_is_no_matter() -> None:
    second = AMPLITUDES * np.exp(-1j * OMEGA * 2e-3)
    assert common_motion(OMEGA[::-1], AMPLITUDES[::-1], second[::-1]) == common_motion(OMEGA, AMPLITUDES, second)


def test_too_little_is_refused() -> None:
    with pytest.raises(InvalidInput, match="frequencies"):
        common_motion(OMEGA[:2], AMPLITUDES[:2], AMPLITUDES[:2])
    with pytest.raises(InvalidInput, match="amplitude"):
        common_motion(OMEGA, np.zeros(5, complex), AMPLITUDES)
