"""The specimen against the numbers of the paper's tables and of its text."""

import numpy as np
import pytest

from sim.errors import InvalidInput
from sim.specimen import Block, Frame, Specimen


def test_bare_frequencies_are_the_papers() -> None:
    assert Frame().natural_frequencies == pytest.approx((6.321568, 16.350104), abs=1e-6)


def test_dashpots_give_the_modal_damping_ratios() -> None:
    frame = Frame()
    c1, c2 = frame.dashpots
    assert (c1, c2) == pytest.approx((1.080970, 0.134384), abs=1e-6)
    # independent of the closed form: mass-normalised modes from a general eigensolver
    stiffness = np.array([[frame.k1 + frame.k2, -frame.k2], [-frame.k2, frame.k2]]) / frame.m1
    values, modes = np.linalg.eigh(stiffness)
    modes /= np.sqrt(frame.m1)
    modal = np.diag(modes.T @ np.array([[c1 + c2, -c2], [-c2, c2]]) @ modes)
    assert modal / (2.0 * np.sqrt(values)) == pytest.approx([0.010, 0.035], rel=1e-12)


def test_block_is_that_of_table_2() -> None:
    block = Block()
    assert block.mass == pytest.approx(4.9, rel=1e-12)
    assert block.slenderness == pytest.approx(8.0, rel=1e-12)
    assert block.inertia == pytest.approx(0.265417, abs=1e-6)
    assert block.restitution == pytest.approx(0.976923, abs=1e-6)
    assert Block(restitution_factor=0.992).restitution == pytest.approx(0.992 * 0.9769231, abs=1e-6)


@pytest.mark.parametrize("table_mass", [5.0, 50.0])
def test_restitution_on_a_table_keeps_the_momenta_that_an_impact_keeps(table_mass: float) -> None:
    """Of block and table horizontally, and of the block about the corner that it comes to: two linear equations."""
    block = Block(restitution_factor=0.992)
    lever = block.mass * block.h_b
    momenta = np.array([[table_mass + block.mass, -lever], [-lever, block.inertia]])
    _, turning = np.linalg.solve(momenta, [-lever, block.restitution * block.inertia])
    assert block.restitution_on(table_mass) == pytest.approx(turning, rel=1e-12)
    assert block.restitution_on(1e12) == pytest.approx(block.restitution, rel=1e-9)


def test_uplift_acceleration_and_coupling() -> None:
    specimen = Specimen(beta=0.25)
    assert 1.01 * specimen.uplift_acceleration == pytest.approx(1.238512, abs=1e-6)
    assert specimen.k_c == pytest.approx(0.25 * 213.44)
    assert Specimen().k_c == 0.0


def test_bare_and_coupled_keep_everything_else() -> None:
    specimen = Specimen(frame=Frame(m1=2.0), beta=0.4, d=0.2, g=9.8)
    assert specimen.bare().coupled(0.4) == specimen
    assert specimen.bare().beta is None


def test_packed_says_whether_there_is_a_block() -> None:
    assert Specimen().packed()[15] == 0.0
    assert Specimen(beta=0.0).packed()[15] == 1.0
    assert Specimen(beta=0.5).packed().shape == (16,)


@pytest.mark.parametrize("values", [{"m1": 0.0}, {"k2": -1.0}, {"xi1": 1.0}, {"m2": float("nan")}])
def test_frame_refuses_what_has_no_meaning(values: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(values))):
        Frame(**values)


def test_negative_coupling_is_refused() -> None:
    with pytest.raises(ValueError, match="beta"):
        Specimen(beta=-0.1)


@pytest.mark.parametrize("specimen", [Specimen(), Specimen(spring_k1=200.0)])
@pytest.mark.parametrize("label", [-0.4, float("nan"), float("inf")])
def test_a_label_without_meaning_is_refused_with_its_value(specimen: Specimen, label: float) -> None:
    with pytest.raises(InvalidInput, match=f"^beta = {label} is refused: the label of a spring"):
        specimen.coupled(label)


def test_a_negative_stiffness_of_a_spring_is_refused_with_its_value() -> None:
    with pytest.raises(InvalidInput, match=r"^k_c = -80\.0 is refused"):
        Specimen().with_spring(-80.0)


def test_refusals_are_one_family() -> None:
    assert issubclass(InvalidInput, ValueError)
