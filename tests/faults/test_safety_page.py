"""The page on safety says what the program does."""

from pathlib import Path

import pytest

from bench.engine.output import TRANSITIONS
from bench.events import State
from bench.guard.limits import Debounce, Limits, Ramps, Warnings
from tests.faults.catalogue import catalogue
from tests.faults.emulated.pool import cases, few
from tests.faults.places import PLACES

PAGE = (Path(__file__).parents[2] / "docs" / "safety.md").read_text()
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line.startswith("|")]


@pytest.mark.parametrize("state", State)
def test_every_state_goes_where_the_page_says(state: State) -> None:
    (row,) = [row for row in ROWS if row[0] == state.value]
    assert {name for name in row[2].split(", ") if name} == {after.value for after in TRANSITIONS[state]}


@pytest.mark.parametrize(
    "name", sorted(set(Limits.model_fields) - {"warning", "debounce", "heating_time", "confirmed", "cut"})
)
def test_every_limit_has_its_default_on_the_page(name: str) -> None:
    (row,) = [row for row in ROWS if row[0] == f"`limits.{name}`"]
    assert float(row[1].split()[0]) == getattr(Limits(), name)
    if name in Debounce.model_fields:
        ms = 1e3 * getattr(Debounce(), name)
        assert row[3] == (f"{ms:g} ms" if ms else "at once")


def test_numbers_in_the_text() -> None:
    assert "`limits.confirmed`" in PAGE
    assert "`limits.cut`" in PAGE
    assert Limits().cut == ()
    assert f"`ramps.stop` = {Ramps().stop:g} s" in PAGE
    assert f"`ramps.abort` = {Ramps().abort:g} s" in PAGE
    assert sorted(getattr(Warnings(), name) for name in Warnings.model_fields)[4] == 0.9
    core = sum(place.core for place in PLACES)
    assert f"{len(State) * len(catalogue())} faults in each run of the test suite" in PAGE
    assert f"{core * len(catalogue())} in its long tests" in PAGE
    assert f"{len(PLACES) * len(catalogue())} in `python" in " ".join(PAGE.split())
    assert f"{len(few())} faults once each" in PAGE
    assert f"{len(cases())} in `python" in PAGE
