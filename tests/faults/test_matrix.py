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
RECORDED = 3
"""Places at which the run with a fault has a data file, which is three quarters of its time; the long test has all."""


def recorded(fault: Fault) -> list[Place]:
    """Other places for each fault in turn, so that every place has as many faults on record."""
    first = RECORDED * CATALOGUE.index(fault)
    return [CORE[(first + number) % len(CORE)] for number in range(RECORDED)]


@pytest.mark.parametrize("fault", CATALOGUE, ids=lambda fault: fault.name)
def test_in_every_state(fault: Fault, tmp_path: Path) -> None:
    verdicts = [judge(fault, place, tmp_path, recorded=place in recorded(fault)) for place in CORE]
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
    on_record = [place.name for fault in CATALOGUE for place in recorded(fault)]
    assert all(on_record.count(place.name) >= len(on_record) // len(CORE) for place in CORE)
