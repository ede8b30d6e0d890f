"""Meters of the limits, matrix of the points, sentence of the verdict, log with filter and notes."""

from dataclasses import replace
from datetime import datetime
from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pytestqt.qtbot import QtBot

from bench.app.catalogue import load_protocol
from bench.app.display.campaign import Campaign
from bench.app.display.meters import Meter, meters_of
from bench.app.display.samples import amplitude_spectrum
from bench.app.display.theme import LIGHT
from bench.app.display.verdict import verdict_of
from bench.app.gui.controller import Controller
from bench.app.gui.log_panel import LogPanel
from bench.app.gui.motion_plot import MotionPlot, stroboscopic
from bench.app.gui.verdict import LARGEST, VerdictLabel
from bench.app.run_display import Notice
from bench.config.model import BenchConfiguration
from bench.events import PointFinished
from bench.guard.motion import WATCHED, MotionWatch
from bench.live_values import Estimate, TwinEstimate
from bench.preflight.margins import Demand, bounds, margins
from drivers.rig import Channel
from protocols.earthquake.protocol import PROTOCOL as EARTHQUAKE
from protocols.earthquake.protocol import EarthquakeParameters
from protocols.free_rocking.protocol import PROTOCOL as FREE_ROCKING
from protocols.harmonic.protocol import PROTOCOL as HARMONIC
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, PointStatus
from tests.bench.app.ipc.experiment import order
from tests.bench.twin.twin_bench import estimate


def test_every_limit_of_a_motion_has_a_meter_with_the_planned_value() -> None:
    configuration = BenchConfiguration()
    planned = margins([Demand("drift", 0.020, 0.060, "here")], bounds(configuration))
    found = {meter.key: meter for meter in meters_of(configuration, planned)}
    assert found.keys() == {*(WATCHED.keys() - {"laser_range"}), "laser_1", "laser_2"}
    assert found["drift"].limit == configuration.limits.drift
    assert found["drift"].planned == pytest.approx(0.060 / configuration.limits.drift)
    found["drift"].add(1.0, 0.0123)
    assert found["drift"].text == "12.3 / 80 mm"
    assert found["laser_1"].text == "– / 99 %"


def test_a_peak_is_held_and_growth_gives_the_time_to_the_limit() -> None:
    """A magnitude that grows by 2 mm/s from 20 mm reaches 80 mm 30 s after its first second."""
    meter = Meter("drift", "drift", "m", 0.080)
    for k in range(60):
        meter.add(0.1 * k, 0.020 + 0.002 * 0.1 * k)
    assert meter.time_to_limit == pytest.approx((0.080 - 0.0318) / 0.002, rel=0.01)
    for k in range(60, 110):
        meter.add(0.1 * k, 0.030)
    assert meter.time_to_limit == inf
    assert (meter.value, meter.peak) == (0.030, pytest.approx(0.0318))
    assert meter.level == "good"
    meter.add(11.0, 0.079)
    assert meter.level == "wait"
    meter.add(11.1, 0.081)
    assert meter.level == "alarm"


def test_the_guard_tells_what_it_compares_with_the_limits() -> None:
    """Without force and current channels: force and current of the shaker model, at the samples themselves."""
    configuration = BenchConfiguration()
    names = {"table_displacement": "m", "table_acceleration": "m/s2", "laser_1": "m", "laser_2": "m"}
    channels = tuple(Channel(name, "made", unit, 1e-3, 0.0, (-10_000, 10_000), "made") for name, unit in names.items())
    shaker = configuration.shaker_model
    assert shaker is not None
    watch = MotionWatch(channels, 1000.0, configuration.limits, shaker)
    time = np.arange(1000, dtype=np.float64) / 1000.0
    x: NDArray[np.float64] = 0.005 * np.sin(2.0 * np.pi * 2.0 * time)
    a = -((2.0 * np.pi * 2.0) ** 2) * x
    watch.check(0, np.column_stack((x, a, 2.0 * x, 4.0 * x)), np.zeros((1000, 6)))
    told = watch.magnitudes()
    assert told["displacement"] == pytest.approx(0.005)
    assert told["acceleration"] == pytest.approx(np.abs(a).max())
    assert told["force"] == pytest.approx(shaker.mass * np.abs(a).max())
    current = np.abs(shaker.mass * a + shaker.stiffness * x).max() / shaker.force_constant
    assert told["current"] == pytest.approx(current)
    assert told["laser_2"] == pytest.approx(0.02 / 10.0)


def test_the_matrix_has_each_point_with_its_state_and_end() -> None:
    parameters = HarmonicParameters(omega=(14.0, 16.0), beta=(0.25, 0.4))
    campaign = Campaign(HARMONIC, replace(order(Path("never")), parameters=parameters))
    assert (campaign.rows, campaign.columns) == ([0.25, 0.4], [14.0, 16.0])
    assert len(campaign.waiting) == 4
    campaign.follow(Estimate(14.0, None, 3, 0.01, nan, nan, nan, time=1.0))
    assert campaign.current is None, "the bare frame is no point"
    campaign.follow(Estimate(14.0, 0.25, 3, 0.01, nan, nan, nan, time=1.0))
    assert campaign.current == (0, 0)
    now = datetime(2026, 1, 1, 12, 0)
    assert campaign.expected((0, 0), 400.0, now) == datetime(2026, 1, 1, 12, 1, 40)
    assert campaign.expected((1, 1), 400.0, now) == datetime(2026, 1, 1, 12, 6, 40)
    fallen = HarmonicPoint(omega_rad_s=14.0, beta=0.25, status=PointStatus.OVERTURNED, layer="rocking")
    campaign.follow(PointFinished(fallen, time=2.0))
    steady = fallen.model_copy(update={"omega_rad_s": 16.0, "status": PointStatus.STEADY, "alpha_2": 0.1879})
    campaign.follow(PointFinished(steady, time=3.0))
    assert (campaign.cells[0, 0].status, campaign.cells[0, 1].result) == ("overturned", "0.1879")
    assert campaign.expected((0, 0), 400.0, now) is None


