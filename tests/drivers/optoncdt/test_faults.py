"""What the sensor says instead of a distance is never taken for one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.optoncdt import codec
from drivers.optoncdt.codec import IMPLAUSIBLE, LATE, MEANINGS, distance, marked


@pytest.mark.parametrize(
    ("word", "mark", "meaning"),
    [
        (262075, codec.OTHER, "baud rate"),
        (262076, codec.NO_PEAK, "no reflection"),
        (262077, codec.TOO_CLOSE, "in front"),
        (262078, codec.TOO_FAR, "beyond"),
        (262079, codec.OTHER, "unknown"),
        (262080, codec.NOT_CALCULABLE, "calculated"),
        (262081, codec.TOO_WIDE, "too large"),
        (262082, codec.LASER_OFF, "off"),
        (262072, codec.OTHER, "unknown"),
        (262143, codec.OTHER, "unknown"),
        (65521, codec.OTHER, "unknown"),
        (-1, codec.OTHER, "unknown"),
    ],
)
def test_error_words_are_those_of_the_manual(word: int, mark: int, meaning: str) -> None:
    assert marked(np.array([word, 32760], dtype=np.int32)).tolist() == [mark, 0]
    assert meaning in MEANINGS[mark]


@given(st.lists(st.integers(0, 2**18 - 1), max_size=50))
def test_only_words_up_to_the_full_scale_are_distances(words: list[int]) -> None:
    counts = marked(np.array(words, dtype=np.int32))
    assert counts.dtype == np.int16
    for word, count in zip(words, counts.tolist(), strict=True):
        assert (count == word - 32760) if word <= 65520 else (count in MEANINGS)


def test_counts_are_from_mid_range_exactly() -> None:
    codes = np.arange(65521, dtype=np.int32)
    from_middle = marked(codes) * (1.02 * 0.2 / 65520)
    np.testing.assert_allclose(from_middle, distance(codes.astype(float), 0.2) - 0.1, atol=1e-15)


def test_every_count_that_is_no_distance_has_a_meaning() -> None:
    assert set(MEANINGS) == {*range(-32768, -32760), IMPLAUSIBLE, LATE}
