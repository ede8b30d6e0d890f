"""How well a specimen is known: what is drawn from it, and what is left to first order."""

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.identified import Correlation, Finding, Identified
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Frame, Specimen

DATE = datetime(2026, 11, 20, tzinfo=UTC)


def identified(
    sizes: dict[str, tuple[float, float]], pairs: dict[tuple[str, str], float] | None = None
) -> SpecimenKnowledge:
    findings = [
        Finding(name=name, value=value, standard_uncertainty=size, source="a decay", date=DATE)
        for name, (value, size) in sizes.items()
    ]
    related = [Correlation(first=one, second=other, coefficient=c) for (one, other), c in (pairs or {}).items()]
    return SpecimenKnowledge(identified=Identified(findings=tuple(findings), correlations=tuple(related)))


MEASURED = identified(
    {
        "m1": (1.05, 0.01),
        "k1": (210.0, 2.0),
        "k2": (57.0, 0.5),
        "xi1": (0.012, 4e-4),
        "restitution_factor": (0.99, 0.001),
        "k_c:0.64": (140.0, 1.5),
    },
    {("m1", "k1"): 0.7, ("k1", "k2"): -0.5, ("k2", "m1"): -0.3, ("k_c:0.64", "k1"): 0.4},
)
BEST = MEASURED.identified.applied(Specimen()).coupled(0.64)


def numbers(specimen: Specimen) -> list[float]:
    frame = specimen.frame
    return [frame.m1, frame.k1, frame.k2, frame.xi1, specimen.block.restitution_factor, specimen.k_c]


def test_a_quantity_that_was_measured_as_zero_stays_zero() -> None:
    known = identified({"xi1": (0.0, 0.001), "k1": (213.0, 1.0)})
    undamped = Specimen(frame=Frame(xi1=0.0))
    assert {each.frame.xi1 for each in known.draws(undamped, 5, np.random.default_rng(1))} == {0.0}


def test_measured_quantities_are_drawn_with_their_covariance_and_the_others_within_their_half_widths() -> None:
    n = 4000
    drawn = MEASURED.draws(BEST, n, np.random.default_rng(5))
    values = np.array([numbers(each) for each in drawn])
    covariance = MEASURED.identified.covariance(("m1", "k1", "k2", "xi1", "restitution_factor", "k_c:0.64"))
    sizes = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(values.mean(axis=0), numbers(BEST), atol=4.0 * sizes.max() / n**0.5)
    # five standard deviations of a variance and of a covariance from so many draws
    off = np.cov(values.T) / np.outer(sizes, sizes) - covariance / np.outer(sizes, sizes)
    assert np.abs(off).max() < 5.0 * (2.0 / n) ** 0.5
    # m2 is exactly known, xi2 lies within its half width
    assert {each.frame.m2 for each in drawn} == {1.062}
    xi2 = np.array([each.frame.xi2 for each in drawn]) / 0.035 - 1.0
    assert 0.29 < np.abs(xi2).max() <= 0.30


def test_errors_that_are_one_and_the_same_stay_so_in_every_draw() -> None:
    """Of a covariance without a Cholesky factor: it is only semidefinite."""
    pairs = {("k1", "k2"): 1.0, ("k2", "m1"): 1.0, ("k1", "m1"): 1.0}
    known = identified({"m1": (1.0, 0.01), "k1": (200.0, 2.0), "k2": (50.0, 0.5)}, pairs)
    best = known.identified.applied(Specimen())
    drawn = known.draws(best, 50, np.random.default_rng(1))
    factors = np.array([(d.frame.m1 / 1.0, d.frame.k1 / 200.0, d.frame.k2 / 50.0) for d in drawn])
    np.testing.assert_allclose(factors, factors[:, [0]] * np.ones(3), rtol=1e-9)
    assert factors.std() > 0.005


def test_draws_stay_within_what_a_specimen_can_be() -> None:
    vague = identified(
        {"k1": (213.0, 200.0), "xi1": (0.01, 0.05), "xi2": (0.9, 0.5), "restitution_factor": (1.02, 0.05)}
    )
    drawn = vague.draws(vague.identified.applied(Specimen()).coupled(0.4), 300, np.random.default_rng(0))
    assert min(d.frame.k1 for d in drawn) > 0.0
    assert min(d.frame.xi1 for d in drawn) > 0.0
    assert max(d.frame.xi2 for d in drawn) < 1.0
    assert max(d.block.restitution for d in drawn) < 1.0


