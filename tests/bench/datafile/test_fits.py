"""Fitted models in the file: as they were said, while it is written, as plots of NeXus programs, after recovery."""

from pathlib import Path

import h5py  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
import pytest

from bench.app.run_display import notice_of
from bench.datafile.inspection import verify
from bench.datafile.reader import DataFile, open_datafile
from bench.datafile.recovery import recover
from bench.findings import FitFinished, FittedParameter, Series
from tests.bench.datafile.example import begin, block, record

TIME = np.arange(700) / 200.0


def fit(name: str, rows: int = 700, scale: float = 1e-3) -> FitFinished:
    time = TIME[:rows]
    columns = {
        "time": Series(time, "s", "time since the release"),
        "u1": Series(scale * np.cos(9.0 * time), "m", "storey 1, measured"),
        "u1 fitted": Series(scale * np.cos(9.1 * time), "m", "storey 1, fitted"),
        "damping": Series(np.full(rows, 0.01), "1", "damping ratio in a window"),
    }
    found = {"k1": FittedParameter(410.0, 0.3, "N/m"), "xi1": FittedParameter(0.01, float("nan"), "1")}
    return FitFinished(name, f"{name}: ω₁ found", columns, found, time=12.5)


def check(kept: DataFile, *fits: FitFinished) -> None:
    assert [(one.time, one.name, one.text) for one in kept.fits] == [(one.time, one.name, one.text) for one in fits]
    for one, said in zip(kept.fits, fits, strict=True):
        assert repr(one.parameters) == repr(said.parameters)
        assert list(one.columns) == list(said.columns)
        for name, series in said.columns.items():
            np.testing.assert_array_equal(one.columns[name].values, series.values)
            assert (one.columns[name].unit, one.columns[name].description) == (series.unit, series.description)


def test_fits_come_back_and_are_plotted(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    fits = (fit("decay 1"), fit("decay 2", rows=300, scale=2e-3), fit("decay 2", rows=10))
    record(begin(path), block(0, 10), *fits)
    with open_datafile(path) as kept:
        check(kept, *fits)
        assert [each.text for each in kept.events] == [f"{one.name}: {one.text}" for one in fits]
        assert not {"fits", "fitted", "fit_values"} & set(kept.tables)
    with h5py.File(path) as file:
        plots = list(file["entry/fitted"].values())
        assert [plot.name.rpartition("/")[2] for plot in plots] == ["decay 1", "decay 2", "decay 2 (3)"]
        for plot, said in zip(plots, fits, strict=True):
            assert (plot.attrs["NX_class"], plot.attrs["signal"], list(plot.attrs["axes"])) == (
                "NXdata",
                "u1",
                ["time"],
            )
            assert list(plot.attrs["auxiliary_signals"]) == ["u1 fitted"]
            for name, series in said.columns.items():
                np.testing.assert_array_equal(plot[name][:], series.values)
                assert plot[name].attrs["units"] == series.unit
            assert list(plot.attrs["parameter_k1"]) == [410.0, 0.3]
    assert verify(path).problems == ()


def test_they_can_be_read_while_the_file_is_written(tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    recorder = begin(path)
    with open_datafile(path) as kept:
        assert kept.fits == []
        recorder(fit("decay 1"))
        recorder.sync()
        kept.refresh()
        check(kept, fit("decay 1"))
        recorder.close("completed")
    assert verify(path).problems == ()


def test_recovery_keeps_them_and_makes_the_plots(tmp_path: Path) -> None:
    path, killed, target = (tmp_path / f"{name}.h5" for name in ("campaign", "killed", "recovered"))
    recorder = begin(path)
    recorder(block(0, 10))
    recorder(fit("decay 1"))
    recorder.sync()
    killed.write_bytes(path.read_bytes())
    recorder.close("completed")
    recover(killed, target)
    with open_datafile(target) as kept, h5py.File(target) as file:
        check(kept, fit("decay 1"))
        np.testing.assert_array_equal(file["entry/fitted/decay 1/u1"][:], fit("decay 1").columns["u1"].values)
    assert verify(target).problems == ()


def test_a_fit_that_cannot_be_kept_is_refused_where_it_is_made() -> None:
    good = fit("decay")
    short = {**good.columns, "u1": Series(np.zeros(3), "m", "too short")}
    with pytest.raises(ValueError, match="shapes"):
        FitFinished("decay", "", short, {}, time=0.0)
    with pytest.raises(ValueError, match="a/b"):
        FitFinished("a/b", "", good.columns, {}, time=0.0)


def test_the_operator_sees_the_findings() -> None:
    notice = notice_of(fit("decay 1"))
    assert notice is not None
    assert (notice.kind, notice.text) == ("fit", "decay 1: decay 1: ω₁ found")
