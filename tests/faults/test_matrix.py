"""The fault matrix: every fault in every state of the engine; with the mark soak at every place, each with a data file.

`tests/benchmarks/faults.py` goes to more places.
"""

from pathlib import Path

import pytest

from bench.events import State
from tests.faults.audit import judge
from tests.faults.catalogue import catalogue
from tests.faults.fault import Fault
from tests.faults.places import PLACES, Place

CATALOGUE = catalogue()
CORE = [place for place in PLACES if place.core]


def injected(fault: Fault) -> list[Place]:
    """One place for each state of the engine: that of the record, and another one of those in the state for every 8th
    fault in turn.
    """
    turn, at = CATALOGUE.index(fault) // len(State), recorded(fault)
    places = [[place for place in CORE if place.state is state] for state in State]
    return [at if at in each else each[turn % len(each)] for each in places]


def recorded(fault: Fault) -> Place | None:
    """The place at which the run with this fault has a data file, which takes most of its time: for every fourth fault,
    another place in turn.
    """
    turn, other = divmod(CATALOGUE.index(fault), 4)
    return None if other else CORE[turn % len(CORE)]


@pytest.mark.parametrize("fault", CATALOGUE, ids=lambda fault: fault.name)
def test_in_every_state(fault: Fault, tmp_path: Path) -> None:
    at = recorded(fault)
    verdicts = [judge(fault, place, tmp_path, recorded=place is at) for place in injected(fault)]
    assert not [str(verdict) for verdict in verdicts if verdict.broken]


@pytest.mark.soak
@pytest.mark.parametrize("fault", CATALOGUE, ids=lambda fault: fault.name)
def test_at_every_place_with_a_record(fault: Fault, tmp_path: Path) -> None:
    verdicts = [judge(fault, place, tmp_path) for place in CORE]
    assert not [str(verdict) for verdict in verdicts if verdict.broken]


def test_the_matrix_is_whole() -> None:
    assert {place.state for place in CORE} == set(State)
    assert len({fault.name for fault in CATALOGUE}) == len(CATALOGUE)
    assert len(CATALOGUE) * len(CORE) >= 1000
    for fault in CATALOGUE:
        assert {place.state for place in injected(fault)} == set(State)
    visits = [place.name for fault in CATALOGUE for place in injected(fault)]
    on_record = [place.name for fault in CATALOGUE if (place := recorded(fault)) is not None]
    assert len(on_record) >= len(CATALOGUE) // 4
    for place in CORE:
        assert visits.count(place.name) >= len(CATALOGUE) // 5
        assert place.name in on_record
