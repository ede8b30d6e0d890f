"""Numbers with their nouns, in the singular and plural, in rows, the verdict and notes."""

from math import nan
from pathlib import Path

import numpy as np
import pytest

import bench
from bench.app.display.verdict import running_verdict
from bench.app.run_display import Row
from bench.datafile.recovery import Recovery
from bench.events import Acquired
from bench.live_values import Estimate
from bench.testing.loopback import LoopbackRig
from drivers.rig import Block
from tests.bench.datafile.example import begin, record


@pytest.mark.parametrize(("number", "effort"), [(0, "0 cycles"), (1, "1 cycle"), (2, "2 cycles")])
def test_cycles_of_a_point_are_counted_in_singular_and_plural(number: int, effort: str) -> None:
    estimate = Estimate(16.0, 0.4, number, 0.01, 1.1, nan, 1.2)
    assert Row.running(estimate).effort == effort
    assert Row.finished({"cycles_measured": number}).effort == effort
    assert running_verdict(estimate).endswith(effort)


def test_a_single_pass_is_no_plural() -> None:
    efforts = [Row.finished(point).effort for point in ({}, {"passes": 1}, {"passes": 2})]
    assert efforts == ["0 passes", "1 pass", "2 passes"]


def test_a_single_lost_row_is_no_plural() -> None:
    recovery = Recovery(Path("copy.h5"), 7, 0, 0, {"samples": 1, "events": 2})
    assert recovery.loss == "1 row of samples, 2 rows of events"


@pytest.mark.parametrize(
    ("runs", "there"),
    [(0, "the file contains no run"), (1, "the file contains only run 1"), (2, "the file contains runs 1 to 2")],
)
def test_a_run_that_is_not_in_the_file_is_refused_with_those_that_are(runs: int, there: str, tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    metadata = {"configuration": bench.Configuration().model_dump_json(), "protocol": "harmonic", "parameters": "{}"}
    channels = LoopbackRig().channels
    counts, drive = np.zeros((50, len(channels)), np.int16), np.zeros(50)
    blocks = [Acquired(number, Block(0, counts), drive, time=float(number)) for number in range(1, runs + 1)]
    record(begin(path, channels=channels, metadata=metadata), *blocks)
    with bench.open(path) as campaign, pytest.raises(bench.InvalidInput, match=f"run = 9 is refused: {there}$"):
        campaign.samples("drift", run=9)
