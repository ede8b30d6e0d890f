"""Bands of a predicted gain: first order in two ways, and the Monte Carlo that both approximate."""

import numpy as np
import pytest

from bench.prediction.bands import bands, expanded_uncertainty, record_bands
from sim.excitation import SampledRecord
from sim.gain import predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Specimen
from sim.steady import resting_level

AMPLITUDE = 1.01 * 9.81 / 8.0
SURE = SpecimenKnowledge(stiffness=0.003, damping=0.02, restitution=0.001, spring=0.005)
"""Little enough is open that the gain is straight within it."""


@pytest.mark.parametrize(
    ("beta", "omega", "branch"), [(0.25, 20.0, "rocking"), (0.25, 20.0, "resting"), (0.64, 16.0, "rocking")]
)
def test_sensitivities_deviations_and_monte_carlo_agree_where_little_is_open(
    beta: float, omega: float, branch: str
) -> None:
    found = predict_gain(Specimen().coupled(beta), omega, AMPLITUDE).branches[branch]
    exact = expanded_uncertainty(found, SURE)
    assert exact is not None
    straight = bands([found.orbit], [found.alpha_2], SURE)
    assert straight.uncertainty[0] == pytest.approx(exact, rel=0.01)
    assert (straight.low[0], straight.high[0]) == pytest.approx(
        (found.alpha_2 - exact, found.alpha_2 + exact), rel=1e-3
    )
    drawn = bands([found.orbit], [found.alpha_2], SURE, members=1000)
    # three standard deviations of a standard deviation from so many draws
    assert drawn.uncertainty[0] == pytest.approx(exact, rel=3.0 / np.sqrt(2000.0))
    assert drawn.share[0] == 1.0
    assert drawn.low[0] < found.alpha_2 < drawn.high[0]


def test_where_the_motion_ends_within_the_band_the_other_side_counts_and_the_share_says_so() -> None:
    """A block so near to lifting that it rests with half of the specimens only."""
    specimen = Specimen().coupled(0.25)
    amplitude = 0.999 * resting_level(specimen, 20.0)
    resting = predict_gain(specimen, 20.0, amplitude).resting
    assert resting is not None
    straight = bands([resting.orbit], [resting.alpha_2], SURE)
    assert straight.uncertainty[0] > 0.0
    drawn = bands([resting.orbit], [resting.alpha_2], SURE, members=400)
    assert 0.3 < drawn.share[0] < 0.95
    # a linear motion has the same gain at every amplitude
    same = predict_gain(specimen, 20.0, 0.5 * amplitude).resting
    assert same is not None
    assert straight.uncertainty[0] == pytest.approx(expanded_uncertainty(same, SURE), rel=0.02)


def test_an_exactly_known_specimen_has_no_band() -> None:
    found = predict_gain(Specimen().coupled(0.64), 16.0, AMPLITUDE).rocking
    assert found is not None
    none = bands([found.orbit], [found.alpha_2], SpecimenKnowledge().only())
    assert (none.uncertainty[0], none.low[0], none.high[0]) == (0.0, found.alpha_2, found.alpha_2)


def test_under_a_record_the_band_holds_the_members_that_stood() -> None:
    t = np.arange(0.0, 3.0, 0.01)
    record = SampledRecord(2.2 * np.sin(16.0 * t) * np.sin(np.pi * t / 3.0), 0.01)
    specimens = [Specimen().coupled(beta) for beta in (0.64, 0.97)]
    found = record_bands(specimens, record, SpecimenKnowledge(), members=60)
    assert found.low.shape == (2,)
    assert (found.low < found.high).all()
    assert ((found.share > 0.0) & (found.share <= 1.0)).all()
