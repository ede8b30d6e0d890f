"""The promise of the guard holds through the real drivers: the emulated device is asked, not the program."""

import os

import pytest

from tests.faults.emulated.reaction import patient

pytestmark = pytest.mark.skipif(os.name != "posix", reason="an emulated laboratory for POSIX")


@pytest.mark.parametrize(("block", "lead", "phase"), [(200, 200, 0.75), (40, 200, 0.5)])
def test_one_block_and_the_lead(block: int, lead: int, phase: float) -> None:
    reaction = patient(block, lead, phase)
    assert lead <= reaction.measured <= reaction.promised
