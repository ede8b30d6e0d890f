"""What is exported comes back: by the libraries' own readers, names, units and every value."""

import csv
import shutil
import subprocess
import sys
import tracemalloc
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pyarrow.parquet
import pytest
import pyuff
from numpy.typing import NDArray
from scipy.io import loadmat

from bench.app.cli.main import main
from bench.app.export import format, matlab, text, uff
from bench.config.model import BenchConfiguration
from bench.datafile.reader import open_datafile
from bench.datafile.recorder import Recorder
from bench.datafile.tables import Column
from bench.events import Acquired, PointFinished, StepStarted
from bench.live_values import Estimate
from drivers.rig import Block, Channel
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity
from tests.patience import LONG

RATE = 1652.8925619834711
"""What a device makes of 1650 Hz: no time of it is a short decimal."""

CHANNELS = (
    Channel("laser_1", "displacement", "m", 1.1e-6, -0.02, (-32_000, 32_000), "no. 7, left", (1e-13,), {-32767: "x"}),
    Channel("table_acceleration", "acceleration", "m/s2", 3e-6, 0.0, (-(2**23), 2**23 - 1), "24 bit"),
    Channel("7 of 9", "voltage", "V", 1e-3, 0.0, (-100, 100), ""),
)
NAMES = [channel.name for channel in CHANNELS]
UNITS = dict(zip(NAMES, ("m", "m/s2", "V"), strict=True))
WORDS = 'says "no", twice; Ω ≠ 0'


class Found(Parameters):
    omega: float = quantity(..., "rad/s", "frequency")
    gain: float | None = quantity(None, "1", "gain, if there is one")
    agrees: bool | None = quantity(None, "1", "verdict, if there is one")
    cycles: int = quantity(0, "1", "cycles")
    reason: str = quantity("", "", "in words")


POINTS = (Found(omega=12.5, gain=0.1 + 0.2, agrees=True, cycles=7), Found(omega=20.0, reason=WORDS))


