"""The one grammar of numbers that a person types, and the units that they may carry."""

import re
from math import isclose, pi

import pytest

from bench.config.numbers import read_band, read_number, read_values
from bench.config.validation import problems, read_fields, validated
from bench.prediction.requests import SineRequest
from protocols.common.identification.parameters import IdentifyParameters
from protocols.harmonic.protocol import HarmonicParameters
from sim.errors import InvalidInput
from sim.specimen import Frame


@pytest.mark.parametrize("text", ["12", "-0.25", "+3", ".5", "5.", "1e-3", "2E3", " 12 "])
def test_a_number_is_what_python_reads(text: str) -> None:
    assert read_number(text) == float(text)


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("0,25", "write 0.25; separate values by spaces"),
        (",5", "write 0.5"),
        ("1,5e3", "write 1.5e3"),
        ("0.25,0.64", "separate values by spaces"),
        ("1,2,3", "separate values by spaces"),
        ("", "no value"),
        ("  ", "no value"),
        ("0x10", "decimal number"),
        ("1_000", "decimal number"),
        ("1 000", "decimal number"),
        ("1e400", "exceeds"),
        ("1e99999999999", "exceeds"),
        ("nan", ""),
        ("inf", ""),
        ("-Infinity", ""),
        ("１２", ""),
        ("1.2.3", ""),
        ("--5", ""),
        ("five", ""),
        ("2:4:5", ""),
    ],
)
def test_what_is_no_number_is_refused_with_the_remedy(text: str, remedy: str) -> None:
    with pytest.raises(ValueError, match=re.escape(remedy) or "^$"):
        read_number(text)


@pytest.mark.parametrize("text", ["3.0", "1e3", "2.5", "1,5", "0x3", "3_0"])
def test_a_whole_number_is_typed_as_one(text: str) -> None:
    with pytest.raises(ValueError, match=r"^(write .*|)$"):
        read_number(text, "1", whole=True)
    assert read_number("-12", whole=True) == -12


def test_ranges_ascend_and_are_exact_decimals() -> None:
    assert read_values("0.1:0.5:5") == [0.1, 0.2, 0.3, 0.4, 0.5]
    assert read_values("1:9:3", whole=True) == [1, 5, 9]


