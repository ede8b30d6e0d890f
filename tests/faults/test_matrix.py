"""The fault matrix: every fault in every state of the engine. `tests/benchmarks/faults.py` goes to more places."""

from pathlib import Path

import pytest

from bench.events import State
from tests.faults.audit import judge
from tests.faults.catalogue import catalogue
from tests.faults.fault import Fault
from tests.faults.places import PLACES, Place

CATALOGUE = catalogue()
CORE = [place for place in PLACES if place.core]


def recorded(fault: Fault) -> Place:
    """The place at which the run with this fault has a data file, which takes three quarters of its time: another one
    for each fault in turn, so that every place has as many faults on record. The test marked soak has all.
    """
    return CORE[CATALOGUE.index(fault) % len(CORE)]


@pytest.mark.parametrize("fault", CATALOGUE, ids=lambda fault: fault.name)
def test_in_every_state(fault: Fault, tmp_path: Path) -> None:
    verdicts = [judge(fault, place, tmp_path, recorded=place is recorded(fault)) for place in CORE]
    assert not [str(verdict) for verdict in verdicts if verdict.broken]


@pytest.mark.soak
@pytest.mark.parametrize("fault", CATALOGUE, ids=lambda fault: fault.name)
def test_in_every_state_with_a_record(fault: Fault, tmp_path: Path) -> None:
    verdicts = [judge(fault, place, tmp_path) for place in CORE]
    assert not [str(verdict) for verdict in verdicts if verdict.broken]


def test_the_matrix_is_whole() -> None:
    assert {place.state for place in CORE} == set(State)
    assert len({fault.name for fault in CATALOGUE}) == len(CATALOGUE)
    assert len(CATALOGUE) * len(CORE) >= 1000
    on_record = [recorded(fault).name for fault in CATALOGUE]
    assert all(on_record.count(place.name) >= len(on_record) // len(CORE) for place in CORE)
