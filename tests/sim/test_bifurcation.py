"""Loss of stability: known windows, and the three generic types."""

from dataclasses import replace

import numpy as np
import pytest

from sim.bifurcation import BifurcationType, bifurcations, leading_type
from sim.errors import InvalidInput
from sim.specimen import Specimen
from sim.steady import rocking_branch, rocking_orbit
from tests.sim.runs import A_S


@pytest.mark.parametrize(
    ("beta", "windows"),
    [(0.64, [13.10, 13.50, 13.825]), (0.97, [13.425, 14.225, 14.35, 15.425]), (1.2, [14.075, 14.875, 15.0, 16.425])],
)
def test_stability_changes_where_it_is_known_to(beta: float, windows: list[float]) -> None:
    # known as the first point of the new state on steps of 0.025 rad/s
    branch = rocking_branch(Specimen(beta=beta), np.arange(12.5, 17.0, 0.1), A_S)
    found = bifurcations(branch)
    assert len(found) == len(windows)
    for one, upper in zip(found, windows, strict=True):
        assert upper - 0.0251 < one.orbit.omega <= upper
        assert one.type is BifurcationType.NEIMARK_SACKER
        assert 150.0 < np.degrees(one.angle) < 170.0
        assert one.orbit.multiplier == pytest.approx(1.0, abs=1e-8)
    # with rising frequency stability is lost and regained in turns
    directions = [one.gains_stability for one in found]
    assert directions == [not gains for gains in directions[1:]] + [True]


def test_it_is_the_same_place_from_either_side_and_along_the_stiffness() -> None:
    down = [rocking_orbit(Specimen(beta=0.97), omega, A_S) for omega in (15.5, 15.3)]
    (at,) = bifurcations(down)
    assert not at.gains_stability
    omega = at.orbit.omega
    (up,) = bifurcations(down[::-1])
    assert up.gains_stability
    assert up.orbit.omega == pytest.approx(omega, abs=1e-7)
    (across,) = bifurcations([rocking_orbit(Specimen(beta=beta), omega, A_S) for beta in (0.9, 1.0)])
    assert across.orbit.specimen.beta == pytest.approx(0.97, abs=1e-6)
    assert across.angle == pytest.approx(at.angle, abs=1e-6)


@pytest.mark.parametrize(
    ("multipliers", "kind", "angle"),
    [
        ([1.1, 0.5], BifurcationType.FOLD, 0.0),
        ([-1.1, 0.5], BifurcationType.PERIOD_DOUBLING, np.pi),
        ([0.5, 1.2j, -1.2j], BifurcationType.NEIMARK_SACKER, np.pi / 2.0),
    ],
)
def test_types(multipliers: list[complex], kind: BifurcationType, angle: float) -> None:
    orbit = rocking_orbit(Specimen(beta=0.4), 16.0, A_S)
    assert leading_type(replace(orbit, multipliers=np.array(multipliers, dtype=complex))) == (
        kind,
        pytest.approx(angle),
    )


def test_neighbours_must_be_one_branch() -> None:
    stable, unstable = rocking_orbit(Specimen(beta=0.97), 16.0, A_S), rocking_orbit(Specimen(beta=0.97), 15.0, A_S)
    with pytest.raises(InvalidInput, match="branch"):
        bifurcations([stable, replace(unstable, specimen=Specimen(beta=0.97, d=0.2))])
    assert bifurcations([stable]) == []
    assert bifurcations([stable, stable]) == []
