"""One short record from the command line to the files: one stiffness topples the block, another does not."""

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from bench.app.cli.main import main
from bench.config.toml import read_configuration
from bench.engine.steps import Arm, Done, Play, Publish
from bench.events import PointFinished
from protocols.earthquake.campaign import EarthquakeCampaign
from protocols.earthquake.protocol import EarthquakeParameters
from sim.specimen import Specimen
from tests.bench.control.virtual_table import bench_with, identify

TOPPLES, STANDS = 0.25, 0.97
BAND = ("--table-band", "1.5:25")
"""A band that the model of the table covers."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A configuration whose table has been identified: that takes the longest."""
    folder = tmp_path_factory.mktemp("bench")
    model = identify(bench_with(Specimen()), periods=2).model_copy(update={"date": datetime.now(UTC)})
    model.write(folder / "table.json")
    path = folder / "bench.toml"
    path.write_text(
        f"table_model = {json.dumps((folder / 'table.json').as_posix())}\n[acquisition]\nblock_duration = 0.2\n",
        encoding="utf-8",
    )
    return path


@pytest.fixture(scope="module")
def done(bench: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three times the acceleration that lifts the block: nine of ten draws topple it with the soft spring. The lasers
    are linear, so that the errors found in the motion, which correct the results, are small.
    """
    folder = tmp_path_factory.mktemp("earthquake") / "run"
    linear = tmp_path_factory.mktemp("linear") / "bench.toml"
    lasers = "".join(f"[simulation.bench.laser_{number}]\nlinearity = 0.0\n" for number in (1, 2))
    linear.write_text(bench.read_text(encoding="utf-8") + lasers, encoding="utf-8")
    asked = ["synthetic:kobe", *BAND, "--peak-factor", "3"]
    asked += ["--beta", str(TOPPLES), "--beta", str(STANDS)]
    code = main(["run", "earthquake", *asked, "--draws", "40", "--json", "--config", str(linear), "--out", str(folder)])
    assert code == 0
    return folder


def summary(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def points(folder: Path) -> dict[float, dict[str, Any]]:
    return {point["beta"]: point for point in summary(folder)["points"]}


def test_every_file_is_there(done: Path) -> None:
    names = {path.name for path in done.iterdir()}
    figures = {"gain_curves.png", "table_motions.png", "drift_histories.png"}
    assert names >= {"campaign.h5", "summary.json", *figures}
    for name in figures:
        assert (done / name).read_bytes().startswith(b"\x89PNG")
    said = summary(done)
    assert (said["protocol"], said["status"]) == ("earthquake", "completed")
    assert [Path(path).name for path in said["further_figures"]] == ["table_motions.png", "drift_histories.png"]
    (record,) = said["records"]
    assert record["synthetic"] is True
    assert len(record["sha256"]) == 64
    assert record["table_peak_m_s2"] == pytest.approx(3.0 * 9.81 / 8.0, rel=1e-9)


def test_a_toppled_block_is_a_result_with_its_time_and_the_campaign_goes_on(done: Path) -> None:
    fallen, stood = points(done)[TOPPLES], points(done)[STANDS]
    assert (fallen["status"], fallen["alpha_2"], fallen["agrees"]) == ("overturned", None, None)
    assert fallen["topple_chance"] > 0.5
    # the strong part of the record lies between its rest of 2.7 s and its end at 16 s
    assert 4.0 < fallen["overturned_s"] < 14.0
    assert "overturned" in fallen["reason"]
    assert stood["status"] == "measured"
    with h5py.File(done / "campaign.h5", "r") as file:
        kinds = [kind.decode() for kind in file["entry/events/kind"][:]]
        assert kinds.count("PointFinished") == 2
        # the last running gain of the record that was stood is the final one, but for noise
        running = file["entry/running_gains/alpha_2"][:]
        assert running[-1] == pytest.approx(stood["alpha_2"], rel=5e-3)


def test_the_measured_gain_is_that_of_the_raw_channels(done: Path) -> None:
    """With nothing but h5py: the largest sample of the drift, which noise makes a little too large."""
    with h5py.File(done / "campaign.h5", "r") as file:
        instrument = file["entry/instrument"]

        def channel(name: str) -> np.ndarray:
            counts = instrument[f"{name}/counts"]
            return counts[:] * counts.attrs["scale"] + counts.attrs["offset"]

        drift = channel("laser_2") - channel("laser_1")
        blocks = instrument["blocks"]
        runs, rows = blocks["run"][:], blocks["row"][:]
        peaks = []
        for run in (max(runs) - 2, max(runs)):  # the bare frame's last test, and the last of all
            first = rows[runs == run][0]
            after = rows[runs > run]
            piece = drift[first : after[0] if after.size else None]
            peaks.append(np.abs(piece - piece[:2000].mean()).max())
    point = points(done)[STANDS]
    assert peaks[0] == pytest.approx(point["bare_drift_peak_m"], rel=5e-3)
    assert peaks[1] / peaks[0] == pytest.approx(point["alpha_2"], rel=5e-3)


def test_what_a_measured_point_says(done: Path) -> None:
    point = points(done)[STANDS]
    assert point["agrees"] is (point["alpha_2_low"] <= point["alpha_2"] <= point["alpha_2_high"])
    parts = json.loads(point["uncertainty_parts"])
    assert point["dominating"] == max(parts, key=lambda name: parts[name])
    assert 0.0 < point["alpha_2_uncertainty"] < 0.05 * point["alpha_2"]
    assert point["bare_tracking_error"] < 0.02
    assert point["bare_tracking_error"] < point["motion_difference"] < 0.3
    assert point["pga_m_s2"] == pytest.approx(point["pga_target_m_s2"], rel=0.1)


def test_the_statement_is_checked_by_name(done: Path) -> None:
    checked = summary(done)["statement"]
    assert checked["statement"].startswith("seismic gains are below one")
    assert checked["band_hz"] == [1.5, 25.0]
    (record,) = checked["measured"]["records"]
    assert record["toppled"] == [TOPPLES]
    assert record["alpha_2"] == [None, points(done)[STANDS]["alpha_2"]]


def test_the_data_file_replays_without_the_files_that_the_run_read(
    done: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The record cannot be read any more, and the table's model is gone, or would be too old by now."""

    def gone(*_: object) -> None:
        raise AssertionError("no other file may be read")

    monkeypatch.setattr("protocols.earthquake.records.read_records", gone)
    monkeypatch.setattr("bench.control.table_model.TableModel.read", gone)
    assert main(["replay", str(done / "campaign.h5"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["agrees"]


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["nowhere.AT2", *BAND], "nowhere.AT2"),
        (["synthetic:kobe", "synthetic:kobe", *BAND], "is already used by"),
        (["synthetic:kobe", "--table-band", "0.5:25"], "within the table's band, 1 to 100 Hz"),
        (["synthetic:kobe", "--table-band", "20:10"], "two ascending frequencies above 0 Hz"),
        (["synthetic:kobe", "--table-band", "none"], "must be filtered to a band"),
        (["synthetic:kobe", "--beta", "0.5", "0.5"], "each value may occur only once"),
        (["synthetic:kobe", "--peak-factor", "5", *BAND], "limits."),
    ],
)
def test_refused_before_anything_starts(
    flags: list[str], said: str, bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(["run", "earthquake", *flags, "--config", str(bench), "--out", str(tmp_path / "run")])
    error = capsys.readouterr().err
    assert code == 2
    # what was done until then stands before it
    assert said in error.splitlines()[-1]
    assert error.count("error: ") == 1
    assert not (tmp_path / "run").exists()


def test_a_stale_table_model_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], bench: Path) -> None:
    stale = json.loads((bench.parent / "table.json").read_text(encoding="utf-8"))
    stale["date"] = "2026-01-01T00:00:00Z"
    (tmp_path / "stale.json").write_text(json.dumps(stale), encoding="utf-8")
    path = tmp_path / "bench.toml"
    path.write_text(f"table_model = {json.dumps((tmp_path / 'stale.json').as_posix())}\n", encoding="utf-8")
    code = main(["run", "earthquake", "synthetic:kobe", "--config", str(path), "--out", str(tmp_path / "run")])
    assert code == 2
    assert "identify the table again" in capsys.readouterr().err


def test_a_record_that_the_table_cannot_make_is_left_out_and_says_so(bench: Path) -> None:
    """The limit that a drive meets may be known only when the table is: nothing of that record is played."""
    configuration = read_configuration(bench)
    tight = configuration.limits.model_copy(update={"drive_voltage": 0.05})
    parameters = EarthquakeParameters(records=("synthetic:kobe",), beta=(0.25, 0.64), table_band="1.5:25")
    prepared = EarthquakeCampaign(parameters, configuration.model_copy(update={"limits": tight}))
    plan, steps = prepared.plan(), []
    try:
        step = next(plan)
        while True:
            steps.append(step)
            step = plan.send(Done())
    except StopIteration:
        pass
    assert not any(isinstance(step, Play | Arm) for step in steps)
    found = [step.event.point for step in steps if isinstance(step, Publish) and isinstance(step.event, PointFinished)]
    assert [(point.beta, point.status) for point in found] == [(0.25, "not played"), (0.64, "not played")]
    assert all("drive_voltage" in point.reason for point in found)
