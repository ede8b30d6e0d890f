"""Every spelling of every format: what small writers wrote is read back to the last digit, every sample."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.read import read_accelerogram
from sim.errors import InvalidInput
from tests.bench.accelerograms import writers
from tests.bench.accelerograms.writers import Block

G = 9.80665
ENDS = ("\n", "\r\n", "\r\r\n", "\r")
STEPS = {".01000": 0.01, ".0050": 0.005, "0.02": 0.02, ".00390625": 0.00390625}

steps = st.sampled_from(sorted(STEPS))
ends = st.sampled_from(ENDS)
samples = st.lists(
    st.floats(-0.99, 0.99).filter(lambda value: abs(value) > 1e-8 or value == 0.0), min_size=2, max_size=43
).filter(lambda values: max(map(abs, values)) > 0.01)
quick = settings(max_examples=40, deadline=None)


@pytest.fixture(scope="module")
def back(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Accelerogram]:
    """Writes lines with an end of line, as bytes, and reads them with options."""
    file = tmp_path_factory.mktemp("records") / "record.txt"

    def write_and_read(
        lines: Sequence[str], end: str = "\n", last: str | None = None, **options: object
    ) -> Accelerogram:
        content = end.join(lines) + (end if last is None else last)
        file.write_bytes(content.encode("latin-1"))
        return read_accelerogram(Path(file), **options)  # type: ignore[arg-type]

    return write_and_read


def same(record: Accelerogram, block: Block, factor: float, dt: str) -> None:
    assert np.array_equal(record.acceleration, factor * block.values)
    assert record.dt == STEPS[dt]


@quick
@given(
    samples,
    st.integers(1, 8),
    steps,
    st.sampled_from(sorted(writers.PEER_SIZES)),
    st.sampled_from([(writers.fortran, 15, 7), (writers.fixed, 10, 6), (writers.scientific, 14, 7)]),
    ends,
    st.sampled_from([None, "", " \n \n", "\x1a\x1a"]),
)
def test_peer(
    back: Callable, values: list[float], columns: int, dt: str, size: str, form: tuple, end: str, last
) -> None:
    write, width, digits = form
    block = Block([write(value, width, digits) for value in values], columns)
    if not block.values.any():
        return
    record = back(writers.peer(block, dt, size), end, last)
    same(record, block, G, dt)
    assert (record.format, record.unit) == ("PEER AT2", "g")
    assert "SOMEWHERE" in record.header["line 2"]


@quick
@given(st.lists(st.integers(-9_999_999, -1), min_size=2, max_size=30), st.integers(4, 8), st.integers(0, 5))
def test_peer_whose_columns_all_touch(back: Callable, mantissas: list[int], columns: int, trailing: int) -> None:
    # no blank anywhere: only the width tells the numbers apart
    block = Block([writers.scientific(value * 1e-7, 13, 6) for value in mantissas], columns)
    lines = writers.peer(block, ".0050")
    record = back([*lines[:-1], lines[-1] + " " * trailing])
    same(record, block, G, ".0050")


def test_peer_of_an_earlier_stage_counts_by_its_last_header(back: Callable) -> None:
    block = Block([writers.fortran(0.1 * k, 15, 7) for k in range(1, 10)], 5)
    record = back(writers.peer_matched(block, ".0050"))
    same(record, block, G, ".0050")
    assert len(record.header) == 7


def test_fortrans_long_exponents(back: Callable) -> None:
    lines = writers.peer(Block([" 1.25D-01", "-2.50D+00"], 2), ".0050", unit="CM/SEC/SEC")
    assert back(lines).acceleration.tolist() == pytest.approx([0.00125, -0.025], rel=1e-15)


@quick
@given(samples, steps, ends, st.sampled_from([("cm/s^2", 0.01), ("m/s^2", 1.0), ("mm/s^2", 0.001)]))
def test_esm(back: Callable, values: list[float], dt: str, end: str, unit: tuple[str, float]) -> None:
    block = Block([f"{100.0 * value:.6f}" for value in values], 1)
    record = back(writers.esm(block, dt, unit=unit[0]), end)
    same(record, block, unit[1], dt)
    assert record.format == "ESM ASCII"
    assert record.header["STREAM"] == "HNE"
    assert "MAGNITUDE_W" not in record.header


@quick
@given(samples, steps, ends)
def test_itaca(back: Callable, values: list[float], dt: str, end: str) -> None:
    block = Block([writers.scientific(value, 14, 7) for value in values], 5)
    record = back(writers.itaca(block, dt), end)
    same(record, block, 1.0, dt)
    assert record.header["Station Code / Name"] == "1 / Nowhere: the centre"


@quick
@given(
    st.lists(st.lists(st.integers(-9_999_999, 99_999_999), min_size=2, max_size=30), min_size=1, max_size=3),
    steps,
    st.booleans(),
    st.sampled_from(["", "(8f10.6)"]),
    ends,
)
def test_csmip(back: Callable, channels: list[list[int]], dt: str, upper: bool, stated: str, end: str) -> None:
    # six decimals and two digits before them fill the ten places: positive numbers touch as well
    names = ["90 deg", "Up", "0 Deg"]
    blocks = {
        name: Block([writers.fixed(value * 1e-6, 10, 6) for value in values], 8)
        for name, values in zip(names, channels, strict=False)
    }
    lines = writers.csmip(blocks, dt, stated, upper)
    for number, (name, block) in enumerate(blocks.items(), 1):
        if not block.values.any():
            continue
        choice = {} if len(blocks) == 1 else {"channel": str(number) if upper else name.upper()}
        record = back(lines, end, "\x1a" * 5, **choice)
        same(record, block, 0.01, dt)
        assert record.name == ("record" if len(blocks) == 1 else f"record-ch{number}")


@quick
@given(
    st.lists(samples, min_size=1, max_size=3),
    steps,
    st.sampled_from([("(8F10.5)", writers.fixed, 10, 5, 8), ("(10F8.5)", writers.fixed, 8, 5, 10)]),
    st.sampled_from(["cm/sec2(04)", "cm/s^2", "cm/s^2 (4)"]),
)
def test_cosmos(back: Callable, channels: list[list[float]], dt: str, form: tuple, unit: str) -> None:
    stated, write, width, digits, columns = form
    names = ["270 deg", "Up", "0 deg"]
    blocks = {
        name: Block([write(value, width, digits) for value in values], columns)
        for name, values in zip(names, channels, strict=False)
    }
    lines = writers.cosmos(blocks, dt, stated, unit)
    for number, block in enumerate(blocks.values(), 1):
        record = back(lines, **({} if len(blocks) == 1 else {"channel": names[number - 1]}))
        same(record, block, 0.01, dt)
        assert record.format == "COSMOS"
        assert record.header["channel"] == f"{number} ({names[number - 1]})"


def test_cosmos_one_to_a_line(back: Callable) -> None:
    block = Block([f"{value:15.6E}" for value in (-2.770328e-05, 1.5, -3.25)], 1)
    same(back(writers.cosmos({"Up": block}, "0.02", "(1E15.6)")), block, 0.01, "0.02")


def test_cosmos_that_was_resampled_has_the_step_of_its_samples(back: Callable) -> None:
    block = Block([f"{value:15.6E}" for value in np.sin(np.arange(1200) / 30.0)], 1)
    lines = writers.cosmos({"Up": block}, "0.005", "(1E15.6)", recorder="0.010000")
    assert back(lines).dt == 0.005
    # a header whose step contradicts the stated duration
    with pytest.raises(InvalidInput, match=r"it states 6 s, but with the step of the header, 0.01 s"):
        back([line.replace("5.000000", "10.00000") for line in lines])


@pytest.mark.parametrize("form", ["{:.18e}", "{:.16f}", "{!r}"])
def test_times_with_all_their_digits(back: Callable, form: str) -> None:
    motion = np.sin(np.arange(4172) / 17.0)
    for time in (0.01 * np.arange(4172), 0.01 * np.arange(1, 4173)):
        lines = ["t [s],a [g]", *(f"{form.format(float(t))},{a:.7f}" for t, a in zip(time, motion, strict=True))]
        assert back(lines).dt == 0.01


@quick
@given(
    st.integers(1, 4),
    st.data(),
    st.sampled_from([("N-S", "K-NET ASCII", ""), ("4", "KiK-net ASCII", ".")]),
    ends,
)
def test_knet(back: Callable, seconds: int, data: st.DataObject, kind: tuple[str, str, str], end: str) -> None:
    counts = data.draw(st.lists(st.integers(-8_388_608, 8_388_607), min_size=10 * seconds, max_size=10 * seconds))
    if len(set(counts)) == 1:
        return
    # exact: the mean by whole numbers
    shifted = [(count * len(counts) - sum(counts)) / len(counts) for count in counts]
    gal = np.array(shifted) * (3920.0 / 6182761.0)
    record = back(writers.knet(counts, 10, f"{np.abs(gal).max():.3f}", kind[0], kind[2]), end)
    assert record.acceleration == pytest.approx(0.01 * gal, rel=1e-12, abs=1e-9)
    assert (record.dt, record.format) == (0.1, kind[1])
    assert "was subtracted" in record.header["note"]


@quick
@given(samples, st.integers(0, 4), st.sampled_from(["1 UNCORRECTED ACCELEROGRAM", "2 CORRECTED ACCELEROGRAM"]), ends)
def test_smc(back: Callable, values: list[float], comments: int, kind: str, end: str) -> None:
    # 1PE10.4E1 of Fortran: one digit for the exponent
    fields = [f"{value:.4E}" for value in (100.0 * value if abs(value) > 1e-6 else 0.0 for value in values)]
    block = Block([(field[:-2] + field[-1]).rjust(10) for field in fields], 8)
    record = back(writers.smc(block, "0.2000000E+03", kind, comments), end)
    same(record, block, 0.01, ".0050")
    assert record.unit == "cm/s2"


@quick
@given(
    samples,
    steps,
    st.sampled_from([",", ";", "\t", "  ", ", "]),
    st.sampled_from(["", "t,a", "t [s],a [g]", "% a comment, of dt=0.3 s\n# and one more"]),
    st.integers(0, 3),
    ends,
)
def test_time_and_acceleration(
    back: Callable, values: list[float], dt: str, separator: str, above: str, start: int, end: str
) -> None:
    values = [*values, 0.5]
    times = [f"{(k + start) * STEPS[dt]:.8f}" for k in range(len(values))]
    fields = [f"{value:.9e}" for value in values]
    top = above.split("\n") if above else []
    if top and not top[0].startswith("%"):
        top = [separator.join(top[0].split(","))]
    rows = [time + separator + field for time, field in zip(times, fields, strict=True)]
    record = back([*top, *rows], end, unit="g")
    same(record, Block(fields, 1), G, dt)


@quick
@given(samples, st.integers(1, 4), steps, st.data())
def test_a_column_among_several(back: Callable, values: list[float], count: int, dt: str, data: st.DataObject) -> None:
    # there and back: it rises as often as it falls, as no time does
    table = [[f"{value * (1.0 + column):.7f}" for column in range(count)] for value in values + values[::-1]]
    column = data.draw(st.integers(1, count))
    options = {} if count == 1 else {"column": str(column)}
    record = back([" ".join(row) for row in table], dt=STEPS[dt], unit="cm/s2", **options)
    same(record, Block([row[column - 1] for row in table], 1), 0.01, dt)


def test_headings_name_column_and_unit(back: Callable) -> None:
    lines = ["t [s],NS [cm/s2],EW [g]", "0.00,1.0,0.1", "0.01,-2.0,0.2", "0.02,3.0,-0.3"]
    assert back(lines, column="NS").acceleration.tolist() == pytest.approx([0.01, -0.02, 0.03])
    record = back(lines, column="3", unit="g")
    assert record.acceleration[1] == 0.2 * G
    assert record.unit == "g"


def test_the_hash_is_that_of_the_bytes(back: Callable) -> None:
    lines = writers.peer(Block(["  .1000000E+00", " -.2000000E+00"], 2), ".01000")
    assert len({back(lines, end).sha256 for end in ENDS}) == 4
    # sha256sum of "0.5\n-0.25\n", by coreutils
    found = back(["0.5", "-0.25"], dt=0.01, unit="g").sha256
    assert found == "3272aa2dc7656a1f549dfdbbbe600b22b2f73911994a8481b2f5644a13626eec"


@pytest.mark.parametrize("heading", ["a [m/s\u00b2]", "a [m/s\u00c2\u00b2]", "a [cm/s\u00b2]"])
def test_a_superscript_two_in_both_encodings(back: Callable, heading: str) -> None:
    record = back([f"t [s],{heading}", "0.00,0.1", "0.01,0.2", "0.02,-0.3"])
    assert record.unit == heading[3 : heading.index("/")] + "/s2"


def test_a_remark_in_brackets_is_no_unit(back: Callable) -> None:
    lines = ["t [s],NS (filtered)", "0.00,0.1", "0.01,0.2", "0.02,-0.3"]
    assert back(lines, unit="g").unit == "g"
    with pytest.raises(InvalidInput, match="not a known unit of acceleration"):
        back(lines)


@pytest.mark.parametrize(
    ("comment", "options"),
    [
        ("% dt = 5 ms", {"dt": 0.005, "unit": "g"}),
        ("% dt = 1/200 s", {"dt": 0.005, "unit": "g"}),
        ("% converted from cm/s2 to m/s2", {"dt": 0.005, "unit": "m/s2"}),
    ],
)
def test_comments_that_agree(back: Callable, comment: str, options: dict[str, object]) -> None:
    assert back([comment, "0.1", "0.2", "-0.3"], **options).dt == 0.005
