"""`rockbench paper`: the statements' numbers against the project's reference values, and the report itself."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from bench.app.cli.main import main
from bench.prediction.statements import Check, Statement, Verdict, harmonic_statements
from bench.provenance import revision
from sim.specimen import Specimen

A_S = 1.238512
"""1.01 g / lambda [m/s2], Eq. (11)."""


@pytest.fixture(scope="module")
def statements() -> dict[int, Statement]:
    return {each.number: each for each in harmonic_statements(Specimen(), A_S)}


def values(statement: Statement) -> dict[str, float]:
    return {name: value for check in statement.checks for name, value in check.values.items()}


def test_all_but_the_phase_at_c_hold(statements: dict[int, Statement]) -> None:
    assert list(statements) == [1, 2, 3, 4, 5, 6, 7]
    assert {number for number, each in statements.items() if each.verdict is not Verdict.HOLDS} == {5}
    assert [check.verdict for check in statements[5].checks] == [Verdict.HOLDS, Verdict.EXPECTED, Verdict.HOLDS]


def test_numbers_against_reference_values(statements: dict[int, Statement]) -> None:
    # closed form of the bare frame: 6.321568 and 16.350104 rad/s
    found = values(statements[1])
    assert (found["f1"], found["f2"]) == pytest.approx((1.0061088, 2.6022), rel=1e-5)
    # steady alpha_2 by other integrators: 0.18429 at 16.05, 0.40493 at 13.95 and 0.82627 at 17.55 rad/s, beta 0.4;
    # the points lie 0.05 rad/s beside them, on slopes of at most 1.2 per rad/s
    found = values(statements[4])
    assert found["A"] == pytest.approx(0.18429, abs=0.01)
    assert found["B"] == pytest.approx(0.40493, abs=0.01)
    assert 0.82627 - 0.06 < found["C"] < 0.82627
    assert 17.55 < found["boundary"] < 17.8
    # 2.37277 at 17.85 rad/s, beta 0.25, beside the peak; 4.12652 at 19.95 rad/s, beta 0.64, below it
    found = values(statements[6])
    assert 2.37277 < found["height"] < 2.5
    assert found["peak"] == pytest.approx(18.0, abs=0.101)
    assert found["largest at 0.64"] > 19.95
    # above the second mode of the linearised system: 18.626 (0.4), 19.934 (0.64), 21.650 (0.97)
    ridge = [value for name, value in values(statements[7]).items() if name.startswith("ridge")]
    assert ridge == sorted(ridge)
    assert ridge[1] < 18.626 < ridge[2] < 19.934 < ridge[3]


def test_a_claim_can_fail() -> None:
    failed = Check("a", "b", False, {})
    known = Check("a", "b", False, {}, expected=False)
    held = Check("a", "b", True, {}, expected=False)
    assert Statement(1, "t", [held, known, failed]).verdict is Verdict.FAILS
    assert Statement(1, "t", [held, known]).verdict is Verdict.EXPECTED
    assert Statement(1, "t", [held]).verdict is Verdict.HOLDS


def test_a_quick_paper_has_what_was_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    html = tmp_path / "paper.html"
    only = ["--only", "modes", "seismic", "--records", "synthetic:pacoima", "--html", str(html)]
    assert main(["paper", *only]) == 0
    assert str(html) in capsys.readouterr().out
    tree = ElementTree.fromstring(html.read_text(encoding="utf-8").removeprefix("<!DOCTYPE html>\n"))
    keys = [each.get("id") for each in tree.iter("section")]
    assert keys == ["modes", "seismic", "specimen", "provenance"]
    text = "".join(tree.itertext())
    assert "SYNTHETIC" in text
    assert f"git {revision().removesuffix('+')}" in text
    assert main(["paper", *only]) == 2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--table-band", "5:1"], "--table-band"),
        (["--records", "nowhere.AT2"], "nowhere.AT2"),
        (["--only", "everything"], "only"),
        (["--html", "no/such/folder/p.html"], "folder does not exist"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["paper", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_folder_without_records_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "notes.txt").write_text("no record", encoding="utf-8")
    assert main(["paper", "--records", str(tmp_path), "--html", str(tmp_path / "p.html")]) == 2
    assert "no file in this folder" in capsys.readouterr().err
