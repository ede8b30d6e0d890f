"""What is read out of answers, however they are laid out and whatever is in between."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.optoncdt.codec import encode
from drivers.optoncdt.dialogue import Reply, error_in, parameters_in
from drivers.optoncdt.search import info_in
from tests.drivers.optoncdt.script import INFO


def reply(*chunks: bytes) -> Reply:
    heard = Reply()
    for chunk in chunks:
        assert not heard.complete
        heard.feed(chunk)
    return heard


@given(st.integers(0, 2**32 - 1), st.floats(0, 1), st.integers(1, 50))
def test_measured_values_between_the_characters_of_an_answer_do_not_matter(seed: int, share: float, cut: int) -> None:
    random = Random(seed)
    mixed = b""
    for place, character in enumerate(INFO):
        # within the prompt nothing could tell its second character from a value that begins with the same byte
        while place < len(INFO) - 1 and random.random() < 0.5 * share:
            mixed += encode(random.randrange(2**18), random.random() < 0.5)
        mixed += bytes((character,))
    heard = reply(*(mixed[place : place + cut] for place in range(0, len(mixed), cut)))
    assert heard.complete
    assert heard.lines == [line.strip() for line in INFO.decode().splitlines()[:-1]]


def test_what_follows_the_prompt_is_left() -> None:
    words = encode(32760, True) + encode(7, False)
    heard = reply(words + b"->" + words + words[:2])
    assert heard.complete
    assert heard.rest == words + words[:2]


@pytest.mark.parametrize("cut", [1, 2])
def test_a_prompt_within_a_value_is_told_apart(cut: int) -> None:
    word = encode(32760, True)
    heard = reply(word[:cut] + b"->" + word[cut:] + word)
    assert not heard.complete
    assert heard.prompt_in_value


def test_a_minus_sign_and_a_value_are_no_prompt() -> None:
    value = b">\x7f\x87"
    heard = reply(b"Name: ILD1420-", value[:1], value[1:], b"10\r\n")
    assert not heard.complete
    heard.feed(b"->")
    assert heard.complete
    assert heard.lines == ["Name: ILD1420-10"]


@given(st.lists(st.builds(encode, st.integers(0, 2**18 - 1), st.booleans())))
def test_measured_values_alone_are_no_answer(sent: list[bytes]) -> None:
    heard = reply(b"".join(sent))
    assert not heard.complete
    assert heard.lines == []


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("E202 Access denied", "E202 Access denied"),
        ("MEASRATE E236 Value out of range", "E236 Value out of range"),
        ("MEASRATE 9 E236 Value out of range", "E236 Value out of range"),
        ("E11 Of two digits", "E11 Of two digits"),
        ("W320 The measuring output was adapted", None),
        ("MEASRATE 9 ok", None),
        ("Article: E4120212", None),
        ("", None),
    ],
)
def test_errors_are_found_and_warnings_are_none(text: str, error: str | None) -> None:
    assert error_in("MEASRATE 9", reply(text.encode() + b"\r\n->").lines) == error


@pytest.mark.parametrize(
    "text", ["MEASRATE 4", "MEASRATE ok\r\nMEASRATE 4", "MEASRATE\t4  ", "MEASRATE MEASRATE 4\r\nMEASRATE ok", "4"]
)
def test_a_setting_is_read_with_or_without_echo(text: str) -> None:
    assert parameters_in("MEASRATE", reply(text.encode() + b"\r\n->").lines) == ["4"]


@pytest.mark.parametrize(
    "info", [INFO, INFO.replace(b":  ", b":\t"), INFO.replace(b"\r", b""), INFO[INFO.index(b"\n") :]]
)
def test_the_manuals_example_of_an_identity_is_read(info: bytes) -> None:
    found = info_in(reply(info).lines)
    assert found is not None
    assert found.supported
    assert (found.model, found.serial, found.firmware, found.article) == (
        "ILD1420-200",
        "15030002",
        "001.010",
        "4120212",
    )
    assert found.measuring_range == pytest.approx(0.2)


@pytest.mark.parametrize("model", ["ILD1320-10", "ILD14200-10", "IFD2410", "XILD1420-10"])
def test_other_models_are_told_apart(model: str) -> None:
    found = info_in(reply(INFO.replace(b"ILD1420-200", model.encode())).lines)
    assert found is not None
    assert not found.supported


@pytest.mark.parametrize("text", ["", "Name: \r\nMeasuring range: 10mm", "Name: ILD1420-10", "OK", "E210 Unknown"])
def test_what_is_no_identity_is_none(text: str) -> None:
    assert info_in(text.splitlines()) is None
