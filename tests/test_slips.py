"""No slip passes in silence: some of the three thousand that are generated over every numeric key and option."""

import pytest

from tests.slips import answered, chosen, silent, slips


@pytest.mark.parametrize("count", [400, pytest.param(1000, marks=pytest.mark.soak)])
def test_no_slip_is_accepted_in_silence(count: int) -> None:
    """One at every place, and more of every kind."""
    taken = chosen(count, 20260101)
    assert {slip.place for slip in taken} == {slip.place for slip in slips(20260101)}
    quiet = [(slip.place, slip.typed, slip.kind) for slip in taken if silent(slip, answered(slip))]
    assert quiet == []
