"""Ranges of the free motions of unstable points, in tests that are about other things."""

from collections.abc import Iterator

import pytest

from bench.prediction import attractors
from protocols.harmonic import free_prediction


@pytest.fixture(scope="module")
def few_specimens() -> Iterator[None]:
    """The ranges are those of 21 drawn specimens, hardly more than the 20 with which peaks are compared with them, each
    followed for 400 cycles, of which the last 240 count: 39 for 600 cycles take three times as long.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(attractors, "MEMBER_CYCLES", 400)
        yield from _drawn(21)


@pytest.fixture(scope="module")
def no_specimens() -> Iterator[None]:
    """There are no ranges, which nothing is compared with: even those of 21 specimens take two seconds."""
    yield from _drawn(0)


def _drawn(members: int) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(free_prediction, "MEMBERS", members)
        yield
