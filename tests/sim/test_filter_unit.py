"""The low-pass cards and the compiled recursive filters, against scipy."""

import numpy as np
import pytest
from scipy import signal

from bench.guard.shaker import exponential_mean
from sim.filter_unit import FilterUnit, butterworth

SHARES = (0.005, 0.015, 0.05, 0.1, 2.0 / 13.0, 0.25, 0.4, 0.45)


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("order", [2, 4, 6, 8, 10])
def test_sections_of_an_even_order_are_those_of_scipy_bit_for_bit(order: int, share: float) -> None:
    sections, settled = butterworth(order, share)
    expected = signal.butter(order, share, fs=1.0, output="sos")
    np.testing.assert_array_equal(sections, expected)
    np.testing.assert_array_equal(settled, signal.sosfilt_zi(expected))


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("order", [1, 3, 5, 9])
def test_sections_of_an_odd_order_have_the_response_of_scipy(order: int, share: float) -> None:
    """scipy may give the real pole's section two zeros, and another section one."""
    sections, _ = butterworth(order, share)
    expected = signal.butter(order, share, fs=1.0, output="sos")
    frequencies = np.linspace(0.0, 0.49, 200)
    found, wanted = (signal.freqz_sos(each, frequencies, fs=1.0)[1] for each in (sections, expected))
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("order", [1, 4, 7])
def test_a_stream_is_filtered_as_by_scipy_bit_for_bit_whatever_the_blocks(order: int) -> None:
    volts = np.random.default_rng(1).standard_normal((5, 1000))
    before, stream = volts.copy(), FilterUnit(order=order, cutoff=100.0).stream(2000.0)
    sections, settled = butterworth(order, 0.05)
    expected, _ = signal.sosfilt(sections, volts, axis=1, zi=settled[:, None, :] * volts[None, :, :1])
    found = [stream.read(block) for block in np.split(volts, (1, 2, 300, 731), axis=1)]
    np.testing.assert_array_equal(np.hstack(found), expected)
    np.testing.assert_array_equal(volts, before)


def test_the_cards_have_a_fixed_number_of_channels_and_an_empty_block_changes_nothing() -> None:
    volts = np.random.default_rng(1).standard_normal((3, 40))
    whole, cut = (FilterUnit().stream(2000.0) for _ in range(2))
    assert cut.read(volts[:, :0]).shape == (3, 0)
    np.testing.assert_array_equal(cut.read(volts), whole.read(volts))
    with pytest.raises(ValueError, match="4 channels on filter cards for 3"):
        whole.read(np.zeros((4, 5)))


@pytest.mark.parametrize("forget", [0.0, 0.5, 1.0 - 1e-5])
def test_an_exponential_mean_is_that_of_scipy_bit_for_bit_whatever_the_blocks(forget: float) -> None:
    values = np.random.default_rng(1).uniform(0.0, 100.0, 1000)
    before, state, found = values.copy(), None, []
    for block in np.split(values, (1, 2, 300, 731)):
        mean, state = exponential_mean(block, forget, state)
        found.append(mean)
    expected, last = signal.lfilter([1.0 - forget], [1.0, -forget], values, zi=np.zeros(1))
    np.testing.assert_array_equal(np.concatenate(found), expected)
    np.testing.assert_array_equal(state, last)
    np.testing.assert_array_equal(values, before)
