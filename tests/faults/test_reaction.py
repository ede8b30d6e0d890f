"""The promise of the guard: one block and the lead after a limit is exceeded, the output changes."""

import pytest

from tests.faults.reaction import react


@pytest.mark.parametrize(("block", "lead"), [(20, 0), (100, 100), (200, 200), (400, 100)])
@pytest.mark.parametrize("phase", [0.0, 0.25, 0.5, 0.75])
def test_one_block_and_the_lead(block: int, lead: int, phase: float) -> None:
    reaction = react(block, lead, phase)
    assert lead <= reaction.measured <= reaction.promised
