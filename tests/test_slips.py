"""No slip passes in silence: a thousand of them, generated over every numeric key and option."""

from tests.slips import answered, chosen, silent, slips


def test_none_of_a_thousand_slips_is_accepted_in_silence() -> None:
    taken = chosen(1000, 20260101)
    assert {slip.place for slip in taken} == {slip.place for slip in slips(20260101)}
    quiet = [(slip.place, slip.typed, slip.kind) for slip in taken if silent(slip, answered(slip))]
    assert quiet == []
