import json
from pathlib import Path

import pytest

from bench.app.benchmark import section, suite
from bench.app.benchmark import work_precision as table
from bench.app.benchmark.section import Column, Section, Target, targets_section
from bench.app.benchmark.work_precision import NOT_INSTALLED, Method, methods
from bench.app.cli.main import main
from bench.comparators import case
from sim.errors import InvalidInput

TINY = suite.Scale("tiny", False, 0.02, 4, 2, 1, 4, 0.5, 1, 1, 1)
COMPILED = [method for method in methods(quick=True) if method.weight < 0.02 and not method.module]


@pytest.fixture
def few_methods(monkeypatch: pytest.MonkeyPatch) -> None:
    absent = Method("absent", "tolerance 1", 1.0, lambda: pytest.fail("it is not there"), "no_such_library")
    monkeypatch.setattr(table, "methods", lambda _quick: [*COMPILED, absent])


@pytest.mark.usefixtures("few_methods")
def test_a_tiny_benchmark_writes_well_formed_files(tmp_path: Path) -> None:
    out, said = tmp_path / "new" / "folder", []
    parts = ("work_precision", "gain_map", "streaming")
    suite.run_benchmark(TINY, out, parts=parts, say=said.append)
    assert sorted(path.name for path in out.iterdir()) == sorted(suite.RESULTS)

    data = json.loads((out / suite.JSON).read_text(encoding="utf-8"))
    assert {"machine", "versions", "scale", "started", "targets", *parts} <= data.keys()
    assert data["versions"]["numba"] != "unknown"
    rows = data["work_precision"]["rows"]
    taylor = next(row for row in rows if (row["method"], row["setting"]) == table.YARDSTICK)
    assert taylor["ratio"] == 1.0
    assert 0.0 < taylor["min_ms"] <= taylor["median_ms"]
    assert all(row["impacts"] == case.IMPACTS for row in rows if row["status"] == "ok")
    assert [row["status"] for row in rows if row["method"] == "absent"] == [NOT_INSTALLED]
    assert data["gain_map"]["rows"][0]["error"] < 1e-9
    assert data["streaming"]["rows"][0]["bitwise"] is True
    names = {row["name"]: row for row in data["targets"]["rows"]}
    assert names["error of taylor (1e-10) over 120 s"]["met"] is True
    assert names["map of 100 x 100 points"]["met"] is None

    text = (out / suite.MARKDOWN).read_text(encoding="utf-8")
    tables = [line for line in text.splitlines() if line.startswith("|")]
    assert len(tables) > 20
    assert text.count("\n## ") == len(parts) + 1
    assert (out / suite.FIGURE).read_bytes().startswith(b"\x89PNG")
    assert len(said) == len(parts) + 1


def test_results_are_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / suite.JSON).write_text("mine", encoding="utf-8")
    with pytest.raises(InvalidInput, match="never overwritten"):
        suite.run_benchmark(TINY, tmp_path, parts=())
    assert (tmp_path / suite.JSON).read_text(encoding="utf-8") == "mine"


def test_the_command_refuses_a_folder_with_results(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / suite.FIGURE).write_bytes(b"")
    assert main(["benchmark", "--quick", "--out", str(tmp_path)]) == 2
    assert suite.FIGURE in capsys.readouterr().err


def test_an_unknown_part_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="no_such_part"):
        suite.run_benchmark(TINY, tmp_path, parts=("no_such_part",))


def test_heyoka_finds_every_impact_of_the_standard_case() -> None:
    pytest.importorskip("heyoka")
    from bench.comparators.libraries import HeyokaPeer

    found = HeyokaPeer(1e-15, peaks=True).run()
    assert found.impacts == case.IMPACTS
    assert case.error_of(found.end) < 1e-12
    assert found.peaks is not None
    assert found.peaks == pytest.approx(case.PEAKS, rel=1e-12)


def test_cvode_finds_every_impact_of_the_standard_case() -> None:
    pytest.importorskip("sksundae")
    from bench.comparators.libraries import CvodePeer

    end, impacts = CvodePeer(1e-6).run()
    assert impacts == case.IMPACTS
    assert case.error_of(end) < 1e-5


def test_contenders_run_in_turn() -> None:
    order: list[str] = []
    runs = {"a": (lambda: order.append("a"), 2), "b": (lambda: order.append("b"), 4)}
    found = section.in_turn(runs)
    assert order == ["b", "a", "b", "b", "a", "b"]
    assert found["a"].minimum <= found["a"].median


def test_missed_targets_come_first() -> None:
    missed = Target("missed", 1.0, 2.0, "s", "The disk is slow.")
    targets = (Target("kept", 1.0, 0.5, "s", "Nothing."), Target("unknown", 1.0, None, "s"), missed)
    section = targets_section([Section("x", "X", (), (), targets=targets)])
    assert [row["name"] for row in section.rows] == ["missed", "unknown", "kept"]
    assert [row["met"] for row in section.rows] == [False, None, True]
    assert "NO" in section.text().splitlines()[4]
    assert section.notes == ["Missed: missed. The disk is slow."]


def test_a_table_is_aligned_in_text_and_ruled_in_markdown() -> None:
    columns = (Column("name", "name"), Column("value", "value [ms]", ".2f"))
    section = Section("x", "X", columns, [{"name": "long name", "value": 3.14159}, {"name": "b"}], ("a note",))
    lines = section.text().splitlines()
    assert lines[4].split() == ["long", "name", "3.14"]
    assert lines[4].endswith("3.14")
    assert len(lines[4]) == len(lines[2]) == len(lines[5])
    assert "| --- | --: |" in section.markdown()
    assert "| b | - |" in section.markdown()
    assert Section("x", "X", columns, [{"name": "n", "value": float("nan")}]).as_dict()["rows"] == [
        {"name": "n", "value": None}
    ]
