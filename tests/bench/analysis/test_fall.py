"""A fallen block is noticed by what it does to the first storey, and nothing else is mistaken for it."""

from math import sin

import numpy as np
import pytest

from bench.analysis.fall import FallWatch
from bench.analysis.signals import U1
from sim.specimen import Specimen

RATE = 1000.0


def _watch(u1: np.ndarray, beta: float) -> list[bool]:
    watch = FallWatch(Specimen().coupled(beta), RATE)
    signals = np.zeros((u1.size, 6))
    signals[:, U1] = u1
    return [watch.fallen(block) for block in np.split(signals, u1.size // 100)]


@pytest.mark.parametrize("beta", [0.1, 0.25, 0.97])
def test_a_block_in_its_strap_is_noticed_within_a_period_of_the_first_mode(beta: float) -> None:
    offset = -beta * 0.2 * sin(0.35) / (1.0 + beta)  # spring to the strap: k_C h1 sin(theta) = (k1 + k_C) u1
    t = np.arange(4000) / RATE
    fallen = _watch(np.where(t < 2.0, 0.0, offset), beta)
    assert not any(fallen[:20])
    assert all(fallen[20 + 11 :])


def test_large_forced_and_free_motion_is_not_a_fall() -> None:
    t = np.arange(20_000) / RATE
    first = Specimen().frame.natural_frequencies[0]
    u1 = 0.03 * np.sin(16.0 * t) + 0.02 * np.sin(first * t)
    assert not any(_watch(u1, 0.25))


def test_a_laser_that_lost_the_storey_says_nothing_about_the_block() -> None:
    assert not any(_watch(np.full(2000, np.nan), 0.4))


def test_a_bare_frame_cannot_fall() -> None:
    watch = FallWatch(Specimen(), RATE)
    assert not watch.fallen(np.full((5000, 6), 0.1))


def test_the_offset_is_that_of_the_linear_spring() -> None:
    watch = FallWatch(Specimen().coupled(1.0), RATE)
    assert watch.threshold == pytest.approx(0.5 * 0.2 * sin(0.25) / 2.0)
