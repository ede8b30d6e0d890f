"""The promise of the guard: one block and the lead after a limit is exceeded, the output changes."""

import pytest

from bench.config.sections import FAST
from tests.faults.reaction import RATE, react


@pytest.mark.parametrize(("block", "lead"), [(20, 0), (100, 100), (200, 200), (400, 100)])
@pytest.mark.parametrize("phase", [0.0, 0.25, 0.5, 0.75])
def test_one_block_and_the_lead(block: int, lead: int, phase: float) -> None:
    reaction = react(block, lead, phase)
    assert lead <= reaction.measured <= reaction.promised


@pytest.mark.parametrize("phase", [0.05, 0.35, 0.65, 0.95])
def test_the_profile_fast_reacts_within_20_ms(phase: float) -> None:
    block, lead = (round(seconds * RATE) for seconds in FAST)
    reaction = react(block, lead, phase)
    assert reaction.measured <= reaction.promised <= 0.020 * RATE
