"""A map of several blocks continues after an interruption, with the bytes of one that was not interrupted."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from bench.app.cli.main import main
from bench.datafile.tables import Column
from bench.prediction.map_store import STATE, MapStore, discard
from sim import map_rows
from sim.errors import InvalidInput
from sim.map_rows import Continuation

COLUMNS, ROWS = 4, 8
LINE = ["predict", "map", "--omega", f"14:20:{COLUMNS}", "--beta", "0.2:0.9:23", "--band"]


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(map_rows, "POINTS", COLUMNS * ROWS)


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_map_continues_where_it_was_interrupted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def outputs(name: str) -> list[str]:
        return [*LINE, "--out", str(tmp_path / f"{name}.h5"), "--csv", str(tmp_path / f"{name}.csv")]

    assert main(outputs("whole")) == 0
    assert files(tmp_path) == {"whole.h5", "whole.csv"}
    expected = capsys.readouterr().out

    told: list[tuple[int, int]] = []

    def interrupt(phase: str, done: int = 0, total: int = 0, /) -> None:
        if phase == "computing the gain map" and total:
            told.append((done, total))
            if done > total * 2 * ROWS / 23:
                raise KeyboardInterrupt

    assert main(outputs("broken"), progress=interrupt) == 130
    assert "complete rows: 16 of 23; the same command continues the map" in capsys.readouterr().err
    assert all(done <= total for done, total in told)
    assert told == sorted(told)
    assert files(tmp_path) == {"whole.h5", "whole.csv", ".broken.h5.unfinished"}
    # a block that was being appended when the process was killed
    with (tmp_path / ".broken.h5.unfinished" / "alpha_2.bin").open("ab") as file:
        file.write(b"half a row")

    assert main(outputs("broken")) == 0
    shown = capsys.readouterr()
    assert "the map continues at row 17" in shown.err
    assert shown.out == expected
    assert (tmp_path / "broken.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert files(tmp_path) == {"whole.h5", "whole.csv", "broken.h5", "broken.csv"}


def test_without_a_file_nothing_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(LINE[:-1]) == 0
    assert files(tmp_path) == set()


def state(rows: int) -> Continuation:
    return Continuation(rows, np.zeros((2, 3, 6)), np.zeros((2, 3, 6, 6)))


def table(*values: float) -> dict[str, Column]:
    names = np.array(["rocking"] * len(values))
    return {"alpha_2": Column(np.array(values), "1", "gain"), "layer": Column(names, "", "branch")}


def test_rows_of_other_inputs_are_discarded(tmp_path: Path) -> None:
    folder = tmp_path / "map"
    store = MapStore(folder, {"omega": 1})
    store.append(table(1.0, 2.0), state(1))
    store.append(table(3.0), state(2))
    store.close()
    again = MapStore(folder, {"omega": 1})
    assert again.after is not None
    assert again.after.rows == 2
    assert again.table()["alpha_2"].values.tolist() == [1.0, 2.0, 3.0]
    assert again.table()["layer"].values.tolist() == ["rocking"] * 3
    again.close()
    other = MapStore(folder, {"omega": 2})
    assert other.after is None
    other.append(table(5.0), state(1))
    assert other.table()["alpha_2"].values.tolist() == [5.0]
    (folder / STATE).write_bytes(b"PK damaged")
    other.close()
    assert MapStore(folder, {"omega": 2}).after is None


def test_a_folder_of_others_is_not_removed(tmp_path: Path) -> None:
    (tmp_path / "map").mkdir()
    (tmp_path / "map" / "thesis.txt").touch()
    with pytest.raises(InvalidInput, match="does not contain an unfinished map"):
        MapStore(tmp_path / "map", {}).append(table(1.0), state(1))
    assert (tmp_path / "map" / "thesis.txt").exists()


@pytest.mark.parametrize("inputs", [{"omega": 1}, {"omega": 2}])
def test_a_second_process_is_refused_until_the_first_has_ended(tmp_path: Path, inputs: object) -> None:
    folder = tmp_path / "map"
    first = MapStore(folder, {"omega": 1})
    with pytest.raises(InvalidInput, match=rf"process {os.getpid()} is writing its map there"):
        MapStore(folder, inputs)
    first.append(table(1.0, 2.0), state(1))
    discard(folder)
    assert first.table()["alpha_2"].values.tolist() == [1.0, 2.0]
    first.close()
    second = MapStore(folder, inputs)
    assert (second.after is None) == (inputs != {"omega": 1})
    second.close()
    # without rows the folder is removed
    assert folder.exists() == (inputs == {"omega": 1})


def test_rows_of_an_earlier_map_are_removed_by_one_that_stores_none(tmp_path: Path) -> None:
    folder = tmp_path / ".small.h5.unfinished"
    store = MapStore(folder, {"omega": 1})
    store.append(table(1.0), state(1))
    store.close()
    small = ["predict", "map", "--omega", "14:20:3", "--beta", "0.2:0.9:3", "--out", str(tmp_path / "small.h5")]
    assert main(small) == 0
    assert files(tmp_path) == {"small.h5"}


@pytest.mark.skipif(sys.platform != "linux", reason="the list of mapped files is that of Linux")
def test_no_file_is_mapped_when_the_folder_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mapped, remove = list[bool](), MapStore.remove

    def observed(store: MapStore) -> None:
        remove(store)
        mapped.append(str(store.folder) in Path("/proc/self/maps").read_text(encoding="utf-8"))

    monkeypatch.setattr(MapStore, "remove", observed)
    assert main([*LINE[:-1], "--out", str(tmp_path / "map.h5"), "--plot", str(tmp_path / "map.png")]) == 0
    assert mapped == [False]