def _counts(n: int, seed: int) -> NDArray[np.int32]:
    random = np.random.default_rng(seed)
    counts = np.column_stack([random.integers(*each.valid, n, endpoint=True) for each in CHANNELS]).astype(np.int32)
    counts[n // 3 : n // 3 + 5, 0] = -32767
    return counts


@pytest.fixture(scope="module")
def counts() -> dict[int, NDArray[np.int32]]:
    return {1: _counts(1000, 1), 2: _counts(737, 2)}


@pytest.fixture(scope="module")
def volts() -> NDArray[np.float32]:
    return np.sin(np.arange(1000) / 7.0).astype(np.float32)


@pytest.fixture(scope="module")
def campaign(
    tmp_path_factory: pytest.TempPathFactory, counts: dict[int, NDArray[np.int32]], volts: NDArray[np.float32]
) -> Path:
    path = tmp_path_factory.mktemp("export") / "campaign.h5"
    table = {"omega": Column(np.array([1.0, np.nan]), "rad/s", "of it"), "layer": Column(np.array(["a", "b"]), "", "l")}
    recorder = Recorder(
        path,
        channels=CHANNELS,
        sample_rate=RATE,
        point_type=Found,
        metadata={"configuration": BenchConfiguration().model_dump_json(), "protocol": "made"},
        tables={"prediction": table},
    )
    recorder(StepStarted(WORDS, time=0.0))
    for run, values in counts.items():
        for first in range(0, len(values), 100):
            part = values[first : first + 100]
            # run 2 has a gap of 50 samples after 300
            index = first + (50 if run == 2 and first >= 300 else 0)
            recorder(
                Acquired(run, Block(index, part), volts[first : first + len(part)].astype(float), time=first / RATE)
            )
    recorder(Estimate(12.5, None, 6, 0.005, np.nan, np.nan, 1.0, time=1.0))
    for point in POINTS:
        recorder(PointFinished(point, time=2.0))
    recorder.close("completed", WORDS)
    return path


def _exported(campaign: Path, tmp_path: Path, to: str, *more: str) -> Path:
    before = campaign.read_bytes()
    assert main(["export", str(campaign), "--to", to, "--out", str(tmp_path / to), *more]) == 0
    assert campaign.read_bytes() == before
    assert sorted(tmp_path.iterdir()) == [tmp_path / to]
    return tmp_path / to


def _values(counts: NDArray[np.int32]) -> NDArray[np.float64]:
    """By the definition of the file format, not by the reader."""
    x = counts.astype(np.float64)
    values = np.column_stack((-0.02 + 1.1e-6 * x[:, 0] + 1e-13 * x[:, 0] ** 2, 3e-6 * x[:, 1], 1e-3 * x[:, 2]))
    values[counts[:, 0] == -32767, 0] = np.nan
    return values


def _time(run: int, n: int) -> NDArray[np.float64]:
    index = np.arange(n)
    return (index + 50 * (index >= 300) * (run == 2)) / RATE


@pytest.mark.parametrize("run", [1, 2])
def test_matlab_file_comes_back(
    campaign: Path, tmp_path: Path, counts: dict[int, NDArray[np.int32]], volts: NDArray[np.float32], run: int
) -> None:
    out = _exported(campaign, tmp_path, "mat")
    found = loadmat(out / f"run-{run}.mat", squeeze_me=True, simplify_cells=True)
    n = len(counts[run])
    names = ["laser_1", "table_acceleration", "x7_of_9"]
    values = _values(counts[run])
    for column, name in enumerate(names):
        np.testing.assert_allclose(found[name], values[:, column], rtol=1e-14)
    np.testing.assert_array_equal(found["drive"], volts[:n].astype(np.float64))
    np.testing.assert_allclose(found["time"], _time(run, n), rtol=1e-14)
    assert [found["units"][name] for name in names] == ["m", "m/s2", "V"]
    assert (found["units"]["drive"], found["units"]["time"]) == ("V", "s")
    assert found["channels"]["x7_of_9"]["name"] == "7 of 9"
    assert found["info"]["sample_rate"] == RATE
    tables = loadmat(out / "tables.mat", squeeze_me=True, simplify_cells=True)
    np.testing.assert_array_equal(tables["points"]["gain"], [0.1 + 0.2, np.nan])
    np.testing.assert_array_equal(tables["points"]["agrees"], [1.0, np.nan])
    empty, words = tables["points"]["reason"]
    assert (len(empty), words) == (0, WORDS)
    assert tables["units"]["points"]["omega"] == "rad/s"
    assert tables["info"]["summary"] == WORDS


def test_raw_matlab_file_keeps_counts_and_the_way_to_values(
    campaign: Path, tmp_path: Path, counts: dict[int, NDArray[np.int32]]
) -> None:
    found = loadmat(_exported(campaign, tmp_path, "mat", "--raw") / "run-2.mat", squeeze_me=True, simplify_cells=True)
    np.testing.assert_array_equal(found["laser_1"], counts[2][:, 0])
    assert found["table_acceleration"].dtype == np.int32
    how = found["channels"]["laser_1"]
    assert (how["scale"], how["offset"], how["valid_low"], how["value_unit"]) == (1.1e-6, -0.02, -32_000, "m")
    assert found["units"]["laser_1"] == "counts"


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="Octave is not installed")
def test_octave_opens_the_matlab_file(campaign: Path, tmp_path: Path, counts: dict[int, NDArray[np.int32]]) -> None:
    out = _exported(campaign, tmp_path, "mat")
    script = (
        "a = load('run-1.mat'); t = load('tables.mat');"
        "printf('%s|%s|%d|%d|%.17g|%.17g|%s|%.17g|%s', a.units.laser_1, a.channels.x7_of_9.name, rows(a.laser_1),"
        "sum(isnan(a.laser_1)), a.table_acceleration(end), a.time(end), t.units.points.omega, t.points.gain(1),"
        "t.points.reason{2});"
    )
    done = subprocess.run(
        ["octave-cli", "--norc", "--no-history", "--eval", script], cwd=out, capture_output=True, timeout=LONG
    )
    unit, name, rows, lost, last, time, of, gain, words = done.stdout.decode(errors="replace").split("|")
    assert (unit, name, rows, lost, of) == ("m", "7 of 9", "1000", "5", "rad/s")
    assert float(last) == pytest.approx(_values(counts[1])[-1, 1], rel=1e-14)
    assert float(time) == pytest.approx(999 / RATE, rel=1e-14)
    assert float(gain) == 0.1 + 0.2
    # Octave counts bytes where the file counts characters: a text that is not ASCII ends early there
    assert words[:15] == WORDS[:15]


