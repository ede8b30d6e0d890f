"""The fault matrix on the emulated bench: every fault once in each run of the suite, everywhere in a long one."""

import os
from collections.abc import Iterator

import pytest

from bench.events import State
from tests.faults.emulated.catalogue import catalogue
from tests.faults.emulated.pool import Campaigns, Case, cases, few
from tests.faults.emulated.setup import PLACES

pytestmark = pytest.mark.skipif(os.name != "posix", reason="Windows has no pseudo-terminals, and does not fork")

FEW, ALL = few(), cases()
STATES = {place.name: place.state for place in PLACES}


@pytest.fixture(scope="module")
def campaigns() -> Iterator[Campaigns]:
    with Campaigns(FEW) as begun:
        yield begun


@pytest.mark.timeout(400)
@pytest.mark.parametrize("case", FEW, ids=lambda case: f"{case.fault} at {case.place}")
def test_every_fault(case: Case, campaigns: Campaigns) -> None:
    assert not campaigns.verdict(case).broken, str(campaigns.verdict(case))


def test_no_fault_and_no_state_is_left_out() -> None:
    names = [fault.name for fault in catalogue()]
    assert [case.fault for case in FEW] == names
    assert len(set(names)) == len(names)
    assert {STATES[case.place] for case in FEW} == set(State)
    for state in State:
        assert {case.fault for case in ALL if STATES[case.place] is state}
    assert len(set(ALL)) == len(ALL) >= 1000


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_everywhere() -> None:
    with Campaigns(ALL) as everywhere:
        verdicts = [everywhere.verdict(case) for case in ALL]
    assert not [str(verdict) for verdict in verdicts if verdict.broken]
