"""Values on the line against the numbers of the manual of the optoNCDT 1420 (pp. 65, 66, 84)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.emulation.optoncdt.evaluation import distance_codes, mastered_codes, words
from tests.drivers.emulation.optoncdt_client import decode

CODES = st.integers(0, 2**18 - 1)


@pytest.mark.parametrize(
    ("value", "first", "additional"),
    [
        (0, "00 40 80", "00 40 C0"),
        (643, "03 4A 80", "03 4A C0"),
        (32760, "38 7F 87", "38 7F C7"),
        (64877, "2D 75 8F", "2D 75 CF"),
        (65520, "30 7F 8F", "30 7F CF"),
        (262076, "3C 7E BF", "3C 7E FF"),
        (262082, "02 7F BF", "02 7F FF"),
    ],
)
def test_bytes_of_a_value(value: int, first: str, additional: str) -> None:
    sent = words(np.array([[value, value]]))
    assert sent.tobytes() == bytes.fromhex(first + additional)


@given(st.lists(st.tuples(CODES, CODES, CODES), min_size=1, max_size=20))
def test_a_reader_gets_back_what_was_sent(blocks: list[tuple[int, int, int]]) -> None:
    values, rest = decode(words(np.array(blocks)).tobytes())
    assert not rest
    assert values == [(value, place == 0) for block in blocks for place, value in enumerate(block)]


@given(st.lists(CODES, min_size=4, max_size=4), st.integers(0, 11))
def test_a_lost_byte_costs_one_value(values: list[int], lost: int) -> None:
    sent = words(np.array([values]).T).tobytes()
    kept = [value for value, _ in decode(sent[:lost] + sent[lost + 1 :])[0]]
    assert kept == values[: lost // 3] + values[lost // 3 + 1 :]


@pytest.mark.parametrize(
    ("share", "code"),
    # start and end of the reserve, start, middle and end of the measuring range
    [(-0.01, 0), (0.0, 642), (0.5, 32760), (1.0, 64878), (1.01, 65520)],
)
def test_code_of_a_distance(share: float, code: int) -> None:
    assert distance_codes(np.array([share]))[0] == code


@pytest.mark.parametrize(("share", "code"), [(-0.6, 0), (-0.51, 0), (0.0, 32760), (1.0, 96995), (3.0, 225466)])
def test_code_of_a_mastered_distance(share: float, code: int) -> None:
    assert mastered_codes(np.array([share]))[0] == code
