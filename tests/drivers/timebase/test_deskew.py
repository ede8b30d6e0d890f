"""Known delays of inputs are taken out of their samples, whatever the blocks."""

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.timebase.deskew import Deskew

RATE = 2000.0
RAIL = 32767
VALID = (-32766, 32766)
FILTER = (40.0 + 5.0 / 512.0) / RATE + 3.3e-6


def signal(seconds: NDArray[np.float64], frequency: float) -> NDArray[np.float64]:
    return 20_000.0 * np.sin(2.0 * np.pi * frequency * seconds + 0.3)


def taken(delays: list[float], n: int, frequency: float) -> NDArray[np.int16]:
    """Counts of one signal at inputs with these delays."""
    edges = np.arange(n)[:, np.newaxis] / RATE
    return np.rint(signal(edges - np.array(delays), frequency)).astype(np.int16)


def moved(delays: list[float], raw: NDArray[np.int16], blocks: list[int]) -> NDArray[np.int16]:
    deskew = Deskew(delays, RATE, [VALID] * len(delays))
    begin, parts = 0, []
    for n in blocks:
        end = begin + deskew.missing(n)
        parts.append(deskew.moved(raw[begin:end]))
        assert len(parts[-1]) == n
        begin = end
    assert begin == sum(blocks) + deskew.latency
    return np.concatenate(parts)


CASES = {
    "multiplexer": [0.0, -11e-6, -22e-6, -33e-6],
    "filter and none": [FILTER, 0.0],
    "filter and multiplexer": [FILTER, 0.0, -14e-6],
    "whole samples": [40.0 / RATE, 0.0],
    "half a sample": [0.5 / RATE, -0.5 / RATE],
}


@pytest.mark.parametrize("delays", CASES.values(), ids=CASES)
@pytest.mark.parametrize("frequency", [2.0, 20.0, 60.0])
def test_all_inputs_show_the_signal_at_the_edges(delays: list[float], frequency: float) -> None:
    got = moved(delays, taken(delays, 700, frequency), [200, 1, 99, 300])[5:]
    expected = signal(np.arange(5, 600) / RATE, frequency)
    steepest = 20_000.0 * 2.0 * np.pi * frequency
    error = np.abs(got - expected[:, np.newaxis]).max()
    # two counts of rounding, and less than a microsecond of the signal's slope
    assert error <= 2.0 + 5e-7 * steepest + 20_000.0 * (2.0 * np.pi * frequency / RATE) ** 4


def test_the_blocks_do_not_matter() -> None:
    raw = taken(CASES["filter and multiplexer"], 700, 20.0)
    whole = moved(CASES["filter and multiplexer"], raw, [600])
    np.testing.assert_array_equal(moved(CASES["filter and multiplexer"], raw, [1, 2, 3, 594]), whole)


def test_without_delays_nothing_is_touched() -> None:
    raw = taken([0.0, 0.0], 100, 20.0)
    deskew = Deskew([0.0, 0.0], RATE, [VALID] * 2)
    assert deskew.latency == 0
    assert deskew.moved(raw) is raw


def test_a_sample_at_the_rail_stays_there_and_spreads_to_its_neighbour_only() -> None:
    raw = taken([-33e-6, 0.0], 100, 5.0)
    raw[50, 0] = RAIL
    got = moved([-33e-6, 0.0], raw, [100])
    outside = np.flatnonzero((got[:, 0] < VALID[0]) | (got[:, 0] > VALID[1]))
    assert outside.tolist() == [50, 51]
    assert (got[outside, 0] == RAIL).all()


def test_a_new_run_begins_without_the_last_one() -> None:
    deskew = Deskew([FILTER], RATE, [VALID])
    first = np.full((deskew.missing(10), 1), 1000, np.int16)
    deskew.moved(first)
    deskew.begin()
    assert (deskew.moved(np.full((deskew.missing(10), 1), -1000, np.int16)) == -1000).all()
