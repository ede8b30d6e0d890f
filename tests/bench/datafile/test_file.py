"""`rockbench file`: what is said about whole, unfinished, old, foreign and damaged files, and what is made of them."""

import errno
import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
import pytest

import bench.datafile
from bench.app.cli.main import main
from bench.datafile.hdf5_reading import DataFileError
from bench.datafile.writer import journal_path
from bench.events import PointFinished, Warned
from tests.bench.datafile.example import CHANNELS, FULL, METADATA, RATE, begin, block

ROWS = 3000


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The file of a campaign that was closed."""
    path = tmp_path_factory.mktemp("whole") / "campaign.h5"
    recorder = begin(path, metadata=METADATA | {"operator": "Ω. Muster", "notes": "cold\nnew spring"})
    for first in range(0, ROWS, 500):
        recorder(block(first, 500, time=(first + 500) / RATE))
    recorder(PointFinished(FULL, time=1.5))
    recorder.close("completed", "all done")
    return path.read_bytes()


@pytest.fixture
def path(tmp_path: Path, whole: bytes) -> Path:
    path = tmp_path / "campaign.h5"
    path.write_bytes(whole)
    return path


def edited(path: Path, change: Callable[[Any], None]) -> None:
    with h5py.File(path, "r+") as file:
        change(file)


def as_format_1(file: Any) -> None:
    """What the previous layout had not: a time axis, checksums, the later tables; it had LZF in place of gzip."""
    for name in (*(f"{channel.name}/counts" for channel in CHANNELS), "drive/voltage"):
        stored = file["entry/instrument"][name]
        values, attributes, chunks = stored[()], dict(stored.attrs), stored.chunks
        del file["entry/instrument"][name]
        made = file["entry/instrument"].create_dataset(
            name, data=values, maxshape=(None,), chunks=chunks, compression="lzf", shuffle=True
        )
        made.attrs.update(attributes)
    for name in ("checksums", "data", "running_gains", "table_response", "user", "notes"):
        del file["entry"][name]
    counted = file["entry/complete"][:6]
    del file["entry/complete"]
    file["entry/complete"] = counted
    file["entry/complete"].attrs["units"] = "1"
    data = file["entry"].create_group("data")
    data.attrs["NX_class"], data.attrs["signal"], data.attrs["axes"] = "NXdata", CHANNELS[0].name, ["."]
    for channel in CHANNELS:
        data[channel.name] = h5py.SoftLink(f"/entry/instrument/{channel.name}/counts")
    file.attrs["format_version"] = 1


def rejected(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["file", *arguments]) == 2
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    assert captured.out == ""
    return captured.err


def test_info_says_what_is_there(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["file", "info", str(path), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert (content["status"], content["operator"], content["notes"]) == ("completed", "Ω. Muster", "cold\nnew spring")
    assert (content["samples"], content["duration"], content["points"]) == (ROWS, ROWS / RATE, 1)
    assert [each["name"] for each in content["channels"]] == [channel.name for channel in CHANNELS]
    assert main(["file", "info", str(path)]) == 0
    assert "Ω. Muster" in capsys.readouterr().out


def test_checksums_are_those_of_another_program(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with h5py.File(path) as file:
        table: Any = file["entry/checksums"]
        for name, stored in zip(table["dataset"][:], table["values"][:], strict=True):
            dataset: Any = file[name.decode()]
            assert hashlib.sha256(np.asarray(dataset[()], dtype=dataset.dtype).tobytes()).hexdigest() == stored.decode()
    assert main(["file", "verify", str(path)]) == 0
    assert "is intact" in capsys.readouterr().out


def change_sample(file: Any) -> None:
    file["entry/instrument/table/counts"][1234] ^= 1


def change_scale(file: Any) -> None:
    file["entry/instrument/table/counts"].attrs["scale"] *= 1.0001


def change_prediction(file: Any) -> None:
    file["entry/prediction/alpha_2"][0] = 0.11


def lose_channel(file: Any) -> None:
    del file["entry/instrument/table/counts"]


def lose_events(file: Any) -> None:
    del file["entry/events"]


def lose_rows(file: Any) -> None:
    file["entry/instrument/drive/voltage"].resize((ROWS - 1,))


def add_dataset(file: Any) -> None:
    file["entry/added"] = "later"


def plot_another(file: Any) -> None:
    file["entry/data"].attrs["signal"] = "storey 2"


def lead_elsewhere(file: Any) -> None:
    del file["entry/data/storey 1"]
    file["entry/data/storey 1"] = h5py.SoftLink("/entry/instrument/storey 2/counts")


def lead_to_equal_values(file: Any) -> None:
    file["entry"].move("prediction/alpha_2", "prediction/moved")
    file["entry/prediction/alpha_2"] = h5py.SoftLink("/entry/prediction/moved")


def rename_class(file: Any) -> None:
    file["entry/instrument/table"].attrs["NX_class"] = "NXdetector"


def change_root(file: Any) -> None:
    file.attrs["default"] = "nowhere"


def add_group(file: Any) -> None:
    file["entry"].create_group("added")


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (change_sample, "/entry/instrument/table/counts was changed"),
        (change_scale, "attributes of /entry/instrument/table/counts"),
        (change_prediction, "/entry/prediction/alpha_2"),
        (lose_channel, "/entry/instrument/table/counts is missing"),
        (lose_events, "/entry/events/time is missing"),
        (lose_rows, ": 2999; number counted as complete: 3000"),
        (add_dataset, "/entry/added has no checksum"),
        (plot_another, "attributes or links of /entry/data were changed"),
        (lead_elsewhere, "attributes or links of /entry/data were changed"),
        (lead_to_equal_values, "attributes or links of /entry/prediction were changed"),
        (rename_class, "attributes or links of /entry/instrument/table were changed"),
        (change_root, "attributes or links of / were changed"),
        (add_group, "/entry/added has no checksum"),
    ],
)
def test_what_was_changed_is_found(
    path: Path, change: Callable[[Any], None], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    edited(path, change)
    before = path.read_bytes()
    assert named in rejected(capsys, "verify", str(path))
    assert path.read_bytes() == before


def be_newer(path: Path) -> None:
    edited(path, lambda file: file.attrs.__setitem__("format_version", 99))


def be_foreign(path: Path) -> None:
    path.unlink()
    with h5py.File(path, "w") as file:
        file["x"] = 1.0


def be_a_directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize("command", ["info", "verify", "recover"])
@pytest.mark.parametrize(
    ("spoil", "named"),
    [
        (lambda path: path.write_bytes(b"no HDF5"), "not an HDF5 file"),
        (lambda path: path.write_bytes(b""), "not an HDF5 file"),
        (lambda path: path.write_bytes(path.read_bytes()[:100]), "campaign.h5"),
        (be_foreign, "not a data file of rocking-bench"),
        (be_newer, "99 is newer"),
        (Path.unlink, "no such file"),
        (be_a_directory, "is a directory"),
    ],
)
def test_what_is_no_record_is_refused_in_one_line(
    command: str, spoil: Callable[[Path], None], named: str, path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spoil(path)
    before = path.read_bytes() if path.is_file() else None
    told = rejected(capsys, command, str(path))
    assert named in told
    assert told.count("\n") == 1
    assert (path.read_bytes() if path.is_file() else None) == before
    assert [each.name for each in path.parent.iterdir() if each != path] == []


@pytest.mark.parametrize("missing", [100, pytest.param(9_000, marks=pytest.mark.soak), 30_000])
def test_of_a_truncated_file_the_beginning_is_kept(
    path: Path, missing: int, capsys: pytest.CaptureFixture[str]
) -> None:
    path.write_bytes(path.read_bytes()[:-missing])
    before = path.read_bytes()
    assert "truncated" in rejected(capsys, "verify", str(path))
    assert "recover" in rejected(capsys, "info", str(path))
    clean = path.with_name("clean.h5")
    assert main(["file", "recover", str(path), "--out", str(clean), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["samples"] + told["unreadable"] == ROWS
    assert path.read_bytes() == before
    assert main(["file", "verify", str(clean)]) == 0
    with bench.datafile.open(clean) as record:
        written = np.concatenate([block(first, 500).block.counts for first in range(0, ROWS, 500)])
        np.testing.assert_array_equal(record.counts("table"), written[: record.rows, 2])


def test_a_file_of_the_previous_format_is_read_and_brought_up_to_date(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with bench.datafile.open(path) as record:
        expected, checksums = [record.counts(channel.name) for channel in CHANNELS], record.checksums
    edited(path, as_format_1)
    before = path.read_bytes()
    assert main(["file", "info", str(path)]) == 0
    assert main(["file", "verify", str(path)]) == 0
    assert main(["file", "recover", str(path)]) == 0
    capsys.readouterr()
    assert path.read_bytes() == before
    newer = path.with_name("campaign-recovered.h5")
    with bench.datafile.open(path) as old, bench.datafile.open(newer) as new:
        assert (old.format_version, new.format_version) == (1, 2)
        assert old.points == new.points
        for channel, counts in zip(CHANNELS, expected, strict=True):
            np.testing.assert_array_equal(old.counts(channel.name), counts)
            np.testing.assert_array_equal(new.counts(channel.name), counts)
        # the time axis is the same to the last bit as the one that was written at once
        assert new.checksums["/entry/data/time"] == checksums["/entry/data/time"]
    assert main(["file", "verify", str(newer)]) == 0
    assert "never overwritten" in rejected_again(capsys, path)


def rejected_again(capsys: pytest.CaptureFixture[str], path: Path) -> str:
    capsys.readouterr()
    return rejected(capsys, "recover", str(path))


def test_events_that_the_file_lost_come_from_the_journal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, old = tmp_path / "campaign.h5", tmp_path / "old.h5"
    recorder = begin(path)
    recorder(Warned("first", time=0.5))
    recorder.sync()
    old.write_bytes(path.read_bytes())
    recorder(Warned("second", time=1.0))
    recorder(PointFinished(FULL, time=1.5))
    recorder.close("completed")
    journal_path(old).write_bytes(journal_path(path).read_bytes() + b'{"time": 2.0, "ki')
    assert main(["file", "recover", str(old)]) == 0
    assert "2 events and 1 point from the journal" in capsys.readouterr().out
    with bench.datafile.open(tmp_path / "old-recovered.h5") as record, bench.datafile.open(path) as written:
        assert record.events == written.events
        assert record.points == written.points


def test_runs_and_channels_are_arrays_that_are_read_when_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    recorder = begin(path)
    blocks = [block(0, 300, run=1, time=1.0), block(400, 200, run=1, time=1.2), block(0, 100, run=2, time=9.0)]
    for each in blocks:
        recorder(each)
    recorder.close("completed")
    with bench.datafile.open(path) as record:
        first, second = record.runs
        assert [(run.number, run.rows) for run in record.runs] == [(1, range(500)), (2, range(500, 600))]
        series = first.channels["table"]
        whole = record.values("table")
        assert (len(series), series.unit, series.quantity) == (500, "m/s2", "acceleration")
        np.testing.assert_array_equal(series[:], whole[:500])
        np.testing.assert_array_equal(series[490:10:-7], whole[:500][490:10:-7])
        np.testing.assert_array_equal(np.asarray(second.channels["table"]), whole[500:])
        np.testing.assert_array_equal(second.channels["table"][-1], whole[-1])
        np.testing.assert_array_equal(np.concatenate([*series.pieces(64)]), whole[:500])
        np.testing.assert_allclose(first.time[299:301], [299 / RATE, 400 / RATE], rtol=1e-15)
        assert second.time[0] == 0.0
        with pytest.raises(IndexError):
            series[500]
    with h5py.File(path) as file:
        time: Any = file["entry/data/time"][:]
        assert np.all(np.diff(time) > 0.0)
        np.testing.assert_allclose(time[[0, 299, 300, 500]], [0.85, 0.9995, 1.05, 8.95], atol=1e-6)


def test_recovery_tells_what_it_could_not_mend(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A copy has checksums of its own: what was wrong before must be said, or damage would turn into truth."""
    edited(path, change_sample)
    assert main(["file", "recover", str(path)]) == 0
    assert "still damaged in the copy: " in capsys.readouterr().err
    with bench.datafile.open(path.with_name(f"{path.stem}-recovered.h5")) as record:
        assert any("damaged before: " in told for told in record.recoveries)