@pytest.mark.parametrize("run", [1, 2])
def test_text_comes_back_to_the_count(
    campaign: Path, tmp_path: Path, counts: dict[int, NDArray[np.int32]], volts: NDArray[np.float32], run: int
) -> None:
    out = _exported(campaign, tmp_path, "csv")
    with (out / f"run-{run}.csv").open(newline="") as file:
        head = next(csv.reader(file))
    assert head == ["time [s]", "laser_1 [m]", "table_acceleration [m/s2]", "7 of 9 [V]", "drive [V]"]
    table = np.genfromtxt(out / f"run-{run}.csv", delimiter=",", skip_header=1)
    n = len(counts[run])
    np.testing.assert_allclose(table[:, 0], _time(run, n), rtol=1e-11)
    np.testing.assert_allclose(table[:, 1:4], _values(counts[run]), rtol=1e-11)
    np.testing.assert_array_equal(table[:, 4].astype(np.float32), volts[:n])
    # a 24 bit converter's counts come back from the text
    np.testing.assert_array_equal(np.round(table[:, 2] / 3e-6), counts[run][:, 1])
    with (out / "points.csv").open(newline="", encoding="utf-8") as file:
        head, first, second = csv.reader(file)
    assert head == ["omega [rad/s]", "gain", "agrees", "cycles", "reason"]
    assert (float(first[1]), first[2:]) == (0.1 + 0.2, ["yes", "7", ""])
    assert second == ["20.0", "", "", "0", WORDS]
    with (out / "events.csv").open(newline="", encoding="utf-8") as file:
        assert [row[2] for row in csv.reader(file)][1] == WORDS


def test_raw_text_has_whole_counts_and_the_way_to_values(
    campaign: Path, tmp_path: Path, counts: dict[int, NDArray[np.int32]]
) -> None:
    out = _exported(campaign, tmp_path, "csv", "--raw")
    table = np.genfromtxt(out / "run-1.csv", delimiter=",", skip_header=1)
    np.testing.assert_array_equal(table[:, 1:4], counts[1])
    with (out / "channels.csv").open(newline="", encoding="utf-8") as file:
        first, *_ = csv.DictReader(file)
    assert (first["name"], first["unit"], first["value_unit"], first["device"]) == (
        *("laser_1", "counts", "m"),
        "no. 7, left",
    )
    assert (float(first["scale"]), float(first["offset"]), float(first["higher"])) == (1.1e-6, -0.02, 1e-13)


