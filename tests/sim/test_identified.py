"""What has been measured of a specimen, and the specimen that follows from it."""

from datetime import UTC, datetime

import numpy as np
import pytest
from pydantic import ValidationError

from sim.errors import InvalidInput
from sim.identified import Correlation, Finding, Identified
from sim.specimen import Frame, Specimen, Spring

DATE = datetime(2026, 11, 20, 9, 30, tzinfo=UTC)


def found(name: str, value: float, size: float) -> Finding:
    return Finding(name=name, value=value, standard_uncertainty=size, source="a decay", date=DATE)


def related(first: str, second: str, coefficient: float) -> Correlation:
    return Correlation(first=first, second=second, coefficient=coefficient)


FRAME = Identified(
    findings=(found("k1", 210.0, 0.5), found("k2", 57.0, 0.2), found("xi1", 0.012, 3e-4)),
    correlations=(related("k1", "k2", -0.6),),
)


def test_the_covariance_is_that_of_the_names_that_are_asked_for_in_their_order() -> None:
    expected = [[0.04, 0.0, -0.06], [0.0, 9e-8, 0.0], [-0.06, 0.0, 0.25]]
    np.testing.assert_allclose(FRAME.covariance(("k2", "xi1", "k1")), expected)
    with pytest.raises(InvalidInput, match=r"m1.*k1, k2, xi1"):
        FRAME.covariance(("k1", "m1"))


def test_newer_findings_replace_older_ones_and_their_correlations() -> None:
    more = FRAME.extended([found("k_c:0.250", 52.0, 0.3)], [related("k_c:0.25", "xi1", 0.1)])
    assert more.names == ("k1", "k2", "xi1", "k_c:0.25")
    again = more.extended([found("k1", 211.0, 0.4), found("xi1", 0.011, 1e-4)])
    assert again.names == ("k2", "k_c:0.25", "k1", "xi1")
    assert again.finding("k1") == found("k1", 211.0, 0.4)
    assert again.correlations == ()
    assert more.extended([], [related("k2", "k1", 0.2)]).covariance(("k1", "k2"))[0, 1] == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("k3", 1.0, "nearest is k1|no such quantity"),
        ("restitution", 0.99, "the nearest is restitution_factor"),
        ("k_c:soft", 1.0, "a number above 0"),
        ("k_c:-1", 1.0, "a number above 0"),
        ("k1", 0.0, "above 0"),
        ("xi1", -1e-4, "greater than or equal to 0"),
        ("xi1", 1.0, "below 1"),
        ("restitution_factor", 2.5, "below 2"),
        ("k1", np.nan, "finite"),
    ],
)
def test_what_cannot_be_found_is_refused(name: str, value: float, said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        found(name, value, 0.1)


@pytest.mark.parametrize(
    ("correlations", "said"),
    [
        ((related("k1", "m1", 0.1),), "no such finding"),
        ((related("k1", "k1", 0.1),), "two different findings"),
        ((related("k1", "k2", 0.1), related("k2", "k1", 0.1)), "each pair may occur only once"),
        ((related("k1", "k2", -0.9), related("k2", "xi1", -0.9), related("k1", "xi1", -0.9)), "negative eigenvalue"),
    ],
)
def test_correlations_that_cannot_be_are_refused(correlations: tuple[Correlation, ...], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        Identified(findings=FRAME.findings, correlations=correlations)


def test_errors_that_are_one_and_the_same_are_no_contradiction() -> None:
    pairs = [("k1", "k2"), ("k2", "xi1"), ("k1", "xi1")]
    whole = Identified(findings=FRAME.findings, correlations=tuple(related(*pair, 1.0) for pair in pairs))
    assert np.linalg.matrix_rank(whole.covariance(whole.names), tol=1e-12) == 1


def test_identified_values_stand_in_place_of_assumed_ones_and_labels_stay() -> None:
    identified = FRAME.extended([found("k_c:0.25", 52.0, 0.3), found("restitution_factor", 0.992, 0.001)])
    best = identified.applied(Specimen())
    assert (best.frame.k1, best.frame.k2, best.frame.xi1, best.frame.m1) == (210.0, 57.0, 0.012, 1.062)
    product = best.frame.m1 * best.frame.m2 * np.prod(np.square(best.frame.natural_frequencies))
    assert product == pytest.approx(210.0 * 57.0)
    assert best.block.restitution_factor == 0.992
    measured, other = best.coupled(0.25), best.coupled(0.64)
    assert (measured.k_c, measured.label) == (pytest.approx(52.0), 0.25)
    assert measured.nominal_k_c == pytest.approx(0.25 * 213.44)
    assert measured.beta == pytest.approx(52.0 / 210.0)
    # the label of a spring that was not measured means what it meant before k1 was
    assert other.k_c == other.nominal_k_c == pytest.approx(0.64 * 213.44)
    assert (other.label, other.beta) == (0.64, pytest.approx(0.64 * 213.44 / 210.0))
    assert measured.bare().coupled(0.64) == other
    assert identified.applied(best) == best


def test_what_is_mounted_is_identified_where_it_stands() -> None:
    assert FRAME.applied(Specimen(beta=0.25)).k_c == pytest.approx(0.25 * 213.44)
    assert FRAME.extended([found("k_c:0.25", 50.0, 0.1)]).applied(Specimen(beta=0.25)).k_c == pytest.approx(50.0)


def test_nothing_identified_changes_nothing() -> None:
    assert Identified().applied(Specimen()) == Specimen()
    assert Specimen().coupled(0.4) == Specimen(beta=0.4)


def test_a_mounted_spring_keeps_its_stiffness_whatever_its_label() -> None:
    mounted = Specimen(beta=0.3, spring_label=0.25)
    assert Identified().applied(mounted) == mounted
    assert mounted.coupled(0.25) == mounted
    assert FRAME.applied(mounted).k_c == pytest.approx(0.3 * 213.44)
    assert FRAME.applied(mounted).label == 0.25
    assert FRAME.extended([found("k_c:0.25", 50.0, 0.1)]).applied(mounted).k_c == pytest.approx(50.0)
    # another label is that of another spring
    assert mounted.coupled(0.4).k_c == pytest.approx(0.4 * 213.44)


def test_a_spring_of_any_stiffness_is_called_what_it_amounts_to() -> None:
    drawer = Specimen(frame=Frame(k1=200.0), spring_k1=213.44, springs=(Spring(label=0.5, k_c=99.0),))
    mounted = drawer.with_spring(0.3 * 213.44)
    assert (mounted.label, mounted.k_c, mounted.beta) == (pytest.approx(0.3), pytest.approx(64.032), 64.032 / 200.0)


def test_a_specimen_that_cannot_be_is_refused_with_its_reason() -> None:
    with pytest.raises(
        InvalidInput, match=r"these values do not form a valid specimen: .*an impact can neither increase"
    ):
        Identified(findings=(found("restitution_factor", 1.2, 0.1),)).applied(Specimen())
    with pytest.raises(ValidationError, match="label"):
        Specimen(springs=(Spring(label=0.5, k_c=99.0), Spring(label=0.5, k_c=98.0)))
    with pytest.raises(ValidationError, match="the bare frame has no spring"):
        Specimen(spring_label=0.5)
