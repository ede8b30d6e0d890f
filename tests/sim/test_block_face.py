"""The lit point against a construction: rotate the block's outline, cut it with the beam, take the frame's side."""

from math import atan

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sim.block_face import displacement, displacement_rate, rotation
from sim.specimen import Block

blocks = st.builds(Block, b=st.floats(0.01, 0.05), h_b=st.floats(0.1, 0.4))
heights = st.floats(0.02, 1.2)
"""Of the beam over the height of the block."""


def cut(theta: float, height: float, block: Block) -> tuple[float, bool]:
    """Where the beam from the frame's side meets the outline [m], 0 at corner A, and whether that is on the face."""
    wide, tall = 2.0 * block.b, 2.0 * block.h_b
    # the frame is at positive x: the face lies at 0; a turn towards it is clockwise, about A or about the rear corner
    outline = np.array([[0.0, 0.0], [0.0, tall], [-wide, tall], [-wide, 0.0]])
    pivot = np.array([0.0 if theta >= 0.0 else -wide, 0.0])
    turn = np.array([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]])
    corners = (outline - pivot) @ turn.T + pivot
    met: list[tuple[float, bool]] = []
    for i, (start, end) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
        if min(start[1], end[1]) <= height <= max(start[1], end[1]) and start[1] != end[1]:
            share = (height - start[1]) / (end[1] - start[1])
            met.append((float(start[0] + share * (end[0] - start[0])), i == 0))
    return max(met, default=(np.nan, False))


@given(st.floats(-0.5, 0.5), heights, blocks)
def test_the_lit_point_is_where_the_beam_meets_the_turned_outline(theta: float, share: float, block: Block) -> None:
    height = 2.0 * block.h_b * share
    expected, on_face = cut(theta, height, block)
    seen = float(displacement(theta, height, block))
    assert np.isnan(seen) != on_face
    if on_face:
        assert seen == pytest.approx(expected, abs=1e-15, rel=1e-12)


@given(st.floats(-1.0, 1.0), st.floats(0.3, 0.95), blocks)
def test_the_rotation_comes_back_and_the_rate_is_the_slope(turn: float, share: float, block: Block) -> None:
    theta, height = turn * atan(block.b / block.h_b), 2.0 * block.h_b * share
    step = 1e-6
    around = displacement(np.array([theta - step, theta, theta + step]), height, block)
    # a slender face turns out of a high beam
    assume(bool(np.isfinite(around).all()))
    assert float(rotation(around[1], height, block)) == pytest.approx(theta, abs=4e-15)
    # the curvature jumps by 2b at rest
    assert (around[2] - around[0]) / (2.0 * step) == pytest.approx(
        float(displacement_rate(theta, height, block)), abs=2.0 * block.b * step + 1e-9
    )


def test_what_no_rotation_shows_has_none() -> None:
    """The beam low on the block: the face withdraws by less than 2b - sqrt(4b^2 - z^2) before it is above the beam."""
    block = Block()
    low = 0.5 * block.b
    limit = np.sqrt(4.0 * block.b**2 - low**2) - 2.0 * block.b
    shown = rotation(np.array([1.01 * limit, 0.99 * limit, 0.0]), low, block)
    assert np.isnan(shown).tolist() == [True, False, False]
    assert shown[1] > -np.arcsin(low / (2.0 * block.b))
