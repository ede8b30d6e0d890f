"""Points fill up on the predicted lines: against frequency for sines, against stiffness for records."""

from typing import Any

import numpy as np
import pyqtgraph as pg
import pytest
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.display.gains import lines_of, mark_of
from bench.app.display.theme import DARK, LIGHT
from bench.app.gui.gain_plot import GainPlot
from bench.datafile.tables import Column, Table
from bench.live_values import Estimate, RunningGain
from protocols.earthquake.protocol import EarthquakePoint
from protocols.earthquake.protocol import PointStatus as Ended
from protocols.harmonic.protocol import HarmonicPoint, PointStatus

RECORDS: Table = {
    "record": Column(np.array(["Kobe", "Kobe", "Kobe", "El Centro", "El Centro"]), "", ""),
    "beta": Column(np.array([0.6, 0.2, 0.4, 0.4, 0.2]), "1", ""),
    "alpha_2": Column(np.array([np.nan, 0.8, 0.7, 0.9, 1.1]), "1", ""),
}
SPECTRA: Table = {
    "omega": Column(np.array([16.0, 15.0, 17.0, 15.0, 16.0]), "rad/s", ""),
    "beta": Column(np.array([0.4, 0.4, 0.4, 0.4, 0.4]), "1", ""),
    "alpha_2": Column(np.array([0.2, 0.3, 0.4, 2.0, 2.5]), "1", ""),
    "layer": Column(np.array(["rocking"] * 3 + ["resting"] * 2), "", ""),
}


@pytest.fixture
def plot(qtbot: QtBot) -> GainPlot:
    shown = GainPlot(LIGHT)
    qtbot.addWidget(shown)
    shown.resize(500, 300)
    shown.show()
    return shown


def _drawn(plot: GainPlot, symbol: str) -> list[tuple[float, float]]:
    """Where the points with `symbol` stand."""
    items = [item for item in plot.getPlotItem().items if isinstance(item, pg.ScatterPlotItem)]
    spots = [spot for item in items if item is not plot._now for spot in item.points()]
    return [(spot.pos().x(), spot.pos().y()) for spot in spots if spot.symbol() == symbol]


def _spreads(plot: GainPlot) -> list[tuple[float, float, float]]:
    """Place, lower and upper end of every bar of uncertainty."""
    curves = [item for item in plot.getPlotItem().items if isinstance(item, pg.PlotCurveItem)]
    (bars,) = [item for item in curves if item.opts["connect"] == "pairs"]
    x, y = (each if each is not None else np.zeros(0) for each in bars.getData())
    assert x[0::2].tolist() == x[1::2].tolist()
    return list(zip(x[0::2], y[0::2], y[1::2], strict=True))


def _earthquake(beta: float, alpha_2: float | None, record: str = "Kobe") -> dict[str, Any]:
    status = Ended.OVERTURNED if alpha_2 is None else Ended.MEASURED
    spread = None if alpha_2 is None else 0.05
    point = EarthquakePoint(
        record=record, beta=beta, status=status, alpha_2=alpha_2, alpha_2_uncertainty=spread, pga_target_m_s2=2.0
    )
    return point.model_dump()


def test_lines_are_ascending_and_one_for_each_record_or_branch() -> None:
    kobe, centro = lines_of(RECORDS)
    assert (kobe.group, kobe.x.tolist(), centro.gain.tolist()) == ("Kobe", [0.2, 0.4, 0.6], [1.1, 0.9])
    assert np.isnan(kobe.gain[2])
    rocking, resting = lines_of(SPECTRA)
    assert (rocking.x.tolist(), rocking.gain.tolist(), rocking.strong) == ([15.0, 16.0, 17.0], [0.3, 0.2, 0.4], True)
    assert (resting.name, resting.strong) == ("predicted, β = 0.4, resting", False)
    assert lines_of({"value": RECORDS["beta"]}) == []
    assert mark_of({"beta": 0.4}) is None


def test_points_of_records_stand_over_the_stiffness(plot: GainPlot) -> None:
    plot.predict(RECORDS)
    assert texts.BETA_AXIS in plot.getPlotItem().getAxis("bottom").labelText
    plot.show_running(RunningGain("Kobe", 0.4, 3.0, 0.01, 0.75, 0.7, time=1.0))
    assert plot._now.getData()[0].tolist() == [0.4]
    assert plot._now.getData()[1].tolist() == [0.75]
    plot.add(_earthquake(0.4, 0.72))
    plot.add(_earthquake(0.6, None))
    assert plot.measured == [(0.4, 0.72)]
    assert _drawn(plot, "o") == [(0.4, 0.72)]
    assert _spreads(plot) == [(0.4, pytest.approx(0.67), pytest.approx(0.77))]
    assert _drawn(plot, "x") == [(0.6, 1.1)], "a block that fell is a result: a cross at the upper edge"
    assert not len(plot._now.getData()[0])


def test_points_without_a_prediction_find_their_axes(plot: GainPlot) -> None:
    plot.predict({})
    plot.add(_earthquake(0.4, 0.72))
    assert texts.BETA_AXIS in plot.getPlotItem().getAxis("bottom").labelText
    plot.predict({})
    assert texts.OMEGA_AXIS in plot.getPlotItem().getAxis("bottom").labelText


