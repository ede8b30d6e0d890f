"""How sensors with clocks of their own were placed, and what wide or faulty counts are, in the file."""

import json
from dataclasses import replace
from pathlib import Path

import h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np

from bench.datafile.reader import open_datafile
from bench.events import Acquired, SensorsAligned
from drivers.rig import Alignment, Block, Channel
from tests.bench.datafile.example import begin, block, record

FIRST = Alignment("storey 1", 0.125, 1.0 + 30e-6, 2.5e-6, 0.0035, 120_000, 3)
SECOND = Alignment("storey 2", -1.5, 1.0 - 21e-6, 1.0e-6, 0.0035, 119_990, 0)


def test_alignments_come_back_exactly_by_run(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    told = (SensorsAligned(1, (FIRST, SECOND), time=1.0), SensorsAligned(3, (SECOND,), time=9.0))
    record(begin(path), block(0, 10), *told)
    with open_datafile(path) as kept:
        assert kept.alignments == {1: (FIRST, SECOND), 3: (SECOND,)}
        (first, _) = [event for event in kept.events if event.kind == "SensorsAligned"]
        assert first.text == (
            "storey 1: clock +30.0 ppm, rms residual 2 us, 120000 values, 3 lost;"
            " storey 2: clock -21.0 ppm, rms residual 1 us, 119990 values, 0 lost"
        )


def test_the_table_says_its_units(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    record(begin(path), SensorsAligned(1, (FIRST,), time=0.0))
    with h5py.File(path) as file:
        group = file["entry/instrument/alignments"]
        units = {name: group[name].attrs["units"] for name in group if name != "sensor"}
        assert file["entry/complete"][5] == 1
    seconds = ("offset", "residual", "delay", "mark_uncertainty")
    assert units == {
        **dict.fromkeys(("run", "rate", "values", "lost", "late", "implausible"), "1"),
        **dict.fromkeys(seconds, "s"),
    }


def test_a_record_without_the_table_has_no_alignments(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    record(begin(path), block(0, 10))
    with h5py.File(path, "r+") as file:
        del file["entry/instrument/alignments"]
    with open_datafile(path) as kept:
        assert kept.alignments == {}
        kept.refresh()


def test_alignments_can_be_read_while_the_file_is_written(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    recorder = begin(path)
    with open_datafile(path) as kept:
        assert kept.alignments == {}
        recorder(SensorsAligned(1, (FIRST,), time=0.0))
        recorder.sync()
        kept.refresh()
        assert kept.alignments == {1: (FIRST,)}
    recorder.close("completed")


def test_wide_counts_their_polynomial_and_what_faults_mean_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    wide = Channel("wide", "acceleration", "m/s2", 1e-6, 0.5, (-8_000_000, 8_000_000), "24 bit", higher=(1e-15,))
    wide = replace(wide, delay=0.02, delay_uncertainty=1e-6)
    laser = Channel("laser", "displacement", "m", 3e-6, 0.0, (-32760, 32760), "serial", faults={32763: "no target"})
    counts = np.array([[7_999_999, 32763], [-8_000_001, 100]], dtype=np.int32)
    record(begin(path, channels=(wide, laser)), Acquired(1, Block(0, counts), np.zeros(2), time=0.0))
    with h5py.File(path) as file:
        stored = file["entry/instrument/wide/counts"]
        assert stored.dtype == np.int32
        assert stored.attrs["higher"].tolist() == [1e-15]
        assert file["entry/instrument/laser/counts"].dtype == np.int16
        assert json.loads(file["entry/instrument/laser/counts"].attrs["faults"]) == {"32763": "no target"}
    with open_datafile(path) as kept:
        # by hand: 7.999999 + 0.5 + 1e-15 * 7999999^2
        np.testing.assert_allclose(kept.values("wide"), [8.563999 - 1.6e-8, np.nan], rtol=1e-9)
        assert kept.channels == (wide, laser)
