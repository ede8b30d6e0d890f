"""Long-term motions as predictions: drawn specimens, and the command."""

import json
from math import nan
from pathlib import Path

import numpy as np
import pytest

from bench.app.cli.main import main
from bench.prediction.attractors import MEMBER_CYCLES, long_term
from sim.attractor import Attractor
from sim.gain import predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.table_orbit import TableOrbit

SPECIMEN = Specimen().coupled(0.97)


def test_the_range_is_that_of_the_drawn_specimens() -> None:
    branch = predict_gain(SPECIMEN, 15.0, 1.01 * Specimen().uplift_acceleration).rocking
    assert branch is not None
    exact = SpecimenKnowledge(stiffness=0.0, damping=0.0, restitution=0.0, spring=0.0)
    certain, drawn = (
        long_term(branch, known, Shaker(), 5, cycles=300, members=3)
        for known in (exact, SpecimenKnowledge(stiffness=0.005, damping=0.05, restitution=0.002, spring=0.005))
    )
    peaks = (certain.least, certain.mean, certain.greatest)
    assert certain.low == pytest.approx(peaks, rel=1e-12)
    assert certain.high == pytest.approx(peaks, rel=1e-12)
    assert certain.falls == 0.0
    assert np.all(drawn.low < drawn.high)
    assert np.array_equal(drawn.gains, certain.gains)
    assert certain.greatest == certain.gains.max()
    assert certain.least <= certain.gains.min()


def test_specimens_whose_block_falls_late_count_with_the_cycles_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of three drawn specimens, one falls late, one early, and one does not."""
    branch = predict_gain(SPECIMEN, 15.0, 1.01 * Specimen().uplift_acceleration).rocking
    assert branch is not None
    none = np.empty((0, 2))
    drawn = iter([Attractor(none, (0.01, 0.02, 0.05), 400), Attractor(none, (nan, nan, nan), 100)])

    def followed(_specimen: Specimen, _shaker: Shaker, _orbit: TableOrbit, cycles: int) -> Attractor:
        standing = Attractor(np.ones((240, 2)), (0.02, 0.03, 0.04))
        return next(drawn, standing) if cycles == MEMBER_CYCLES else standing

    monkeypatch.setattr("bench.prediction.attractors.attractor", followed)
    exact = SpecimenKnowledge(stiffness=0.0, damping=0.0, restitution=0.0, spring=0.0)
    found = long_term(branch, exact, Shaker(), 5, cycles=700, members=3)
    assert found.counted == 2
    assert found.falls == pytest.approx(2.0 / 3.0)
    assert found.low / found.least == pytest.approx([0.5, 1.0, 2.0])
    assert found.high / found.least == pytest.approx([1.0, 1.5, 2.5])


def test_the_command_lists_both_kinds_of_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--omega", "15", "--beta", "0.4", "0.97", "--cycles", "300", "--members", "2", "--json"]
    assert main(["predict", "attractor", *flags, "--plot", str(tmp_path / "attractor.png")]) == 0
    stable, unstable = json.loads(capsys.readouterr().out)["points"]
    assert stable["stable"]
    assert stable["repeats_cycles"] == 1
    assert stable["alpha_2_greatest"] == stable["alpha_2"]
    assert not unstable["stable"]
    assert unstable["alpha_2_least"] < unstable["alpha_2_mean"] < unstable["alpha_2_greatest"]
    assert (tmp_path / "attractor.png").stat().st_size > 0
