"""A map of several blocks continues after an interruption, with the bytes of one that was not interrupted."""

from pathlib import Path

import numpy as np
import pytest

from bench.app.cli.main import main
from bench.datafile.tables import Column
from bench.prediction.map_store import STATE, MapStore
from sim import map_rows
from sim.errors import InvalidInput
from sim.map_rows import Continuation

LINE = ["predict", "map", "--omega", "14:20:12", "--beta", "0.2:0.9:23", "--band"]
ROWS = 8


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(map_rows, "POINTS", 12 * ROWS)


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
    assert "16 of 23 rows are complete; the same command continues the map" in capsys.readouterr().err
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
    again = MapStore(folder, {"omega": 1})
    assert again.after is not None
    assert again.after.rows == 2
    assert again.table()["alpha_2"].values.tolist() == [1.0, 2.0, 3.0]
    assert again.table()["layer"].values.tolist() == ["rocking"] * 3
    other = MapStore(folder, {"omega": 2})
    assert other.after is None
    other.append(table(5.0), state(1))
    assert other.table()["alpha_2"].values.tolist() == [5.0]
    (folder / STATE).write_bytes(b"PK damaged")
    assert MapStore(folder, {"omega": 2}).after is None


def test_a_folder_of_others_is_not_removed(tmp_path: Path) -> None:
    (tmp_path / "map").mkdir()
    (tmp_path / "map" / "thesis.txt").touch()
    with pytest.raises(InvalidInput, match="does not contain an unfinished map"):
        MapStore(tmp_path / "map", {}).append(table(1.0), state(1))
    assert (tmp_path / "map" / "thesis.txt").exists()


@pytest.mark.parametrize("inputs", [{"omega": 1}, {"omega": 2}])
def test_two_processes_do_not_mix_their_rows(tmp_path: Path, inputs: object) -> None:
    folder = tmp_path / "map"
    first = MapStore(folder, {"omega": 1})
    first.append(table(1.0, 2.0), state(1))
    second = MapStore(folder, inputs)
    second.append(table(8.0, 9.0), state(1))
    with pytest.raises(InvalidInput, match="another process writes its map there"):
        first.append(table(3.0), state(2))
    with pytest.raises(InvalidInput, match="another process writes its map there"):
        first.table()
    assert second.table()["alpha_2"].values.tolist()[-2:] == [8.0, 9.0]
