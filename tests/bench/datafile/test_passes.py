"""Passes of replications and running gains in the file: as numbers, while it is written, absent from older files."""

from dataclasses import replace
from pathlib import Path

import h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np

from bench.datafile.reader import open_datafile
from bench.events import Event
from bench.live_values import RunningGain
from protocols.common.replicate import PassFinished
from tests.bench.datafile.example import begin, block, record

PASS = PassFinished("Ω record", 1, 0.0381, 0.0379, 0.046, 1.0 / 3.0, True, "pass 1 (gain 1): error 3.81%", time=7.5)
GAIN = RunningGain("Ω record", 0.25, 4.2, 0.0031, 0.84, float("nan"), time=9.0)


def stored(event: Event) -> dict[str, object]:
    return {name: value for name, value in vars(event).items() if name != "text"}


def test_they_come_back_exactly(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    second = replace(PASS, number=2, accepted=False)
    record(
        begin(path, events=(PassFinished,)), block(0, 10), PASS, second, GAIN, replace(GAIN, beta=None, predicted=0.9)
    )
    with open_datafile(path) as kept:
        assert kept.rows_of(PassFinished) == [stored(PASS), stored(second)]
        gains = kept.columns_of(RunningGain)
        assert {name: column[0] for name, column in gains.items() if name != "predicted"} == {
            name: value for name, value in stored(GAIN).items() if name != "predicted"
        }
        assert np.isnan(gains["predicted"][0])
        assert (gains["beta"], gains["predicted"][1]) == ([0.25, None], 0.9)
        # a pass is an event to be read as well; running gains are too many
        assert [(event.kind, event.text) for event in kept.events] == [
            ("PassFinished", "Ω record: pass 1 (gain 1): error 3.81%")
        ] * 2
        assert "passes" not in kept.tables


def test_they_can_be_read_while_the_file_is_written(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    recorder = begin(path, events=(PassFinished,))
    with open_datafile(path) as kept:
        assert (kept.rows_of(PassFinished), kept.columns_of(RunningGain)["record"]) == ([], [])
        recorder(PASS)
        recorder(GAIN)
        recorder.sync()
        kept.refresh()
        assert kept.rows_of(PassFinished) == [stored(PASS)]
        assert kept.columns_of(RunningGain)["seconds"] == [4.2]
    recorder.close("completed")


def test_a_file_of_before_has_none(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    record(begin(path, events=(PassFinished,)), block(0, 10))
    with h5py.File(path, "r+") as file:
        counted = file["entry/complete"][:6]
        for name in ("entry/passes", "entry/running_gains", "entry/complete"):
            del file[name]
        file["entry"].create_dataset("complete", data=counted)
    with open_datafile(path) as kept:
        assert (kept.rows, kept.rows_of(PassFinished), kept.columns_of(RunningGain)) == (10, [], {})
        kept.refresh()
