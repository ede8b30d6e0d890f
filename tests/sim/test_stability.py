"""Loss of stability of steady rocking: the windows that are known, and how the multipliers leave the unit circle."""

from itertools import pairwise

import numpy as np
import pytest

from sim.specimen import Specimen
from sim.steady import rocking_branch
from tests.sim.runs import A_S

STEP = 0.025


@pytest.mark.parametrize(
    ("beta", "windows"),
    [(0.64, [13.10, 13.50, 13.825]), (0.97, [13.425, 14.225, 14.35, 15.425]), (1.2, [14.075, 14.875, 15.0, 16.425])],
)
def test_stability_changes_where_it_is_known_to(beta: float, windows: list[float]) -> None:
    # known as the first point of the new state on steps of 0.025 rad/s
    branch = rocking_branch(Specimen(beta=beta), np.arange(12.5, 17.0 + 0.5 * STEP, STEP), A_S)
    omegas = np.array([orbit.omega for orbit in branch])
    outside = np.array([orbit.multiplier > 1.0 for orbit in branch])
    assert omegas[1:][outside[1:] != outside[:-1]] == pytest.approx(windows, abs=1e-9)
    # with rising frequency stability is lost and regained in turns, and above the last window the motion is stable
    assert not outside[-1]
    # Neimark-Sacker: a conjugate pair crosses the circle at 150 to 170 degrees, never +1 (fold) or -1 (period doubling)
    for orbit, changed in zip(branch[1:], outside[1:] != outside[:-1], strict=True):
        if changed:
            leading = max(orbit.multipliers, key=abs)
            assert 150.0 < abs(np.degrees(np.angle(leading))) < 170.0
            assert orbit.multiplier == pytest.approx(1.0, abs=0.05)


def test_the_window_is_at_the_same_place_along_the_stiffness() -> None:
    """The stability changes at the stiffness whose window, along the frequency, ends there."""
    branch = rocking_branch(Specimen(beta=0.97), np.arange(15.3, 15.5, 0.002), A_S)
    (edge,) = [
        orbit.omega for before, orbit in pairwise(branch) if (before.multiplier > 1.0) != (orbit.multiplier > 1.0)
    ]
    softer, stiffer = (
        rocking_branch(Specimen(beta=beta), np.array([edge]), A_S)[0].multiplier for beta in (0.965, 0.975)
    )
    assert (softer > 1.0) != (stiffer > 1.0)
