"""What a campaign read of other files comes back from its data file to the last bit."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from bench.accelerograms.accelerogram import Accelerogram
from bench.control.table_model import TableModel
from bench.datafile.reader import open_datafile
from bench.datafile.recorder import Recorder
from bench.testing.loopback import LoopbackRig
from protocols.earthquake.protocol import EarthquakePoint
from protocols.earthquake.records import FileSources


def record(name: str, n: int, dt: float, synthetic: bool) -> Accelerogram:
    values = np.random.default_rng(n).standard_normal(n) * 10.0 ** np.random.default_rng(n).integers(-9, 2, n)
    header = {"station": "L'Aquila – Ã", "components": "a\nb" * 400}
    return Accelerogram(name, values, dt, f"/home/{name}.AT2", "PEER", "g", f"{n:064x}", header, synthetic)


def model() -> TableModel:
    lines = tuple(np.linspace(0.1, 80.0, 300).tolist())
    values = dict.fromkeys(("real", "imaginary", "uncertainty", "distortion", "coherence", "noise"), lines[::-1])
    date = datetime(2026, 11, 21, 8, 30, 1, 234567, UTC)
    return TableModel(date=date, specimen="bare frame", sample_rate=2000.0, level=0.1, frequency=lines, **values)


def through_a_file(path: Path, sources: FileSources) -> FileSources | None:
    rig = LoopbackRig()
    recorder = Recorder(
        path,
        channels=rig.channels,
        sample_rate=rig.sample_rate,
        point_type=EarthquakePoint,
        metadata={},
        tables=sources.tables,
    )
    recorder.close("completed")
    with open_datafile(path) as kept:
        return FileSources.stored(kept.tables)


def test_records_and_table_model_come_back_to_the_last_bit(tmp_path: Path) -> None:
    made = FileSources((record("Newhall", 1000, 0.02, False), record("ä b", 377, 1.0 / 3.0, True)), model())
    found = through_a_file(tmp_path / "run.h5", made)
    assert found is not None
    assert found.table == made.table
    for was, now in zip(made.records, found.records, strict=True):
        assert now.acceleration.tobytes() == was.acceleration.tobytes()
        for name in ("name", "dt", "source", "format", "unit", "sha256", "header", "synthetic"):
            assert getattr(now, name) == getattr(was, name)


def test_a_file_of_before_has_none_and_a_campaign_without_a_model_has_no_model(tmp_path: Path) -> None:
    assert FileSources.stored({}) is None
    found = through_a_file(tmp_path / "run.h5", FileSources((record("a", 5, 0.01, True),), None))
    assert found is not None
    assert found.table is None