def test_the_gain_of_a_spectrum_is_logarithmic_and_bands_are_drawn_where_they_are_known(plot: GainPlot) -> None:
    low = np.array([0.19, 0.28, np.nan, 1.8, 2.2])
    banded = {**SPECTRA, "alpha_2_low": Column(low, "1", ""), "alpha_2_high": Column(low * 1.2, "1", "")}
    plot.predict(SPECTRA)
    assert plot.bands == 0
    plot.predict(banded)
    assert plot.bands == 2
    fills = [item for item in plot.getPlotItem().items if isinstance(item, pg.FillBetweenItem)]
    box = fills[0].boundingRect()
    assert (box.left(), box.right()) == pytest.approx((15.0, 16.0)), "the band ends where it is not known"
    assert (box.top(), box.bottom()) == pytest.approx((np.log10(0.19), np.log10(1.2 * 0.28)))
    plot.show_running(Estimate(16.0, 0.4, 12, 0.01, 0.1, 0.004, 0.2, time=1.0))
    assert plot._now.getData()[1].tolist() == pytest.approx([-1.0])
    point = HarmonicPoint(
        omega_rad_s=16.0, beta=0.4, status=PointStatus.STEADY, layer="rocking", alpha_2=0.21, alpha_2_uncertainty=0.01
    )
    plot.add(point.model_dump())
    assert plot.measured == [(16.0, 0.21)]
    assert _drawn(plot, "o") == [(16.0, pytest.approx(np.log10(0.21)))]
    assert _spreads(plot) == [(16.0, pytest.approx(np.log10(0.20)), pytest.approx(np.log10(0.22)))]
    plot.grab()


def test_the_plot_has_no_more_items_for_more_points(plot: GainPlot) -> None:
    """What is redrawn at every estimate must not grow: each item costs half a millisecond."""
    plot.predict(SPECTRA)
    count = len(plot.getPlotItem().items)
    points = [
        HarmonicPoint(
            omega_rad_s=15.0 + 0.01 * k,
            beta=0.4,
            status=PointStatus.STEADY,
            layer="rocking",
            alpha_2=0.2,
            alpha_2_uncertainty=0.01,
        ).model_dump()
        for k in range(200)
    ]
    plot.add(points[0])
    plot.add_all(points[1:], 1)
    assert len(plot.getPlotItem().items) == count
    assert (len(_drawn(plot, "o")), len(_drawn(plot, "s")), len(_spreads(plot))) == (1, 199, 200)
    plot.use_theme(DARK)
    assert len(plot.getPlotItem().items) == count
    assert (len(_drawn(plot, "o")), len(_drawn(plot, "s")), len(_spreads(plot))) == (1, 199, 200)
    plot.predict(SPECTRA)
    assert (plot.measured, _drawn(plot, "s"), _spreads(plot)) == ([], [], [])


def _legend(plot: GainPlot) -> list[str]:
    return [text.text for _, text in plot._legend.items]


def _harmonic(omega: float, status: PointStatus = PointStatus.STEADY) -> dict[str, Any]:
    point = HarmonicPoint(
        omega_rad_s=omega, beta=0.4, status=status, layer="rocking", alpha_2=0.2, alpha_2_uncertainty=0.01
    )
    return point.model_dump()


def test_frequencies_and_stiffness_ratios_do_not_share_an_axis(plot: GainPlot) -> None:
    plot.predict(RECORDS)
    plot.add_all([_earthquake(0.4, 0.72)], 0, "monday")
    plot.add_all([_harmonic(16.0)], 1, "tuesday")
    assert plot.measured == [(0.4, 0.72)]
    assert plot.getPlotItem().viewRange()[0][1] < 1.0
    assert any("tuesday" in line and "not drawn" in line for line in _legend(plot))
    plot.predict(SPECTRA)
    plot.add_all([_harmonic(16.0)], 0, "tuesday")
    plot.add_all([_earthquake(0.4, 0.72)], 1, "monday")
    assert plot.measured == [(16.0, 0.2)]
    plot.predict({})
    plot.add_all([_earthquake(0.4, 0.72)], 0, "monday")
    plot.add_all([_harmonic(16.0)], 1, "tuesday")
    assert plot.measured == [(0.4, 0.72)]


def test_the_legend_loses_curves_that_are_gone(plot: GainPlot) -> None:
    plot.predict(SPECTRA)
    plot.add_all([_harmonic(16.0)], 0, "monday")
    plot.add_all([_harmonic(16.0, PointStatus.MODULATED)], 1, "tuesday")
    assert len(_legend(plot)) == 5
    plot.predict(RECORDS)
    assert _legend(plot) == ["predicted, Kobe", "predicted, El Centro"]
    plot.predict({})
    assert _legend(plot) == []


def test_modulated_points_look_different(plot: GainPlot) -> None:
    plot.predict(SPECTRA)
    plot.add(_harmonic(15.0))
    plot.add(_harmonic(16.0, PointStatus.MODULATED))
    items = [item for item in plot.getPlotItem().items if isinstance(item, pg.ScatterPlotItem)]
    steady, modulated = [spot for item in items if item is not plot._now for spot in item.points()]
    assert steady.brush().color() != modulated.brush().color()
    assert modulated.brush().color().name() == LIGHT.raised
    assert any("modulated" in line for line in _legend(plot))


def test_a_combination_that_was_not_played_is_no_fallen_block(plot: GainPlot) -> None:
    plot.predict(RECORDS)
    left_out = EarthquakePoint(record="Kobe", beta=0.6, status=Ended.NOT_PLAYED, pga_target_m_s2=2.0)
    plot.add(left_out.model_dump())
    assert _drawn(plot, "x") == []