@pytest.mark.parametrize("version", ["two", 0])
def test_a_version_that_is_none_is_refused(version: object, path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    edited(path, lambda file: file.attrs.__setitem__("format_version", version))
    assert main(["file", "info", str(path)]) == 2
    assert "is invalid" in capsys.readouterr().err


def test_what_does_not_hold_is_listed_at_once_or_by_reading_all(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with bench.datafile.open(path) as record:
        sound = record.integrity(None)
        assert (sound.failing, sound.unchecked, sound.compared) == ({}, (), len(record.checksums))
        # 3000 counts of 2 bytes are not read where at most 5000 bytes are
        assert "/entry/instrument/table/counts" in record.integrity(5000).unchecked
    edited(path, change_sample)
    edited(path, change_prediction)
    with bench.datafile.open(path) as record:
        assert [*record.integrity(5000).failing] == ["/entry/prediction/alpha_2"]
        assert {*record.integrity().failing} == {"/entry/prediction/alpha_2", "/entry/instrument/table/counts"}
        assert str(record.integrity()).startswith("damaged or changed since it was written: /entry/prediction/alpha_2")
    assert main(["file", "info", str(path), "--json"]) == 0
    captured = capsys.readouterr()
    assert len(json.loads(captured.out)["failing"]) == 2
    assert "/entry/prediction/alpha_2 was changed" in captured.err


def test_a_file_of_before_groups_had_checksums_is_sound(path: Path) -> None:
    def go_back(file: Any) -> None:
        for name in ("group", "group_attributes"):
            del file[f"entry/checksums/{name}"]

    edited(path, go_back)
    assert main(["file", "verify", str(path)]) == 0


def test_an_object_that_cannot_be_read_is_named(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with h5py.File(path) as file:
        place: int = h5py.h5o.get_info(file["entry/events/kind"].id).addr
    content = bytearray(path.read_bytes())
    assert content[place : place + 4] == b"OHDR"
    content[place + 30] ^= 0xFF
    path.write_bytes(content)
    assert "/entry/events/kind cannot be read" in rejected(capsys, "verify", str(path))
    with bench.datafile.open(path) as record, pytest.raises(DataFileError, match="/entry/events/kind cannot be read"):
        _ = record.events
    assert main(["file", "recover", str(path)]) == 0
    assert "/entry/events/kind cannot be read" in capsys.readouterr().err
    assert path.read_bytes() == content
    # the samples are kept, and the file says why the events are not there
    with bench.datafile.open(path.with_name("campaign-recovered.h5")) as record:
        assert (record.rows, record.events, record.status) == (ROWS, [], "interrupted")
        assert "/entry/events/kind cannot be read" in record.summary


def test_a_file_that_may_not_be_read_is_refused_by_verify_too(
    path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def denied(_: Path) -> bool:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("bench.datafile.opening.is_let_go", denied)
    for command in ("info", "verify"):
        assert main(["file", command, str(path), "--json"]) == 2
        assert "cannot be opened (Permission denied)" in json.loads(capsys.readouterr().out)["error"]["message"]
