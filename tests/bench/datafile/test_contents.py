"""The file of a campaign: what goes in comes out, in a form that other programs understand."""

import time
from pathlib import Path
from typing import Any

import h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
import pytest

from bench.datafile.fields import TEXT_WIDTH, fields_of
from bench.datafile.reader import open_datafile
from bench.datafile.recorder import Recorder
from bench.events import (
    Acquired,
    LimitExceeded,
    OperatorAnswered,
    PointFinished,
    Progress,
    State,
    StateChanged,
    StepStarted,
    Warned,
)
from bench.live_values import Estimate
from drivers.rig import Block
from protocols.harmonic.protocol import HarmonicPoint, PointStatus
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity
from tests.bench.datafile.example import CHANNELS, FULL, METADATA, PREDICTION, RATE, begin, block, record

EMPTY = HarmonicPoint(omega_rad_s=15.0, beta=0.64, status=PointStatus.OVERTURNED, layer="rocking")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "campaign.h5"


def test_counts_and_drive_come_back_exactly_whatever_the_blocks(path: Path) -> None:
    blocks, first = list[Acquired](), 0
    for n in (1, 199, 1000, 7, 2500, 333, 1):
        blocks.append(block(first, n))
        first += n
    record(begin(path), *blocks)
    counts = np.concatenate([each.block.counts for each in blocks])
    drive = np.concatenate([each.drive for each in blocks])
    with open_datafile(path) as kept:
        assert kept.rows == first
        for k, channel in enumerate(CHANNELS):
            np.testing.assert_array_equal(kept.counts(channel.name), counts[:, k])
        # the bound of rounding to a 24 bit mantissa below 8 V
        np.testing.assert_allclose(kept.drive(), drive, rtol=0.0, atol=8.0 * 2.0**-24)
        np.testing.assert_array_equal(kept.counts("table", slice(990, 1300, 3)), counts[990:1300:3, 2])
        np.testing.assert_array_equal(kept.counts("table", slice(-5, None)), counts[-5:, 2])


def test_values_are_in_units_and_nan_where_they_are_no_measurement(path: Path) -> None:
    counts = np.array([[0, 100, -32001], [-6554, 32767, 32000]], dtype=np.int16)
    record(begin(path), Acquired(1, Block(0, counts), np.zeros(2), time=0.0))
    with open_datafile(path) as kept:
        assert kept.channels == CHANNELS
        assert kept.sample_rate == RATE
        np.testing.assert_allclose(kept.values("storey 1"), [-0.05, np.nan], rtol=1e-15)
        np.testing.assert_allclose(kept.values("storey 2"), [-0.049237, -0.05 + 32767 * 7.63e-6], rtol=1e-12)
        np.testing.assert_allclose(kept.values("table"), [np.nan, -9.6], rtol=1e-12)
        with pytest.raises(InvalidInput, match="storey 1, storey 2, table"):
            kept.values("storey 3")


def test_gaps_and_runs_are_visible(path: Path) -> None:
    record(
        begin(path),
        block(0, 200, run=1, time=0.1),
        block(600, 200, run=1, time=0.4),
        block(0, 100, run=2, time=9.0),
    )
    with open_datafile(path) as kept:
        blocks = kept.blocks
        assert blocks["row"].tolist() == [0, 200, 400]
        assert blocks["first"].tolist() == [0, 600, 0]
        assert blocks["run"].tolist() == [1, 1, 2]
        assert blocks["time"].tolist() == [0.1, 0.4, 9.0]
        seconds = kept.time()
        np.testing.assert_allclose(seconds[[0, 199, 200, 399, 400, 499]], [0.0, 0.0995, 0.3, 0.3995, 0.0, 0.0495])
        np.testing.assert_array_equal(kept.time(slice(198, 202)), seconds[198:202])


def test_points_come_back_exactly(path: Path) -> None:
    record(begin(path), PointFinished(FULL, time=5.0), PointFinished(EMPTY, time=9.0))
    with open_datafile(path) as kept:
        assert [HarmonicPoint.model_validate(point) for point in kept.points] == [FULL, EMPTY]
        assert list(kept.points[0]) == list(HarmonicPoint.model_fields)
        assert kept.points[1]["alpha_2"] is None
        assert kept.points[1]["agrees"] is None
        assert [(event.time, event.kind, event.text) for event in kept.events] == [
            (5.0, "PointFinished", "row 0 of points"),
            (9.0, "PointFinished", "row 1 of points"),
        ]