@pytest.mark.parametrize("raw", [False, True])
def test_parquet_comes_back(
    campaign: Path,
    tmp_path: Path,
    counts: dict[int, NDArray[np.int32]],
    raw: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(format, "ROWS_AT_ONCE", 300)
    out = _exported(campaign, tmp_path, "parquet", *(["--raw"] if raw else []))
    table = pyarrow.parquet.read_table(out / "run-2.parquet")
    assert table.column_names == ["time", *NAMES, "drive"]
    np.testing.assert_allclose(table["time"].to_numpy(), _time(2, 737), rtol=1e-14)
    expected = counts[2] if raw else _values(counts[2])
    for column, name in enumerate(NAMES):
        np.testing.assert_allclose(table[name].to_numpy(), expected[:, column], rtol=0.0 if raw else 1e-14)
        unit = table.schema.field(name).metadata[b"unit"].decode()
        assert unit == ("counts" if raw else UNITS[name])
    if raw:
        assert table.schema.field("laser_1").metadata[b"scale"] == b"1.1e-06"
        assert str(table.schema.field("laser_1").type).startswith("int")
    assert table.schema.metadata[b"protocol"] == b"made"
    points = pyarrow.parquet.read_table(out / "points.parquet")
    assert points.to_pylist() == [point.model_dump() for point in POINTS]
    assert points.schema.field("omega").metadata[b"unit"] == b"rad/s"
    prediction = pyarrow.parquet.read_table(out / "prediction.parquet")
    assert prediction["layer"].to_pylist() == ["a", "b"]


def test_uff_comes_back_with_units_and_spacing_cut_where_samples_are_missing(
    campaign: Path, tmp_path: Path, counts: dict[int, NDArray[np.int32]], volts: NDArray[np.float32]
) -> None:
    out = _exported(campaign, tmp_path, "uff")
    units, *sets = pyuff.UFF(str(out / "run-2.uff")).read_sets()
    assert (units["type"], units["units_code"]) == (164, 1)
    values, time = _values(counts[2]), _time(2, 737)
    # five samples of the first are no measurement, and 50 of all are missing
    parts = [
        (0, 0, 245),
        (0, 250, 300),
        (0, 300, 737),
        *((k, *ends) for k in (1, 2, 3) for ends in ((0, 300), (300, 737))),
    ]
    assert len(sets) == len(parts)
    columns = [*values.T, volts[:737].astype(np.float64)]
    for each, (column, start, stop) in zip(sets, parts, strict=True):
        name = [*NAMES, "drive"][column]
        assert each["id1"].strip() == name
        assert each["ordinate_axis_units_lab"].strip() == {**UNITS, "drive": "V"}[name]
        assert each["abscissa_axis_units_lab"].strip() == "s"
        assert each["abscissa_spacing"] == 1
        assert each["abscissa_inc"] == pytest.approx(1.0 / RATE, rel=1e-5)
        assert each["abscissa_min"] == pytest.approx(time[start], rel=1e-5)
        np.testing.assert_allclose(each["data"], columns[column][start:stop], rtol=1e-14)
        assert f"first sample {start + 50 * (start >= 300)} of the run, {RATE!r}" in each["id5"]
    assert [each["ordinate_spec_data_type"] for each in sets[::3]] == [8, 12, 0]
    assert (out / "points.csv").is_file()


def test_raw_counts_in_uff_state_their_first_sample_in_full(campaign: Path, tmp_path: Path) -> None:
    assert main(["export", str(campaign), "--to", "uff", "--raw", "--out", str(tmp_path / "raw")]) == 0
    _, *sets = pyuff.UFF(str(tmp_path / "raw" / "run-2.uff")).read_sets()
    for each in sets:
        assert each["id5"].strip().endswith(f"of the run, {RATE!r} samples per second")
    # the conversion, with its higher terms, is in a table beside it
    assert "higher" in (tmp_path / "raw" / "channels.csv").read_text(encoding="utf-8").splitlines()[0]


def test_a_signal_in_too_many_parts_is_refused_for_uff(
    campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(uff, "MOST_PARTS", 1)
    assert main(["export", str(campaign), "--to", "uff", "--out", str(tmp_path / "out")]) == 2
    assert "missing samples divide laser_1 into 2 parts" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_what_the_format_cannot_hold_is_refused_before_anything_is_written(
    campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(matlab, "LARGEST", 7999)
    assert main(["export", str(campaign), "--to", "mat", "--out", str(tmp_path / "out")]) == 2
    assert "--to parquet" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_overwritten_and_nothing_left_half_done(
    campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out").mkdir()
    assert main(["export", str(campaign), "--to", "csv", "--out", str(tmp_path / "out")]) == 2
    assert "never overwritten" in capsys.readouterr().err
    (tmp_path / "out").rmdir()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(text, "FORMAT", replace(text.FORMAT, write=full))
    assert main(["export", str(campaign), "--to", "csv", "--out", str(tmp_path / "out")]) == 1
    assert "No space left" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    assert main(["export", str(campaign), "--to", "xls"]) == 2


def test_what_failed_its_checksum_is_told_and_travels_with_the_export(
    campaign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "damaged.h5"
    path.write_bytes(campaign.read_bytes())
    with h5py.File(path, "r+") as file:
        counts = file["entry/instrument/laser_1/counts"]
        counts[3] += 1
    assert main(["export", str(path), "--to", "csv", "--out", str(tmp_path / "out")]) == 0
    assert "laser_1/counts was changed" in capsys.readouterr().err
    assert "laser_1/counts" in (tmp_path / "out" / "DAMAGED.txt").read_text(encoding="utf-8")
    assert main(["export", str(campaign), "--to", "csv", "--out", str(tmp_path / "whole")]) == 0
    assert capsys.readouterr().err == ""
    assert not (tmp_path / "whole" / "DAMAGED.txt").exists()


@pytest.mark.parametrize(("to", "module"), [("uff", "pyuff"), ("parquet", "pyarrow")])
def test_a_missing_library_is_named_with_the_extra(
    campaign: Path, tmp_path: Path, to: str, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with (
        open_datafile(campaign) as record,
        pytest.raises(InvalidInput, match=rf"needs {module}: .*rocking-bench\[export\]"),
    ):
        format.export(record, campaign, to, tmp_path / "out")  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def test_names_are_made_valid_and_stay_different() -> None:
    names = ["end", "a b", "a_b", "time", "_x", "ä", "n" * 70, "n" * 71]
    found = matlab.variables(names, ("time",))
    assert found == ["end_2", "a_b", "a_b_2", "time_2", "x_x", "x_", "n" * 63, "n" * 61 + "_2"]


@pytest.mark.parametrize(("to", "piece"), [("csv", 1000), ("parquet", 8000)])
def test_memory_does_not_grow_with_the_run(
    tmp_path: Path, to: str, piece: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(format, "ROWS_AT_ONCE", piece)
    monkeypatch.setattr("bench.datafile.checksums.ROWS_AT_ONCE", piece)
    peaks: list[int] = []
    for number, pieces in enumerate((1, 2, 6)):
        path = tmp_path / f"{number}.h5"
        recorder = Recorder(path, channels=CHANNELS, sample_rate=1e4, point_type=Found, metadata={}, hold_up=60.0)
        for first in range(0, pieces * piece, piece):
            recorder(Acquired(1, Block(first, _counts(piece, 3)), np.zeros(piece), time=first / 1e4))
        recorder.close("completed")
        with open_datafile(path) as record:
            # the first one loads the libraries
            if number:
                tracemalloc.start()
            format.export(record, path, to, tmp_path / f"{number}")
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
    assert peaks[2] < 1.5 * peaks[1]
