"""Many specimens at once give what each gives alone."""

import numpy as np
import pytest

from sim.ensemble import record_gains, steady_gains
from sim.excitation import SampledRecord
from sim.gain import predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.rocking import simulate
from sim.specimen import Block, Specimen

AMPLITUDE = 1.01 * 9.81 / 8.0
KNOWN = SpecimenKnowledge()


def test_steady_gains_are_those_of_the_orbits_found_one_by_one() -> None:
    points = [(0.25, 20.0, "rocking"), (0.25, 20.0, "resting"), (0.64, 16.0, "rocking")]
    orbits, members = [], []
    for number, (beta, omega, branch) in enumerate(points):
        specimen = Specimen().coupled(beta)
        orbits.append(predict_gain(specimen, omega, AMPLITUDE).branches[branch].orbit)
        members.append(KNOWN.draws(specimen, 12, np.random.default_rng(number)))
    found = steady_gains(orbits, members, bare_amplitude=0.9 * AMPLITUDE)
    assert found.shape == (3, 12, 2)
    for i, (_, omega, branch) in enumerate(points):
        for j, member in enumerate(members[i]):
            alone = predict_gain(member, omega, AMPLITUDE, 0.9 * AMPLITUDE).branches.get(branch)
            expected = (np.nan, np.nan) if alone is None else (alone.alpha_1, alone.alpha_2)
            assert found[i, j] == pytest.approx(expected, rel=1e-9, nan_ok=True)


def test_a_member_far_from_the_known_orbit_is_followed_and_one_that_lifts_has_no_resting_motion() -> None:
    branches = predict_gain(Specimen().coupled(0.25), 20.0, AMPLITUDE).branches
    far = Specimen(block=Block(restitution_factor=0.9)).coupled(0.6)
    rocking, resting = steady_gains([branches["rocking"].orbit, branches["resting"].orbit], [[far], [far.coupled(1.2)]])
    alone = predict_gain(far, 20.0, AMPLITUDE).rocking
    assert alone is not None
    assert rocking[0, 1] == pytest.approx(alone.alpha_2, rel=1e-9)
    assert predict_gain(far.coupled(1.2), 20.0, AMPLITUDE).resting is None
    assert np.isnan(resting).all()


@pytest.mark.parametrize(("omega", "topples"), [(16.0, False), (9.0, True)])
def test_gains_under_a_record_are_those_of_single_runs_and_absent_where_the_block_topples(
    omega: float, topples: bool
) -> None:
    t = np.arange(0.0, 3.0, 0.01)
    record = SampledRecord(2.2 * np.sin(omega * t) * np.sin(np.pi * t / 3.0), 0.01)
    members = KNOWN.draws(Specimen().coupled(0.4), 8, np.random.default_rng(4))
    found = record_gains(members, record)
    for member, gains in zip(members, found, strict=True):
        coupled, bare = simulate(member, record), simulate(member.bare(), record)
        if coupled.overturned is None:
            assert gains[1] == pytest.approx(coupled.peaks.drift / bare.peaks.drift, rel=1e-5)
        else:
            assert np.isnan(gains).all()
    assert np.isnan(found).any() == topples
