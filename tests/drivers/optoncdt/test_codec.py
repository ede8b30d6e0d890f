"""Words against the manual's numbers, and against a state machine that looks at one byte at a time."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.optoncdt.codec import Decoder, code_of, distance, encode

MANUAL = [
    # value, bytes as first and as additional value, mm on a sensor of 10 mm and on one of 50 mm
    (0, "00 40 80", "00 40 C0", -0.100, -0.500),
    (643, "03 4A 80", "03 4A C0", 0.00010, 0.00050),
    (32760, "38 7F 87", "38 7F C7", 5.0, 25.0),
    (32521, "09 7C 87", "09 7C C7", 4.962794, 24.813965),
    (64877, "2D 75 8F", "2D 75 CF", 9.999899, 49.999496),
    (65520, "30 7F 8F", "30 7F CF", 10.100, 50.500),
]
ERRORS = [(262076, "3C 7E BF", "3C 7E FF"), (262082, "02 7F BF", "02 7F FF"), (262075, "3B 7E BF", "3B 7E FF")]

values = st.integers(0, 2**18 - 1)
words = st.lists(st.tuples(values, st.booleans()), max_size=30)


class ByteWise:
    """The rule for one byte at a time: 00 begins a word, 01 goes on, 1x ends it; all else is dropped."""

    def __init__(self) -> None:
        self.have: list[int] = []
        self.words: list[tuple[int, bool]] = []

    def feed(self, data: bytes) -> None:
        for byte in data:
            if byte < 0x40:
                self.have = [byte]
            elif byte < 0x80 and len(self.have) == 1:
                self.have.append(byte)
            elif byte >= 0x80 and len(self.have) == 2:
                low, middle = self.have
                self.words.append((low + 64 * (middle - 64) + 4096 * (byte % 64), byte < 0xC0))
                self.have = []
            else:
                self.have = []


def decoded(decoder: Decoder, chunks: list[bytes]) -> list[tuple[int, bool]]:
    fed = [decoder.feed(chunk) for chunk in chunks]
    return [(int(code), bool(first)) for one in fed for code, first in zip(one.code, one.first, strict=True)]


def cut(data: bytes, places: list[int]) -> list[bytes]:
    edges = [0, *sorted(place % (len(data) + 1) for place in places), len(data)]
    return [data[a:b] for a, b in pairwise(edges)]


@pytest.mark.parametrize(("value", "first", "additional"), [row[:3] for row in MANUAL] + ERRORS)
def test_words_are_those_of_the_manual(value: int, first: str, additional: str) -> None:
    assert encode(value, True) == bytes.fromhex(first)
    assert encode(value, False) == bytes.fromhex(additional)
    assert decoded(Decoder(), [bytes.fromhex(first + additional)]) == [(value, True), (value, False)]


@pytest.mark.parametrize(("value", "small", "large"), [(row[0], *row[3:]) for row in MANUAL])
def test_distances_are_those_of_the_manual(value: int, small: float, large: float) -> None:
    assert distance(value, 0.010) == pytest.approx(small * 1e-3, abs=6e-9)
    assert distance(value, 0.050) == pytest.approx(large * 1e-3, abs=6e-9)
    assert code_of(distance(value, 0.050), 0.050) == pytest.approx(value, abs=1e-9)


def test_readings_of_a_real_sensor_are_whole_codes() -> None:
    """Distances that an ILD1420-50 gave as 32-bit floats in mm."""
    read = np.array([24.813969, 24.816301])
    np.testing.assert_allclose(code_of(read * 1e-3, 0.050), [32521, 32524], atol=0.01)


@given(st.binary(max_size=200), st.lists(st.integers(0), max_size=5))
def test_any_bytes_cut_anywhere_are_decoded_as_one_by_one(data: bytes, places: list[int]) -> None:
    decoder, rule = Decoder(), ByteWise()
    rule.feed(data)
    assert decoded(decoder, cut(data, places)) == rule.words


@given(words, st.lists(st.integers(0), max_size=5))
def test_a_clean_stream_comes_back_whole(sent: list[tuple[int, bool]], places: list[int]) -> None:
    decoder = Decoder()
    data = b"".join(encode(*word) for word in sent)
    assert decoded(decoder, cut(data, places)) == sent


@given(st.lists(st.tuples(values, st.booleans()), min_size=1, max_size=20), st.integers(0))
def test_a_lost_byte_costs_one_value(sent: list[tuple[int, bool]], place: int) -> None:
    data = b"".join(encode(*word) for word in sent)
    place %= len(data)
    there = decoded(Decoder(), [data[:place] + data[place + 1 :]])
    assert there == sent[: place // 3] + sent[place // 3 + 1 :]


@given(words, st.lists(st.tuples(st.integers(0), st.binary(max_size=20)), max_size=4))
def test_text_between_words_never_makes_a_value(sent: list[tuple[int, bool]], texts: list[tuple[int, bytes]]) -> None:
    stream = [encode(*word) for word in sent]
    for place, text in texts:
        stream.insert(place % (len(stream) + 1), bytes(byte & 0x7F for byte in text))
    assert decoded(Decoder(), [b"".join(stream)]) == sent


def test_a_word_is_not_continued_after_a_restart() -> None:
    decoder = Decoder()
    decoder.feed(encode(1234, True)[:2])
    decoder.restart()
    assert decoded(decoder, [encode(1234, True)[2:], encode(99, False)]) == [(99, False)]