def test_absent_values_are_nan_and_minus_one_for_plain_readers(path: Path) -> None:
    record(begin(path), PointFinished(FULL, time=5.0), PointFinished(EMPTY, time=9.0))
    with h5py.File(path, "r") as file:
        points: Any = file["entry/points"]
        assert np.isnan(points["alpha_2"][1])
        assert points["agrees"][:].tolist() == [0, -1]
        assert points["status"][:].tolist() == [b"steady", b"overturned"]
        assert points["starts_tried"].dtype.kind == "i"


def test_journal_keeps_all_but_samples_progress_and_estimates(path: Path) -> None:
    record(
        begin(path),
        StateChanged(State.IDLE, State.ARMED, "the operator armed", time=0.0),
        StepStarted("dwell at 12.5 rad/s", time=0.5),
        Progress(0.1, 100.0, "dwell", time=0.6),
        block(0, 10),
        Estimate(12.5, 0.25, 8, 0.001, 0.5, 0.01, 0.51, time=1.0),
        Estimate(12.5, None, 9, 0.002, float("nan"), float("nan"), 0.51, time=1.5),
        Warned("a cycle was missed", time=2.0),
        LimitExceeded("displacement", 0.0612, 0.06, "m", time=3.0),
        OperatorAnswered("stand the block up", "unattended run", time=4.0),
    )
    with open_datafile(path) as kept:
        assert [(event.time, event.kind, event.text) for event in kept.events] == [
            (0.0, "StateChanged", "idle -> armed: the operator armed"),
            (0.5, "StepStarted", "dwell at 12.5 rad/s"),
            (2.0, "Warned", "a cycle was missed"),
            (3.0, "LimitExceeded", "displacement reached 0.0612 m; limit 0.06 m"),
            (4.0, "OperatorAnswered", "stand the block up (answered by unattended run)"),
        ]
        estimates = kept.columns_of(Estimate)
        assert estimates["beta"] == [0.25, None]
        assert estimates["cycles"] == [8, 9]
        assert estimates["alpha_2"][0] == 0.5
        assert np.isnan(estimates["alpha_2"][1])


def test_a_long_text_is_cut_between_characters_and_says_so(path: Path) -> None:
    record(begin(path), Warned("ü" * TEXT_WIDTH, time=0.0))
    with open_datafile(path) as kept:
        text = kept.events[0].text
        assert text == "ü" * (len(text) - 1) + "…"
        assert TEXT_WIDTH - 2 < len(text.encode()) <= TEXT_WIDTH


def test_metadata_tables_and_state_come_back(path: Path) -> None:
    recorder = begin(path, title="Resonance, Ω = 12.5")
    recorder.sync()
    with open_datafile(path) as kept:
        assert (kept.status, kept.end_time) == ("running", "")
    recorder.close("halted", "emergency stop")
    recorder.close("completed", "a second close changes nothing")
    with open_datafile(path) as kept:
        assert (kept.status, kept.summary, kept.title) == ("halted", "emergency stop", "Resonance, Ω = 12.5")
        assert kept.start_time <= kept.end_time
        assert kept.software.startswith("rocking-bench ")
        assert kept.metadata == METADATA
        assert list(kept.tables) == ["prediction"]
        for name, column in PREDICTION.items():
            stored = kept.tables["prediction"][name]
            np.testing.assert_array_equal(stored.values, column.values)
            assert stored.values.dtype.kind == column.values.dtype.kind
            assert stored.description == column.description
            assert stored.unit == (column.unit or ("1" if name == "stable" else ""))


