"""A replay compares fitted curves, their parameters and identified properties with the recorded ones."""

import json
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from bench.app.cli.main import main
from bench.findings import FitFinished, FittedParameter, Series
from bench.replay.fits import differences_of_columns
from bench.results import FILE

pytestmark = pytest.mark.usefixtures("no_figures")

QUICK = "[acquisition]\nblock_duration = 0.2\n[simulation.bench]\nsample_rate = 1000.0\n"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fits")
    bench, run = folder / "bench.toml", folder / "run"
    bench.write_text(QUICK, encoding="utf-8")
    command = ["run", "free-vibration", "--repeats", "1", "--window", "10", "--config", str(bench), "--seed", "2"]
    assert main([*command, "--yes", "--json", "--out", str(run)]) == 0
    return run / FILE


def test_they_are_compared(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["replay", str(file), "--json"]) == 0
    replayed = json.loads(capsys.readouterr().out)
    assert replayed["differences"] == []
    assert replayed["compared"]["fit parameters"] > 0
    assert replayed["compared"]["identified properties"] > 0


CHANGED = {
    "fit_values/value": "of the largest value",
    "fit_parameters/value": "of fit parameters: value was",
    "identified/value": "of identified properties: value was",
}
"""What is said of a change of the largest value of each dataset."""


def test_a_changed_one_is_a_difference(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One replay tells all three apart."""
    copy = tmp_path / FILE
    shutil.copy(file, copy)
    with h5py.File(copy, "r+") as content:
        for dataset in CHANGED:
            values = content["entry"][dataset]
            at = int(np.nanargmax(np.abs(values[:])))
            values[at] *= 1.001
    capsys.readouterr()
    assert main(["replay", str(copy), "--json"]) == 1
    found = [each["text"] for each in json.loads(capsys.readouterr().out)["differences"] if not each["rounding"]]
    assert len(found) == len(CHANGED)
    for said in CHANGED.values():
        assert len([text for text in found if said in text]) == 1


def test_columns_are_compared_with_the_largest_of_their_unit() -> None:
    def fit(residual: float, extra: int = 0) -> FitFinished:
        time, measured = np.arange(4.0 + extra), np.full(4 + extra, 2e-3)
        left = np.array([residual, np.nan, *[0.0] * (2 + extra)])
        columns = {"time": Series(time, "s", ""), "u1": Series(measured, "m", ""), "residual": Series(left, "m", "")}
        return FitFinished("decay", "a decay", columns, {"k1": FittedParameter(200.0, 0.1, "N/m")})

    found = dict(differences_of_columns([fit(1e-6)], [fit(2e-6)]))
    assert found == {"decay: time": 0.0, "decay: u1": 0.0, "decay: residual": pytest.approx(0.5e-3)}
    assert set(dict(differences_of_columns([fit(1e-6)], [fit(1e-6)])).values()) == {0.0}
    assert dict(differences_of_columns([fit(1e-6)], [fit(1e-6, extra=1)]))["decay: u1"] == np.inf
