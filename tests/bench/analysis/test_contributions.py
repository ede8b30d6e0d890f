"""Origin of the contributions to uncertainty budgets, and the combination of their degrees of freedom."""

from math import inf, sqrt

import pytest

from bench.analysis.contributions import SOURCES, largest_improvement
from bench.analysis.free_decay.covariance import COMMON, OWN
from bench.analysis.free_rocking.findings import Combined
from bench.analysis.multiplier import Multiplier
from bench.analysis.uncertainty import Budget, combined_freedom
from protocols.earthquake.uncertainty import CHOICE
from protocols.stability.release import parts_of


def test_the_example_of_the_gum_gives_its_degrees_of_freedom() -> None:
    """GUM H.1.6: end gauge, standard uncertainties in nm with 18, 25.6, 50 and 2 degrees of freedom: 16.7 in all."""
    found = combined_freedom([(25.0, 18.0), (9.7, 25.6), (2.9, 50.0), (16.6, 2.0)])
    assert found == pytest.approx(16.7, abs=0.2)
    assert combined_freedom([(1.0, inf), (2.0, inf)]) == inf
    assert combined_freedom([(0.0, 1.0)]) == inf


def test_the_improvement_is_the_contribution_with_the_largest_variance_of_all_results() -> None:
    found = largest_improvement([{"a": 3.0, "b": 4.0}, {"a": 0.3, "b": 0.4}])
    assert found is not None
    assert (found.name, found.factor) == ("b", pytest.approx(0.6))
    # every budget has the same weight, however large its unit
    small = largest_improvement([{"a": 1.0, "b": 0.0}, {"a": 0.0, "b": 1e-6}, {"b": 1e-6}])
    assert small is not None
    assert (small.name, small.factor) == ("b", pytest.approx(sqrt(1.0 / 3.0)))
    assert largest_improvement([]) is largest_improvement([{"a": 0.0}]) is None


def test_the_contributions_of_decays_and_of_the_block_have_an_origin() -> None:
    block = Combined(value=1.0, noise=0.0, timing=0.0, linearity=0.0, scale=0.0, scatter=0.0, birge=1.0)
    assert {*OWN, *COMMON, *block.parts()} <= SOURCES.keys()


def test_the_contributions_of_records_and_of_released_motions_have_an_origin() -> None:
    found = Multiplier(1.02, 1e-3, 2.8, 1e-3, 0.0, 1e-3, 1e-3, 60, 1, 0.0, 1e-6)
    released = parts_of(found, (0.1, 0.01), 0.005)
    assert {CHOICE, *released} <= SOURCES.keys()


def test_a_budget_states_few_degrees_of_freedom_only() -> None:
    parts = {"scatter of the cycles": 1.0, "timing of the lasers": 1.0}
    assert Budget(parts).fields["degrees_of_freedom"] is None
    few = Budget(parts, {"scatter of the cycles": 5.0}).fields["degrees_of_freedom"]
    assert few == pytest.approx(20.0)