def test_a_spring_that_was_not_measured_keeps_its_half_width_whatever_k1_is() -> None:
    other = MEASURED.identified.applied(Specimen()).coupled(0.25)
    drawn = MEASURED.draws(other, 300, np.random.default_rng(2))
    assert np.abs([d.k_c / (0.25 * 213.44) - 1.0 for d in drawn]).max() <= 0.10 + 1e-12
    assert np.ptp([d.k_c for d in drawn]) > 0.19 * other.k_c


def test_parts_are_looked_at_one_by_one() -> None:
    spring = MEASURED.only("spring").draws(BEST, 20, np.random.default_rng(0))
    frames = {d.frame.model_dump_json() for d in spring}
    assert (len(frames), len({d.k_c for d in spring})) == (1, 20)
    frame = MEASURED.only("stiffness", "damping")
    assert set(frame.relative(BEST)) == {"m1", "k1", "k2", "xi1", "xi2"}
    assert frame.correlations(BEST)["k1", "m1"] == pytest.approx(0.7)
    assert MEASURED.only().draws(BEST, 2, np.random.default_rng(0)) == [BEST, BEST]


def test_a_table_that_gives_way_adds_to_the_restitution_and_weakens_its_correlations() -> None:
    known = identified({"k1": (210.0, 1.0), "restitution_factor": (0.99, 0.0099)}, {("k1", "restitution_factor"): 0.8})
    given = known.model_copy(update={"give": 0.03})
    sizes = given.relative(BEST)
    assert sizes["restitution_factor"] == pytest.approx(np.hypot(0.01, 0.03 / np.sqrt(3.0)))
    (correlation,) = given.correlations(BEST).values()
    assert correlation * sizes["restitution_factor"] == pytest.approx(0.8 * 0.01)
    drawn = given.draws(known.identified.applied(Specimen()), 4000, np.random.default_rng(3))
    spread = np.std([d.block.restitution_factor for d in drawn]) / 0.99
    assert spread == pytest.approx(sizes["restitution_factor"], rel=0.05)


@given(st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6))
def test_deviations_leave_of_a_linear_result_exactly_its_variance(slopes: list[float]) -> None:
    """g' C g with the whole covariance, GUM Eq. (13)."""
    known = MEASURED.model_copy(update=dict.fromkeys(("stiffness", "damping", "restitution", "spring"), 0.0))
    names = ("m1", "k1", "k2", "xi1", "restitution_factor", "k_c:0.64")
    scale = np.array(numbers(BEST))
    g = np.array(slopes) / scale
    pairs = known.deviations(BEST)
    found = sum((0.5 * float(g @ (np.array(numbers(a)) - numbers(b)))) ** 2 for a, b in pairs)
    assert found == pytest.approx(float(g @ known.identified.covariance(names) @ g), rel=1e-7, abs=1e-18)


def test_a_propagated_uncertainty_is_that_of_the_deviations_of_a_linear_result() -> None:
    slopes = {
        "m1": 2.0,
        "m2": -1.0,
        "k1": 1.0,
        "k2": -3.0,
        "xi1": 0.1,
        "xi2": 0.2,
        "restitution_factor": 5.0,
        "k_c": 0.7,
    }

    def result(specimen: Specimen) -> float:
        frame, block = specimen.frame, specimen.block
        values = {**frame.model_dump(), **block.model_dump(), "k_c": specimen.k_c}
        return float(sum(slope * values[name] / best[name] for name, slope in slopes.items()))

    best = {**BEST.frame.model_dump(), **BEST.block.model_dump(), "k_c": BEST.k_c}
    uncertainty, parts = MEASURED.propagated(BEST, slopes)
    sides = [result(one) - result(other) for one, other in MEASURED.deviations(BEST)]
    assert uncertainty == pytest.approx(0.5 * np.hypot.reduce(sides), rel=1e-9)
    # without the correlations it would be another
    assert uncertainty != pytest.approx(np.hypot.reduce(list(parts.values())), rel=0.05)
    assert list(parts.values()) == sorted(parts.values(), reverse=True)
    assert parts["k1"] == pytest.approx(2.0 / 210.0)
    assert "m2" not in parts