def test_every_numeric_dataset_has_units_and_the_default_plot_resolves(path: Path) -> None:
    record(begin(path), block(0, 3000), PointFinished(FULL, time=5.0), Warned("text", time=6.0))
    numeric, classes = dict[str, str](), dict[str, str]()

    def visit(name: str, item: Any) -> None:
        attributes: Any = item.attrs
        if isinstance(item, h5py.Group):
            classes[name] = attributes["NX_class"]
        elif item.dtype.kind in "iufb":
            numeric[name] = attributes["units"]

    with h5py.File(path, "r") as plain:
        file: Any = plain
        file.visititems(visit)
        assert all(numeric.values())
        assert numeric["entry/instrument/storey 1/counts"] == "counts"
        assert numeric["entry/instrument/drive/voltage"] == "V"
        assert numeric["entry/points/drift_peak_m"] == "m"
        assert numeric["entry/prediction/omega"] == "rad/s"
        assert classes["entry"] == "NXentry"
        assert classes["entry/instrument/table"] == "NXsensor"
        entry = file[file.attrs["default"]]
        data = entry[entry.attrs["default"]]
        assert data.attrs["NX_class"] == "NXdata"
        assert data[data.attrs["signal"]].shape == (3000,)
        assert [data[name].shape for name in data.attrs["auxiliary_signals"]] == [(3000,)]


def test_a_plain_reader_needs_three_lines(path: Path) -> None:
    record(begin(path), block(0, 500))
    with h5py.File(path, "r") as file:
        stored: Any = file["entry/instrument/table/counts"]
        value = stored[:] * stored.attrs["scale"] + stored.attrs["offset"]
    with open_datafile(path) as kept:
        ours = kept.values("table")
    known = ~np.isnan(ours)
    np.testing.assert_array_equal(value[known], ours[known])


@pytest.mark.seconds
def test_samples_reach_the_file_in_a_second_though_no_chunk_is_full_and_nothing_follows(path: Path) -> None:
    recorder = begin(path)
    recorder(block(0, 10))
    deadline, rows = time.monotonic() + 3.0, 0
    while not rows and time.monotonic() < deadline:
        time.sleep(0.1)
        with open_datafile(path) as kept:
            rows = kept.rows
    recorder.close("completed")
    assert rows == 10


def test_a_driver_may_use_its_buffers_again(path: Path) -> None:
    recorder = begin(path)
    counts, drive = np.zeros((100, 3), dtype=np.int16), np.zeros(100)
    for k in range(50):
        counts[:], drive[:] = k, 0.1 * k
        recorder(Acquired(1, Block(100 * k, counts), drive, time=0.1 * k))
    recorder.close("completed")
    with open_datafile(path) as kept:
        np.testing.assert_array_equal(kept.counts("table"), np.repeat(np.arange(50), 100))
        np.testing.assert_array_equal(kept.drive(), np.repeat(np.float32(0.1 * np.arange(50)), 100))


def test_absent_whole_numbers_are_not_zero(path: Path) -> None:
    class Counted(Parameters):
        cycles: int | None = quantity(None, "1", "cycles")

    assert fields_of(Counted)[0].dtype.kind == "f"
    recorder = Recorder(path, channels=CHANNELS, sample_rate=RATE, point_type=Counted, metadata={})
    record(recorder, PointFinished(Counted(), time=0.0), PointFinished(Counted(cycles=7), time=0.0))
    with open_datafile(path) as kept:
        assert kept.points == [{"cycles": None}, {"cycles": 7}]


def test_a_laser_signal_takes_less_room_than_raw_and_samples_are_not_stored_twice(path: Path) -> None:
    """200 s of a sine with noise of some counts: raw, 3 channels of int16, a float32 drive and a float64 time are 18
    bytes a row."""
    t = np.arange(400_000) / RATE
    rng = np.random.default_rng(1)
    signals = 3000.0 * np.sin(15.0 * t[:, None] + np.arange(3)) + rng.normal(0.0, 3.0, (t.size, 3))
    counts, drive = signals.astype(np.int16), 1.3 * np.sin(15.0 * t)
    recorder = begin(path)
    for first in range(0, t.size, 200):
        part = slice(first, first + 200)
        recorder(Acquired(1, Block(first, counts[part]), drive[part], time=t[first]))
    recorder.close("completed")
    # the blocks' table adds 32 bytes per 200 rows, and the empty tables some kB
    assert path.stat().st_size < 0.7 * 18 * t.size
