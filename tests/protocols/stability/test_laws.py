"""Predictions for several laws of restitution, and the statements that compare the measured multipliers with them."""

import numpy as np
import pytest

from protocols.stability.laws import HOUSNER, WORDS, closest, deviation, implied, law_boundaries, law_prediction
from protocols.stability.protocol import OrbitStatus, StabilityPoint
from protocols.stability.results import laws_texts
from sim.knowledge import SpecimenKnowledge
from sim.shaker import Shaker
from sim.specimen import Block, Specimen
from sim.steady import Orbit, rocking_orbit
from sim.table_orbit import table_orbit

KNOWN = SpecimenKnowledge(stiffness=0.002, damping=0.01, spring=0.002, restitution=0.05)
SPECIMEN = Specimen(block=Block(restitution_factor=0.995)).coupled(0.97)
AMPLITUDE = 1.01 * SPECIMEN.uplift_acceleration


def orbit(factor: float = 0.995, omega: float = 15.0) -> Orbit:
    block = SPECIMEN.block.model_copy(update={"restitution_factor": factor})
    return rocking_orbit(SPECIMEN.model_copy(update={"block": block}), omega, AMPLITUDE)


def factors() -> dict[str, float]:
    """Restitution of each law for a slenderness of 8, over Housner's 254/260."""
    return {"consecutive": 257.0 / 254.0, "contact": 256.0 / 258.0 * 260.0 / 254.0}


def test_every_law_has_the_multiplier_of_its_restitution() -> None:
    found = law_prediction(orbit(), orbit().slowest, KNOWN, None, 1, None)
    assert found.moduli[HOUSNER] == abs(orbit().slowest)
    for law, factor in factors().items():
        assert found.moduli[law] == pytest.approx(orbit(factor).multiplier, rel=1e-9), law
    sides = [orbit(0.995 * (1.0 + side)).multiplier for side in (5e-4, -5e-4)]
    assert found.slope == pytest.approx((sides[0] - sides[1]) / 1e-3, rel=1e-4)
    # the restitution is exact under a law: only the rest of the specimen contributes
    exact = KNOWN.model_copy(update={"restitution": 0.0})
    pairs = [
        [rocking_orbit(each, 15.0, AMPLITUDE, guess=orbit()).multiplier for each in pair]
        for pair in exact.deviations(SPECIMEN)
    ]
    assert found.uncertainty == pytest.approx(0.5 * float(np.hypot.reduce([one - two for one, two in pairs])), rel=2e-3)


def test_on_a_table_the_laws_are_compared_there() -> None:
    shaker = Shaker()
    found = law_prediction(orbit(), 1.0 + 0j, KNOWN, shaker, 1, 0.5)
    contact = orbit((257.0 - 1.5) / (257.0 + 1.5) * 260.0 / 254.0)
    assert found.moduli["contact"] == pytest.approx(abs(table_orbit(contact, shaker, 1).slowest), rel=1e-4)


def test_the_implied_factor_is_that_of_the_orbit_with_the_measured_modulus() -> None:
    found = law_prediction(orbit(), orbit().slowest, KNOWN, None, 1, None)
    values = implied(found, 0.995, orbit(0.998).multiplier, 0.001)
    assert values["implied_factor"] == pytest.approx(0.998, abs=1e-5)
    assert values["implied_factor_uncertainty"] == pytest.approx(
        0.995 * np.hypot(0.001, 2.0 * found.uncertainty) / found.slope, rel=1e-9
    )


def point(modulus: float | None, **others: float | None) -> StabilityPoint:
    values = {"modulus_uncertainty": 0.003, "modulus_predicted": 1.01, "law_modulus_uncertainty": 0.004, **others}
    return StabilityPoint(
        omega_rad_s=15.0,
        amplitude_factor=1.01,
        beta=0.97,
        status=OrbitStatus.MEASURED,
        modulus=modulus,
        consecutive_modulus=1.02,
        contact_modulus=1.03,
        **values,
    )


def test_deviations_and_the_closest_law() -> None:
    assert deviation(point(1.0), HOUSNER) == pytest.approx(-2.0)
    assert deviation(point(1.0), "contact") == pytest.approx(-6.0)
    assert [closest(point(modulus)) for modulus in (1.0, 1.016, 1.1)] == [HOUSNER, "consecutive", "contact"]
    for lost in (point(None), point(1.0, law_modulus_uncertainty=None)):
        assert deviation(lost, HOUSNER) is None
        assert closest(lost) == ""
    assert closest(point(1.0, modulus_predicted=None)) == "consecutive"


OMEGAS = np.linspace(15.0, 15.6, 4)
CURVE = {
    "omega_rad_s": OMEGAS,
    "amplitude_factor": np.full(4, 1.01),
    "fixed_modulus": 1.02 - 0.1 * (OMEGAS - 15.0),
    "table_modulus": np.full(4, np.nan),
    "consecutive_modulus": 1.03 - 0.1 * (OMEGAS - 15.0),
    "contact_modulus": 1.04 - 0.1 * (OMEGAS - 15.0),
    "law_modulus_uncertainty": np.full(4, 0.002),
}


def test_boundaries_of_the_laws_with_their_uncertainty() -> None:
    found = law_boundaries(CURVE)
    assert {law: each.place for law, (each,) in found.items()} == pytest.approx(
        {HOUSNER: 15.2, "consecutive": 15.3, "contact": 15.4}
    )
    assert [each.uncertainty for (each,) in found.values()] == pytest.approx([0.02] * 3)
    assert law_boundaries({name: CURVE[name] for name in CURVE if "law" not in name}) == {}


def test_the_statements() -> None:
    points = [point(1.011, implied_factor=1.001, implied_factor_uncertainty=0.004), point(0.99)]
    points[1] = points[1].model_copy(update={"omega_rad_s": 15.2})
    texts = laws_texts(points, CURVE)
    assert texts[0] == f"{WORDS[HOUSNER]}: normalised deviation of |mu| -4.00 to +0.20, closest at 2 of 2 points"
    assert texts[1].endswith("closest at 0 of 2 points")
    # measured: from 1.011 at 15.0 to 0.990 at 15.2, u = 0.0015 over the slope of 0.105
    place, size = 15.0 + 0.011 / 0.105, 2.0 * 0.0015 / 0.105
    expected = (place - 15.3) / np.hypot(size, 0.02)
    assert (
        f"boundary 15.3000 +- 0.0200 rad/s (k = 2), normalised deviation of the measured one {expected:+.2f}"
        in texts[4]
    )
    assert texts[-1].endswith("amplitude factor 1.0100: 1.0010 +- 0.0040 (k = 2)")
    assert laws_texts([point(None)], {name: CURVE[name] for name in CURVE if "law" not in name}) == []
