"""Laws of restitution against the equations of a rigid body with an impulse, and against their closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.errors import InvalidInput
from sim.restitution_laws import FACE, consecutive, laws, passed
from sim.specimen import Block, Specimen

BLOCKS = st.builds(Block, b=st.floats(0.005, 0.1), h_b=st.floats(0.15, 2.0))
POINTS = st.floats(-1.0, 1.0)


def after_impulse(block: Block, before: float, impulse: float, after: float) -> float:
    """Angular velocity after the impact of a block with angular velocity 1, from linear and angular momentum: unknowns
    are the velocity and the two components of the impulse.
    """
    b, h, mass = block.b, block.h_b, block.mass
    inertia = mass * (b**2 + h**2) / 3.0
    # velocity of the centre (0, h) at unit angular velocity about (p b, 0)
    start, end = np.array([-h, -before * b]), np.array([-h, -after * b])
    # moment about the centre of an impulse (jx, jy) at (q b, 0)
    moment = np.array([h, impulse * b])
    equations = np.zeros((3, 3))
    equations[:2, 0], equations[:2, 1:] = mass * end, -np.eye(2)
    equations[2] = inertia, *-moment
    return float(np.linalg.solve(equations, [*(mass * start), inertia])[0])


@given(BLOCKS, POINTS, POINTS, POINTS)
def test_an_impact_conserves_momentum(block: Block, before: float, impulse: float, after: float) -> None:
    assert passed(block, before, impulse, after) == pytest.approx(
        after_impulse(block, before, impulse, after), rel=1e-9
    )


@given(BLOCKS, st.floats(0.01, 1.0))
def test_the_corner_loses_most_and_nothing_is_gained(block: Block, k: float) -> None:
    housner = block.restitution
    assert passed(block, -1.0, 1.0, 1.0) == pytest.approx(housner, rel=1e-12)
    _, contact = laws(k)
    for value in (consecutive(block), contact.restitution(block)):
        assert housner - 1e-12 <= value < 1.0


def test_consecutive_impacts_halve_the_loss_of_housners_law_to_first_order() -> None:
    block = Block()
    sine = block.b**2 / (block.b**2 + block.h_b**2)
    assert consecutive(block) == pytest.approx(1.0 - 0.75 * sine, rel=1e-14)
    assert consecutive(block) == pytest.approx(257.0 / 260.0, rel=1e-12)


def test_the_default_impulse_is_the_resultant_of_the_velocity_of_approach() -> None:
    x = np.linspace(-1.0, 1.0, 2001)
    assert np.trapezoid(x * (x + 1.0), x) / np.trapezoid(x + 1.0, x) == pytest.approx(FACE, abs=1e-6)
    _, contact = laws()
    assert contact.restitution(Block()) == pytest.approx(256.0 / 258.0, rel=1e-12)


def test_a_law_replaces_the_restitution_of_the_specimen_and_nothing_else() -> None:
    specimen = Specimen(block=Block(restitution_factor=0.992)).coupled(0.64)
    for law in laws(0.5):
        found = law.applied(specimen)
        assert found.block.restitution == pytest.approx(law.restitution(specimen.block), rel=1e-14)
        factor = {"restitution_factor": found.block.restitution_factor}
        assert found == specimen.model_copy(update={"block": specimen.block.model_copy(update=factor)})


def test_a_block_whose_impact_would_reverse_it_is_refused() -> None:
    wide = Block.model_construct(b=1.0, h_b=0.1, s=0.1, rho=2450.0, restitution_factor=1.0)
    _, contact = laws(1.0)
    with pytest.raises((InvalidInput, ValueError)):
        contact.applied(Specimen().model_copy(update={"block": wide}))
