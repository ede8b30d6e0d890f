"""Specimens drawn from what the identification leaves open."""

import numpy as np
import pytest

from sim.knowledge import SpecimenKnowledge
from sim.specimen import Block, Specimen

NOMINAL = Specimen().coupled(0.64)


def test_the_draws_fill_their_half_widths_and_stay_within() -> None:
    drawn = SpecimenKnowledge().draws(NOMINAL, 400, np.random.default_rng(3))
    one = NOMINAL.frame
    ratios = {
        "k1": (0.05, [each.frame.k1 / one.k1 for each in drawn]),
        "k2": (0.05, [each.frame.k2 / one.k2 for each in drawn]),
        "xi1": (0.30, [each.frame.xi1 / one.xi1 for each in drawn]),
        "xi2": (0.30, [each.frame.xi2 / one.xi2 for each in drawn]),
        "restitution": (0.01, [each.block.restitution / NOMINAL.block.restitution for each in drawn]),
        "k_c": (0.10, [each.k_c / NOMINAL.k_c for each in drawn]),
    }
    off = np.array([np.array(values) - 1.0 for _, values in ratios.values()])
    widths = np.array([width for width, _ in ratios.values()])
    assert (np.abs(off).max(axis=1) <= widths * (1.0 + 1e-12)).all()
    # of a rectangular distribution: standard deviation a / sqrt(3), known to some 3 % from 400 draws
    assert off.std(axis=1) == pytest.approx(widths / np.sqrt(3.0), rel=0.1)
    correlation = np.corrcoef(off) - np.eye(len(ratios))
    assert np.abs(correlation).max() < 0.2


def test_a_drawn_frame_has_the_frequencies_and_damping_of_its_own_values() -> None:
    """m1 m2 omega_1^2 omega_2^2 = k1 k2, whatever the nominal frame has cached."""
    assert NOMINAL.frame.natural_frequencies[0] > 0.0
    for each in SpecimenKnowledge(stiffness=0.4).draws(NOMINAL, 5, np.random.default_rng(0)):
        frame = each.frame
        product = frame.m1 * frame.m2 * np.prod(np.square(frame.natural_frequencies))
        assert product == pytest.approx(frame.k1 * frame.k2)


def test_nothing_left_open_is_the_specimen_itself() -> None:
    certain = SpecimenKnowledge(stiffness=0.0, damping=0.0, restitution=0.0, spring=0.0)
    assert certain.draws(NOMINAL, 2, np.random.default_rng(0)) == [NOMINAL, NOMINAL]
    assert certain.draws(NOMINAL.bare(), 1, np.random.default_rng(0)) == [NOMINAL.bare()]


def test_no_draw_gains_energy_at_an_impact() -> None:
    elastic = NOMINAL.model_copy(update={"block": Block(restitution_factor=1.0 / Block().restitution)})
    drawn = SpecimenKnowledge(restitution=0.2).draws(elastic, 50, np.random.default_rng(0))
    values = [each.block.restitution for each in drawn]
    assert max(values) == pytest.approx(1.0)
    assert min(values) < 0.95