def test_points_measured_by_columns_are_expected_in_that_order_and_only_in_real_time() -> None:
    """An earthquake campaign plays all records before it changes the spring."""
    parameters = EarthquakeParameters(records=("synthetic:kobe", "synthetic:pacoima"), beta=(0.25, 0.4))
    now = datetime(2026, 1, 1, 12, 0)
    for realtime in (True, False):
        campaign = Campaign(EARTHQUAKE, replace(order(Path("never"), realtime=realtime), parameters=parameters))
        assert campaign.waiting == [(0, 0), (1, 0), (0, 1), (1, 1)]
        found = campaign.expected((1, 0), 400.0, now)
        assert found == (datetime(2026, 1, 1, 12, 3, 20) if realtime else None)


def test_the_verdict_is_one_sentence() -> None:
    point = HarmonicPoint(
        omega_rad_s=16.0,
        beta=0.4,
        status=PointStatus.STEADY,
        layer="rocking",
        alpha_2=0.18791,
        alpha_2_uncertainty=0.0014,
        alpha_2_predicted=0.1882,
        alpha_2_predicted_uncertainty=0.0021,
        agrees=True,
    )
    said = verdict_of(HARMONIC.view, point)
    assert said == "α₂ 0.1879 ± 0.0014 · predicted 0.1882 ± 0.0021 · ✓ agrees · ω 16 rad/s, β 0.4"


@pytest.mark.parametrize("name", ["harmonic", "earthquake", "free-rocking", "free-vibration", "coupling-stiffness"])
def test_printed_names_belong_to_fields_and_are_no_identifiers(name: str) -> None:
    protocol = load_protocol(name)
    view, fields = protocol.view, protocol.point.model_fields
    assert view.headline in fields
    assert view.labels.keys() <= fields.keys()
    assert not any("_" in label for label in view.labels.values())
    for axis in view.matrix or ():
        assert axis.parameter in protocol.parameters.model_fields
        assert axis.field in fields


def test_a_ratio_of_restitutions_has_a_name_instead_of_its_formula() -> None:
    assert FREE_ROCKING.view.labels["ratio"] == "restitution factor rₑₓₚ/rₜₕ"


def test_the_verdict_is_48_px_high_where_it_fits(qtbot: QtBot) -> None:
    label = VerdictLabel()
    qtbot.addWidget(label)
    label.resize(618, 100)
    label.allow(575)
    label.show_sentence("α₂ 0.1879 ± 0.0014 · predicted 0.188 ± 0.062 · ✓ agrees · ω 16 rad/s, β 0.4")
    assert label.pixels == LARGEST == 48
    label.allow(200)
    assert label.pixels < LARGEST


def test_a_log_shows_the_lines_with_a_text(qtbot: QtBot) -> None:
    controller = Controller()
    panel = LogPanel(controller)
    qtbot.addWidget(panel)
    for text in ("mount the spring", "sweep at 16 rad/s", "the spring is mounted"):
        controller.noticed.emit(Notice(1.0, "step", text))
    panel.filter.setText("SPRING")
    assert len(panel.text.toPlainText().splitlines()) == 2
    controller.noticed.emit(Notice(2.0, "step", "ramp out"))
    assert "ramp" not in panel.text.toPlainText()
    panel.filter.clear()
    assert len(panel.text.toPlainText().splitlines()) == 4
    assert not panel.note.isEnabled(), "no run has a file for a note"
    controller.close()


def test_a_spectrum_has_the_amplitude_of_a_sine_and_a_section_one_point_of_it() -> None:
    time = np.arange(10_000, dtype=np.float64) * 0.002
    omega = 2.0 * np.pi * 2.5
    drift: NDArray[np.float64] = 3.0 * np.sin(omega * time + 0.3)
    frequency, lines = amplitude_spectrum(time, drift)
    assert frequency[lines.argmax()] == pytest.approx(2.5, abs=0.05)
    assert lines.max() == pytest.approx(3.0, rel=0.01)
    section = stroboscopic(time, np.column_stack((drift, time)), omega)
    assert section[:, 0] == pytest.approx(np.full(len(section), 3.0 * np.sin(0.3)), abs=1e-3)


def test_the_phase_plane_forgets_the_model_of_the_previous_arming(qtbot: QtBot) -> None:
    plot = MotionPlot(LIGHT, "phase")
    qtbot.addWidget(plot)

    def part(run: int, begin: float) -> TwinEstimate:
        trace = np.zeros((100, 6))
        trace[:, 0] = begin + 0.01 * np.arange(100)
        return estimate(run=run, trace=trace)

    for begin in (97.0, 98.0, 99.0):
        plot.add(part(1, begin))
    plot.add(part(2, 0.0))
    assert plot._model[:, 0].max() < 1.0
    assert len(plot._model) == 100
