"""What a report shows of fitted models and of results that are no gains."""

from pathlib import Path

import numpy as np

from bench.app.reports.report import fits_section, points_section
from bench.datafile.reader import open_datafile
from bench.datafile.recorder import Recorder
from bench.document.campaign import Campaign
from bench.document.document import Picture, Table
from bench.events import PointFinished
from bench.figures.fit_figure import fit_figure
from bench.findings import FitFinished, FittedParameter, Series
from bench.testing.loopback import LoopbackRig
from sim.parameters import Parameters, quantity


class Found(Parameters):
    frequency_hz: float = quantity(..., "Hz", "middle of the band")
    noise: float = quantity(..., "m/s2/Hz^0.5", "spectral density (one-sided)")
    remark: str = quantity("", "", "what was noticed")


class Scaled(Parameters):
    """A result whose digits matter."""

    sensor: str = quantity(..., "", "name")
    scale: float = quantity(..., "1", "span")
    scale_uncertainty: float | None = quantity(None, "1", "expanded uncertainty")


def test_a_result_is_shown_to_the_decimal_place_of_its_uncertainty(tmp_path: Path) -> None:
    recorder = Recorder(
        tmp_path / "run.h5",
        channels=LoopbackRig().channels,
        sample_rate=1000.0,
        point_type=Scaled,
        metadata={"protocol": "made"},
    )
    recorder(PointFinished(Scaled(sensor="one", scale=1.000341, scale_uncertainty=5.1e-5), time=1.0))
    recorder(PointFinished(Scaled(sensor="two", scale=-1.000341), time=2.0))
    recorder.close("completed")
    with open_datafile(tmp_path / "run.h5") as record:
        points = points_section(Campaign(tmp_path / "run.h5", record))
    assert points is not None
    results = points.parts[0]
    assert isinstance(results, Table)
    assert [row[1] for row in results.rows] == ["1.000341", "−1"]


def test_fits_and_points_are_shown_with_their_units(tmp_path: Path) -> None:
    rig, time = LoopbackRig(), np.linspace(0.0, 5.0, 200)
    columns = {
        "time": Series(time, "s", "after the release"),
        "acceleration": Series(np.cos(6.0 * time), "m/s2", "measured"),
        "fitted": Series(np.cos(6.01 * time), "m/s2", "model"),
        "residual": Series(np.cos(6.0 * time) - np.cos(6.01 * time), "m/s2", "measured minus model"),
    }
    found = {"omega_1": FittedParameter(6.01, 0.0123, "rad/s"), "k": FittedParameter(213.0, 1.5, "N/m")}
    recorder = Recorder(
        tmp_path / "run.h5", channels=rig.channels, sample_rate=1000.0, point_type=Found, metadata={"protocol": "made"}
    )
    recorder(FitFinished("decay", "the decay fits", columns, found, time=1.0))
    recorder(PointFinished(Found(frequency_hz=8.0, noise=1e-7, remark="beta = 0.4"), time=2.0))
    recorder.close("completed")
    with open_datafile(tmp_path / "run.h5") as record:
        campaign = Campaign(tmp_path / "run.h5", record)
        fits, points = fits_section(campaign), points_section(campaign)
    assert fits is not None
    assert points is not None
    (table,) = [part for part in fits.parts if isinstance(part, Table)]
    assert table.rows == [["ω 1", "6.010 ± 0.025", "rad/s"], ["k", "213.0 ± 3.0", "N/m"]]
    (picture,) = [part for part in fits.parts if isinstance(part, Picture)]
    labels = [panel.get_ylabel() for panel in picture.figure.axes]
    assert labels == ["acceleration, fitted  [m/s²]", "residual  [m/s²]"]
    assert picture.figure.axes[-1].get_xlabel() == "time  [s]"
    results = points.parts[0]
    assert isinstance(results, Table)
    assert [column.heading for column in results.columns] == ["frequency [Hz]", "noise [m/s²/√Hz]", "remark"]
    assert results.rows == [["8", "1·10⁻⁷", "β = 0.4"]]


def test_columns_of_other_scales_have_panels_of_their_own_and_uncertainties_are_bars() -> None:
    time, speed = np.linspace(3.0, 11.0, 30), np.linspace(0.8, 0.3, 30)
    columns = {
        "time": Series(time, "s", "instant"),
        "restitution": Series(0.977 + 1e-3 * np.sin(time), "1", "of this impact"),
        "restitution_uncertainty": Series(np.full(30, 5e-4), "1", "its standard uncertainty"),
        "speed": Series(speed, "1", "before the impact"),
        "residual": Series(1e-5 * np.cos(time), "m", "measured less fitted"),
        "angle": Series(0.05 * np.cos(time), "rad", "largest"),
    }
    panels = fit_figure(FitFinished("impacts", "", columns, {}, time=0.0)).axes
    assert [panel.get_ylabel() for panel in panels] == ["restitution", "speed", "residual  [µm]", "angle  [mrad]"]
    low, high = panels[0].get_ylim()
    assert high - low < 0.01
    (bars,) = panels[0].containers
    ends = bars.lines[2][0].get_segments()  # type: ignore[attr-defined]
    np.testing.assert_allclose(ends[0][1][1] - ends[0][0][1], 4.0 * 5e-4, rtol=1e-9)
    np.testing.assert_allclose(panels[2].lines[0].get_ydata(), 10.0 * np.cos(time))
