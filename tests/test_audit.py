"""Coverage of the stated uncertainties on drawn benches, and the command that makes the table of docs/accuracy.md."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks import audit
from tests.benchmarks.audit_studies import Outcome, Study, studies
from tests.benchmarks.estimates import HONEST, Estimate, Omitted, Statistics, bounds

FAILING = 0.005
"""Probability with which honest intervals fail one of these tests."""


def assert_honest(study: Study, benches: int) -> None:
    """Coverage and rms of e of all quantities of a study are those of honest intervals."""
    measured = [one for seed in range(benches) if not isinstance(one := study.bench(seed), Omitted)]
    # of the drawn specimens, up to half have no stable motion
    assert len(measured) >= benches // 2
    least, most = bounds(len(measured), FAILING / len(study.quantities))
    for key in study.quantities:
        found = Statistics.of([one[key] for one in measured])
        assert found.covered * found.n >= least, key
        assert found.rms <= most, key


@pytest.mark.parametrize(
    ("name", "benches"),
    [
        # few of the gain under a sine, of which each takes longer
        ("alpha_2, default, 16, 0.4", 5),
        ("record, default, pacoima, 0.97", 6),
        *(
            pytest.param(name, benches, marks=pytest.mark.soak)
            for name, benches in (
                ("alpha_2, default, 16, 0.4", 40),
                ("alpha_2, default, 20, 0.64", 40),
                ("alpha_2, short waves, 16, 0.4", 40),
                ("record, default, l-aquila, 0.25", 40),
                ("record, short waves, pacoima, 0.97", 40),
                ("record, calibrated, l-aquila, 0.25", 10),
                ("alpha_2, calibrated, 16, 0.4", 10),
                ("frame, pulse", 40),
                ("block", 40),
                ("multiplier, 15, 0.97", 20),
                ("table", 40),
                ("check", 40),
            )
        ),
    ],
)
def test_intervals_cover_the_truth(name: str, benches: int) -> None:
    """Honest intervals pass with a probability of 0.995 at least; uncertainties a third as large fail."""
    assert_honest(studies()[name], benches)


def _normal(seed: int, size: float = 1.0) -> Outcome:
    """An estimate of 3 with a standard uncertainty of 0.1 and an error `size` times as large; every fifth omitted."""
    if seed % 5 == 4:
        return Omitted("fell")
    return {"x": Estimate(3.0 + 0.1 * size * float(np.random.default_rng(seed).standard_normal()), 0.1, 3.0)}


MADE = Study("made, normal", "made", {"x": "x"}, _normal, 0.1)


def test_bounds_pass_honest_intervals_with_the_stated_probability_and_fail_others() -> None:
    random = np.random.default_rng(2)
    for n in (5, 16, 40):
        least, most = bounds(n)
        e = random.standard_normal((4000, n))

        def passed(e: np.ndarray, least: int = least, most: float = most) -> float:
            inside = np.count_nonzero(np.abs(e) <= 2.0, axis=1) >= least
            return float(np.mean(inside & (np.sqrt(np.mean(e**2, axis=1)) <= most)))

        assert passed(e) >= 0.995 - 3.0 * np.sqrt(0.005 / 4000)
        assert passed(2.0 * e) < {5: 0.6, 16: 0.1, 40: 0.01}[n]


def test_uncertainties_that_are_half_as_large_fail() -> None:
    assert_honest(MADE, 40)
    with pytest.raises(AssertionError):
        assert_honest(replace(MADE, bench=lambda seed: _normal(seed, 2.0)), 40)


def test_statistics_of_estimates() -> None:
    e = np.array([0.0, 1.0, -1.9, 2.1])
    found = Statistics.of([Estimate(5.0 + 0.5 * one, 0.5, 5.0) for one in e])
    assert (found.n, found.expanded, found.relative) == (4, 1.0, 0.2)
    assert (found.covered, found.mean) == (0.75, pytest.approx(0.3))
    assert found.rms == pytest.approx(np.sqrt(np.mean(e**2)))
    # Clopper and Pearson, 3 of 4: tables of the exact binomial interval
    assert (found.low, found.high) == (pytest.approx(0.1941, abs=1e-4), pytest.approx(0.9937, abs=1e-4))
    assert not found.conspicuous
    assert Statistics.of([Estimate(0.0, 1.0, truth) for truth in np.linspace(-4.0, 4.0, 40)]).conspicuous
    assert Statistics.of([Estimate(0.0, 1.0, 0.3)] * 40).conspicuous
    assert 0.9544 < HONEST < 0.9546


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The audit with one quick study; the seeds of the benches that were carried out."""
    seeds = list[int]()

    def bench(seed: int) -> Outcome:
        seeds.append(seed)
        return _normal(seed)

    monkeypatch.setattr(audit, "studies", lambda: {MADE.name: replace(MADE, bench=bench)})
    return seeds


def test_results_are_stored_and_extended(made: list[int], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "results" / "audit.json"
    command = ["--results", str(path), "--processes", "1"]
    audit.main([*command, "--benches", "10"])
    audit.main([*command, "--benches", "30"])
    assert made == [*range(30)]
    assert json.loads(path.read_text(encoding="utf-8"))[MADE.name]["4"] == "fell"
    row = capsys.readouterr().out.splitlines()[-1]
    expected = Statistics.of([one["x"] for seed in range(30) if not isinstance(one := _normal(seed), Omitted)])
    assert row.startswith("| x | made | 24 (6) | 6.7 % | ")
    assert f"| {expected.rms:.2f} |" in row
    audit.main([*command, "--benches", "2", "--anew", "made"])
    assert made == [*range(30), 0, 1]
    with pytest.raises(SystemExit, match="no study begins with other"):
        audit.main([*command, "--only", "other"])


@pytest.mark.usefixtures("made")
def test_the_table_is_put_between_the_marks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "accuracy.md"
    page.write_text(f"before\n\n{audit.BEGIN}\nold\n{audit.END}\n\nafter\n", encoding="utf-8")
    monkeypatch.setattr(audit, "PAGE", page)
    monkeypatch.setattr(audit, "ROOT", tmp_path)
    audit.main(["--results", str(tmp_path / "audit.json"), "--processes", "1", "--benches", "5", "--write"])
    lines = page.read_text(encoding="utf-8").splitlines()
    assert (lines[:3], lines[-3:]) == (["before", "", audit.BEGIN], [audit.END, "", "after"])
    assert lines[4:6] == list(audit.HEADING)
    assert lines[6].startswith("| x | made | 4 (1) |")
    assert "old" not in lines


def test_the_page_has_rows_of_declared_studies_only() -> None:
    text = audit.PAGE.read_text(encoding="utf-8").split(audit.BEGIN)[1].split(audit.END)[0]
    rows = [tuple(cell.strip() for cell in line.split("|")[1:3]) for line in text.splitlines() if line.startswith("| ")]
    declared = [(symbol, one.case) for one in studies().values() for symbol in one.quantities.values()]
    assert not any("|" in cell for row in declared for cell in row)
    assert rows[1:] == [row for row in declared if row in rows]
    assert len(rows) > 30