@pytest.mark.parametrize(
    "text",
    [
        "1:2",
        "1:2:3:4",
        "1:2:1",
        "1:2:0",
        "1:2:-3",
        "1:1:5",
        "a:2:5",
        "1:2:2.5",
        "nan:2:5",
        "1:inf:5",
        "::",
        "1::5",
        "0x1:2:5",
        "1_0:20:5",
        "1/2:2:5",
        "1:2:10001",
        "1:1e9999:3",
        "1:1e999999999:3",
    ],
)
def test_a_range_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"start:stop:count|beyond"):
        read_values(text)


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("21:12:4", "write 12:21:4"),
        ("4:2:5Hz", "write 2:4:5Hz"),
        ("0,1:1:5", r"write 0\.1"),
        ("2Hz:4Hz:5", "at the end: 2:4:5Hz"),
    ],
)
def test_a_range_with_a_slip_names_what_to_write(text: str, remedy: str) -> None:
    with pytest.raises(ValueError, match=remedy):
        read_values(text, "rad/s")


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("60 mm", "m", 0.06),
        ("57mm", "m", 0.057),
        ("600 mm/s", "m/s", 0.6),
        ("0.2 N/mm", "N/m", 200.0),
        ("1062 g", "kg", 1.062),
        ("3.5 %", "1", 0.035),
        ("10 ms", "s", 0.01),
        ("2 kHz", "1/s", 2000.0),
        ("180 deg", "rad", pi),
        ("2.5Hz", "rad/s", 2.5 * 2.0 * pi),
        ("60 rpm", "rad/s", 2.0 * pi),
        ("90 deg/s", "rad/s", 0.5 * pi),
        ("12.5 rad/s", "Hz", 12.5 / (2.0 * pi)),
        ("100 mV/mm", "V/m", 100.0),
        ("0.1 V s^2/m", "V s2/m", 0.1),
        ("2 g_0", "m/s2", 2.0 * 9.80665),
        ("12 rad/s", "rad/s", 12.0),
        ("3 1/s", "1/s", 3.0),
        ("1 kΩ", "ohm", 1000.0),
    ],
)
def test_a_value_with_a_unit_is_converted(text: str, unit: str, value: float) -> None:
    assert isclose(read_number(text, unit), value, rel_tol=1e-15)


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("5 m", "s", r"m \(meter\) does not have the dimension of s \(second\)"),
        ("2.5 Hz", "m", "Hz .* does not have the dimension of m "),
        ("3 1/s", "rad/s", "1/s .* does not have the dimension of rad/s"),
        ("2 rad/s", "1/s", "rad/s .* does not have the dimension of 1/s"),
        ("2 g", "m/s2", "g is the gram; the acceleration of gravity is g_0"),
        ("20 deg", "1", "deg .* does not have the dimension of 1"),
        ("2 bananas", "m", "'bananas' is an unknown unit"),
        ("12 degC", "m", "dimension"),
        ("7 m", "", "without a unit"),
    ],
)
def test_a_unit_of_another_dimension_is_refused_naming_both(text: str, unit: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_number(text, unit)


def test_a_band_has_two_ends_that_ascend() -> None:
    assert read_band("1.5:25") == read_band("1.5:25Hz") == (1.5, 25.0)
    for text in ("25:1.5", "1,5:25", "0:3", "3", "a:3", "1:nan", "::"):
        with pytest.raises(ValueError, match=r"^(write 1\.5.*|there is no value.*|)$"):
            read_band(text)


@pytest.mark.parametrize("model", [SineRequest, HarmonicParameters])
def test_lists_are_read_alike_by_every_command(model: type[SineRequest] | type[HarmonicParameters]) -> None:
    typed = {"omega": ["2:4:5Hz"], "beta": ["0.25 0.64", "0.97"]}
    found = validated(model, read_fields(model, typed))
    assert found.omega == tuple(each * 2.0 * pi for each in (2.0, 2.5, 3.0, 3.5, 4.0))
    assert found.beta == (0.25, 0.64, 0.97)
    assert validated(model, read_fields(model, {"omega": ["2 Hz 3 Hz"]})).omega == (4.0 * pi, 6.0 * pi)
    for tokens, remedy in (
        (["0,25"], "write 0.25"),
        (["0.25,0.64"], "separate values by spaces"),
        (["0.64:0.25:3"], "write 0.25:0.64:3"),
        (["0.25", ""], "no value"),
        (["0.25%", "0.64"], "every value"),
    ):
        (problem,) = problems(model, read_fields(model, {"beta": tokens}))
        assert remedy in problem.allowed


def test_files_take_units_lists_and_ranges_as_texts() -> None:
    assert validated(HarmonicParameters, {"omega": "2:4:5 Hz"}).omega[0] == 4.0 * pi
    assert validated(HarmonicParameters, {"omega": ["2.5 Hz", 16]}).omega == (5.0 * pi, 16.0)
    assert validated(IdentifyParameters, {"band_low": "500 mHz", "band_high": 20}).band_low == 0.5
    assert validated(Frame, {"k1": "0.21344 N/mm"}).k1 == 213.44
    with pytest.raises(InvalidInput, match=r"k1 = '213' is refused: it must be a number above 0 N/m"):
        validated(Frame, {"k1": "213"})
    with pytest.raises(InvalidInput, match=r"k1 = '200 mm' is refused: mm .* dimension of N/m"):
        validated(Frame, {"k1": "200 mm"})
    with pytest.raises(InvalidInput, match=r"k1 = '213,44 N/m' is refused: write 213.44"):
        validated(Frame, {"k1": "213,44 N/m"})
