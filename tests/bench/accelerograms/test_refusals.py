"""What is not a whole acceleration record is refused, with the line; so is what contradicts a file."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from bench.accelerograms.read import read_accelerogram
from sim.errors import InvalidInput
from tests.bench.accelerograms import writers
from tests.bench.accelerograms.writers import Block

VALUES = [0.01 * (k % 7) - 0.031 for k in range(22)]

Refuse = Callable[..., str]


@pytest.fixture
def refuse(tmp_path: Path) -> Refuse:
    """Writes lines and returns what their reading is refused with."""

    def write_and_read(lines: Sequence[str], **options: object) -> str:
        file = tmp_path / "record.txt"
        file.write_text("\n".join(lines) + "\n", newline="\n")
        with pytest.raises(InvalidInput) as refusal:
            read_accelerogram(file, **options)  # type: ignore[arg-type]
        return str(refusal.value)

    return write_and_read


def e15(columns: int = 5) -> Block:
    return Block([writers.fortran(value, 15, 7) for value in VALUES], columns)


def f10() -> Block:
    return Block([writers.fixed(100.0 * value, 10, 5) for value in VALUES], 8)


def counts() -> list[str]:
    gal = [100 * k - 950 for k in range(20)]
    return writers.knet(gal, 10, f"{950 * 3920 / 6182761:.3f}")


COUNTED = {
    "peer": (writers.peer(e15(), ".01000"), 5),
    "esm": (writers.esm(Block([f"{value:.6f}" for value in VALUES], 1), "0.01"), 1),
    "itaca": (writers.itaca(Block([f"{value:14.7E}" for value in VALUES], 5), "0.005"), 5),
    "csmip": (writers.csmip({"Up": f10()}, ".020"), 3),
    "cosmos": (writers.cosmos({"Up": f10()}, "0.005", "(8F10.5)"), 3),
    "knet": (counts(), 3),
    "smc": (writers.smc(Block([f"{value:.4E}".replace("E-0", "E-").rjust(10) for value in VALUES], 8), "200."), 3),
}
"""A good file of each format, and a number of its rows of samples that reach its end or the next block."""


def first_row(lines: list[str]) -> int:
    """Index of the first row of samples: the one below the last header line of the first block."""
    marks = ("DT=", "USER5", "time series in", "EQUALLY SPACED", "acceleration pts, approx", "Memo.", "|a comment")
    return max(k for k, line in enumerate(lines[:90]) if any(mark in line for mark in marks)) + 1


def block_start(name: str) -> tuple[list[str], int]:
    lines = list(COUNTED[name][0])
    start = (
        next(k for k, line in enumerate(lines) if "EQUALLY SPACED" in line) + 1 if name == "csmip" else first_row(lines)
    )
    return lines, start


@pytest.mark.parametrize("name", COUNTED)
@pytest.mark.parametrize("junk", ["NaN", "inf", "*****", "1_000", "0x10", "1.2.3", "1,5", "1E999", "abc"])
def test_what_is_no_number_is_named_with_its_line(refuse: Refuse, name: str, junk: str) -> None:
    lines, start = block_start(name)
    line = start + 1
    width = next(
        k for k in range(1, len(lines[line]) + 1) if lines[line][:k].strip() and (k == len(lines[line]) or k % 5 == 0)
    )
    lines[line] = junk.rjust(width) + " " + lines[line][width + 1 :]
    assert f"line {line + 1} =" in refuse(lines)


@pytest.mark.parametrize("name", COUNTED)
def test_a_file_that_was_cut_off(refuse: Refuse, name: str) -> None:
    lines, start = block_start(name)
    message = refuse(lines[: start + 2])
    assert f"line {start + 2} =" in message
    assert "truncated" in message


@pytest.mark.parametrize("name", COUNTED)
def test_a_missing_row(refuse: Refuse, name: str) -> None:
    lines, start = block_start(name)
    del lines[start + 1]
    assert "samples" in refuse(lines)


@pytest.mark.parametrize("name", COUNTED)
def test_an_empty_line_within_the_samples(refuse: Refuse, name: str) -> None:
    lines, start = block_start(name)
    lines.insert(start + 1, "")
    message = refuse(lines)
    assert f"line {start + 2} =" in message
    assert "gap" in message


@pytest.mark.parametrize("name", COUNTED)
def test_a_row_that_is_doubled(refuse: Refuse, name: str) -> None:
    lines, start = block_start(name)
    lines.insert(start, lines[start])
    assert "added" in refuse(lines)


def test_a_count_that_would_fit_numbers_cut_in_two(refuse: Refuse) -> None:
    # twice as many: at half the width "0.1234" and "5678" are numbers as well
    block = Block([writers.fixed(0.12345678, 12, 8)] * 20, 5)
    lines = [line.replace("NPTS=  20", "NPTS=  40") for line in writers.peer(block, ".01000")]
    assert "truncated" in refuse(lines)


def test_a_row_too_short_in_the_middle_and_one_too_long_later(refuse: Refuse) -> None:
    lines = writers.peer(e15(), ".01000")
    lines[5], lines[8] = lines[5][:-15], lines[8] + lines[5][-15:]
    assert "line 6 =" in refuse(lines)


@pytest.mark.parametrize("name", ["esm", "itaca", "csmip", "cosmos", "knet", "smc"])
def test_a_peak_that_is_not_the_headers(refuse: Refuse, name: str) -> None:
    lines, start = block_start(name)
    stated = {"csmip": "PEAK ACC", "cosmos": "Processed", "knet": "Max", "smc": ".3100000E-01"}.get(name, "PGA")
    line = next(k for k in range(start) if stated in lines[k])
    for written, other in (("31", "37"), ("3.1", "3.7"), ("0.602", "0.702")):
        lines[line] = lines[line].replace(written, other)
    message = refuse(lines)
    assert f"line {line + 1} =" in message
    assert "peak" in message


@pytest.mark.parametrize(
    ("lines", "line"),
    [
        (writers.peer(e15(), ".01", quantity="VELOCITY", unit="CM/S"), 3),
        (writers.peer(e15(), ".01", quantity="DISPLACEMENT", unit="CM"), 3),
        (writers.esm(f10(), ".01", quantity="VELOCITY", unit="cm/s"), 9),
        (writers.itaca(e15(), ".01", quantity="Displacement", unit="m"), 10),
        (writers.smc(f10(), "200.", kind="3 VELOCITY"), 1),
        (writers.smc(f10(), "200.", kind="5 RESPONSE SPECTRA"), 1),
    ],
)
def test_another_quantity(refuse: Refuse, lines: list[str], line: int) -> None:
    message = refuse(lines)
    assert f"line {line} =" in message
    assert "use the acceleration" in message


def test_cosmos_of_a_velocity_or_of_raw_counts(refuse: Refuse) -> None:
    lines = writers.cosmos({"Up": f10()}, "0.005", "(8F10.5)")
    velocity = next(k for k, line in enumerate(lines) if line.startswith("Corrected velocity"))
    assert "no acceleration" in refuse(lines[velocity:])
    assert "counts" in refuse(writers.cosmos({"Up": f10()}, "0.005", "(8F10.5)", unit="counts (50)"))
    assert "time step, is missing or not positive" in refuse(writers.cosmos({"Up": f10()}, "-999.000000", "(8F10.5)"))


def test_a_header_that_does_not_say_what_it_must(refuse: Refuse) -> None:
    lines = writers.peer(e15(), ".01000")
    assert "ACCELERATION" in refuse([*lines[:2], *lines[3:]])
    assert "unit" in refuse([*lines[:2], "ACCELERATION TIME SERIES", *lines[3:]])
    assert "line 4 =" in refuse([line.replace("NPTS=  22", "NPTS=  0") for line in lines])
    assert "positive" in refuse([line.replace("DT= .01000", "DT= .0") for line in lines])
    assert "BANANA" in refuse(writers.peer(e15(), ".01", unit="BANANA"))
    esm = [line for line in COUNTED["esm"][0] if not line.startswith("UNITS")]
    assert "UNITS" in refuse(esm)
    rate = writers.smc(f10(), "0.1700000E+39")
    assert "sampling rate" in refuse(rate)
    scale = [line.replace("3920(gal)/6182761", "unknown") for line in counts()]
    assert "line 14 =" in refuse(scale)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"dt": 0.02}, "0.01 s"),
        ({"unit": "m/s2"}, "states g"),
        ({"channel": "1"}, "channel"),
        ({"column": "2"}, "column"),
    ],
)
def test_options_that_contradict_the_file(refuse: Refuse, options: dict[str, object], word: str) -> None:
    assert word in refuse(writers.peer(e15(), ".01000"), **options)


def test_options_that_agree_with_the_file(tmp_path: Path) -> None:
    file = tmp_path / "a.AT2"
    file.write_text("\n".join(writers.peer(e15(), ".01000")))
    assert read_accelerogram(file, dt=0.01, unit="G").unit == "g"


def test_a_channel_must_be_chosen_and_exist(refuse: Refuse) -> None:
    for lines in (
        writers.csmip({"90 deg": f10(), "Up": f10()}, ".020"),
        writers.cosmos({"90 DEG": f10(), "UP": f10()}, "0.005", "(8F10.5)"),
    ):
        assert "1 (90 DEG), 2 (UP)" in refuse(lines)
        assert "1 (90 DEG), 2 (UP)" in refuse(lines, channel="3")
        assert "1 (90 DEG), 2 (UP)" in refuse(lines, channel="North")


COLUMNS = ["0.00,0.1", "0.01,-0.2", "0.02,0.3", "0.03,-0.1", "0.04,0.2", *(f"0.{k:02d},0.1" for k in range(5, 25))]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({3: "0.035,-0.1"}, 4),
        ({k: f"0.{k + 1:02d},0.1" for k in range(3, 25)}, 4),
        ({24: "0.27,0.1"}, 25),
        ({2: "0.01,0.3"}, 3),
        ({3: "0.03,nan"}, 4),
        ({3: "0.03,"}, 4),
        ({3: "0.03"}, 4),
        ({3: "0.03,1,2"}, 4),
        ({3: ""}, 4),
        ({3: "# a remark"}, 4),
        ({4: "0.04,1e999"}, 5),
        ({4: "0.04,1_0"}, 5),
    ],
)
def test_faults_of_columns(refuse: Refuse, change: dict[int, str], line: int) -> None:
    lines = [change.get(k, text) for k, text in enumerate(COLUMNS)]
    assert f"line {line} =" in refuse(lines, unit="g")


def test_what_columns_need(refuse: Refuse) -> None:
    two = ["% NS and EW, cm/sec^2, dt=0.005", "0.1 0.2", "-0.3 0.4", "0.2 -0.5", "-0.3 0.1"]
    assert "@unit=" in refuse(COLUMNS)
    assert "@dt=" in refuse(["0.1", "-0.2"], unit="g")
    assert "@column=" in refuse(two, unit="cm/s2", dt=0.005)
    assert "one of 1, 2" in refuse(two, unit="cm/s2", dt=0.005, column="3")
    assert "1 is the time" in refuse(COLUMNS, unit="g", column="1")
    assert "0.01 s" in refuse(COLUMNS, unit="g", dt=0.02)
    assert "line 1 =" in refuse(two, unit="cm/s2", dt=0.01, column="1")
    assert "line 1 =" in refuse(two, unit="g", dt=0.005, column="1")
    assert "point" in refuse(["0,1", "-0,2", "0,3"], unit="g", dt=0.01)
    assert "time in s" in refuse(["t [ms],a [g]", "0.5,0.1", "10.5,0.2", "20.5,0.3"])
    assert "unit of acceleration" in refuse(["t [s],v [m/s]", *COLUMNS])
    assert "too few digits" in refuse([f"{0.004 * k:.2f},{k % 3 - 1.0}" for k in range(12)], unit="g")
    assert "must be one of" in refuse(COLUMNS, unit="furlong")
    assert "positive" in refuse(["0.1", "-0.2"], unit="g", dt=-1.0)
    assert "it states dt = 5 ms" in refuse(["% dt = 5 ms", "0.1", "-0.2"], unit="g", dt=0.01)
    for comment in ("# t [s], a [g]", "% acceleration in gal", "% acceleration in g"):
        assert "it states g" in refuse([comment, "0.1", "-0.2"], unit="m/s2", dt=0.01)


@pytest.mark.parametrize("step", [5.0, 1.0])
def test_a_step_that_no_record_has(refuse: Refuse, step: float) -> None:
    """Times in milliseconds, or an index."""
    message = refuse([f"{step * k:g},{0.1 * (k % 5)}" for k in range(9)], unit="g")
    assert "is its time in ms, or an index?" in message


def test_files_that_are_no_records(refuse: Refuse, tmp_path: Path) -> None:
    assert "unrecognised file format" in refuse(["Dear reader,", "this is a letter", "of 3 lines"])
    assert "every sample is zero" in refuse(["0.0", "0.0"], unit="g", dt=0.01)
    assert "two samples, all of them finite" in refuse(["0.5"], unit="g", dt=0.01)
    for name, content, word in (("a", b"", "empty"), ("b", b"\x00\x01", "text"), ("c", b" \r\n", "empty")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InvalidInput, match=word):
            read_accelerogram(tmp_path / name)
    with pytest.raises(InvalidInput, match="no such file"):
        read_accelerogram(tmp_path / "missing")
    with pytest.raises(InvalidInput, match="cannot be read"):
        read_accelerogram(tmp_path)


@pytest.mark.parametrize(
    ("lines", "given", "named"),
    [
        (["0.01 0.02", "0.03 -0.01", "0.02 0.01"], {}, ("@column=NUMBER: 1, 2", "requires dt=SECONDS and unit=UNIT")),
        (["0.01 0.02", "0.03 -0.01", "0.02 0.01"], {"dt": 0.01}, ("@column=NUMBER", "requires unit=UNIT,")),
        (["NS [g],EW [g]", "0.01,0.02", "0.03,-0.01"], {}, ("1 (NS), 2 (EW)", "requires dt=SECONDS,")),
        (["0.01", "0.03", "0.02"], {}, ("@dt=SECONDS", "requires unit=UNIT,")),
    ],
)
def test_everything_that_a_file_leaves_open_is_asked_for_at_once(
    refuse: Refuse, lines: list[str], given: dict[str, object], named: tuple[str, ...]
) -> None:
    said = refuse(lines, **given)
    for part in named:
        assert part in said


def test_what_a_file_states_is_not_asked_for(refuse: Refuse) -> None:
    lines = ["t [s],NS [g],EW [g]", "0.00,0.01,0.02", "0.01,0.03,-0.01", "0.02,0.03,-0.01"]
    assert "requires" not in refuse(lines)
    assert "requires" not in refuse(["0.01", "0.03", "0.02"], unit="g")
