"""What is drawn is what was measured: extremes of every pixel, points on their lines, questions inline."""

from collections.abc import Generator
from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.display.buffers import Ring
from bench.app.display.theme import LIGHT
from bench.app.gui.run_page import GAINS_HEIGHT, RunPage
from bench.app.gui.traces import AHEAD, LEAST
from bench.app.gui.window import SMALLEST, Window
from bench.app.ipc.messages import TRACES, Beat, Ended, PlanChecked, Published, Traces
from bench.datafile.tables import Column
from bench.events import PointFinished, SpecimenMounted, State, StateChanged, StepStarted, Warned
from bench.findings import FitFinished, FittedParameter, Series
from bench.live_values import Estimate, LiveValue
from drivers.clock import now
from drivers.rig import OperatorTask
from protocols.earthquake.protocol import EarthquakePoint
from protocols.earthquake.protocol import PointStatus as PointOutcome
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint, PointStatus
from protocols.stability.protocol import OrbitStatus, StabilityPoint
from sim.specimen import Specimen
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.gui.shared_window import page_alone
from tests.bench.app.ipc.experiment import order
from tests.bench.twin.twin_bench import estimate
from tests.patience import LONG, LONG_MS

STEP = 0.002
EVENTS = 1500
"""Of a flood."""


def _block(begin: float, values: np.ndarray, step: float = STEP) -> Traces:
    return Traces(1, begin, step, (values - 0.5).astype(np.float32), (values + 0.5).astype(np.float32), 0.0)


@settings(max_examples=60, deadline=None)
@given(
    sizes=st.lists(st.integers(1, 90), min_size=1, max_size=40),
    buckets=st.integers(1, 60),
    seconds=st.floats(0.01, 0.5),
    seed=st.integers(0, 2**31),
)
def test_a_ring_keeps_the_extremes_of_the_window(sizes: list[int], buckets: int, seconds: float, seed: int) -> None:
    """Against all that was ever added, in one array."""
    rng = np.random.default_rng(seed)
    ring, every, begin = Ring(1, capacity=200), np.zeros((0, 1)), 0.0
    for size in sizes:
        values = rng.normal(size=(size, 1))
        ring.add(_block(begin, values))
        every = np.concatenate([every, values])
        begin += size * STEP
    assert len(ring) == min(len(every), 200)
    assert ring.newest == pytest.approx(begin)
    time, drawn = ring.window(seconds, buckets)
    ends = (STEP * (np.arange(len(every)) + 1.0) - begin)[-len(ring) :]
    inside = every[-len(ring) :][ends >= -seconds + 1e-9]
    # the part in which the window begins is drawn whole
    around = every[-len(ring) :][ends >= -seconds * (1.0 + 1.0 / buckets) - 1e-9]
    assert inside.max() - 1e-6 <= drawn.max() - 0.5 <= around.max() + 1e-6
    assert around.min() - 1e-6 <= drawn.min() + 0.5 <= inside.min() + 1e-6
    assert len(time) == len(drawn) <= 2 * (buckets + 1)
    assert (np.diff(time) >= 0).all()


@settings(max_examples=40, deadline=None)
@given(sizes=st.lists(st.integers(1, 90), min_size=4, max_size=40), seed=st.integers(0, 2**31))
def test_a_line_that_scrolls_does_not_flicker(sizes: list[int], seed: int) -> None:
    """Whatever comes in, a point that was drawn stays as it was: all but the last part, which still fills up."""
    rng = np.random.default_rng(seed)
    ring, begin, seen = Ring(1, capacity=10_000), 0.0, dict[float, tuple[float, float]]()
    for size in sizes:
        ring.add(_block(begin, rng.normal(size=(size, 1))))
        begin += size * STEP
        time, drawn = ring.window(0.3, 20)
        places = np.round((time + ring.newest) / STEP)
        now = {float(places[k]): (float(drawn[k, 0]), float(drawn[k + 1, 0])) for k in range(0, len(time) - 2, 2)}
        assert {at: seen[at] for at in now if at in seen} == {at: now[at] for at in now if at in seen}
        # nor does another point appear between those that were drawn
        assert all(at in seen for at in now if seen and at < max(seen) and at >= min(seen))
        seen = now


def test_a_window_that_begins_on_a_boundary_has_no_part_more() -> None:
    # 5.5 s - 0.7 s and its quotient with the length of a part round to different sides
    ring = Ring(1)
    ring.add(_block(3.9000000000000004, np.zeros((32, 1)), step=0.05))
    time, drawn = ring.window(0.7, 7)
    assert len(time) == len(drawn) == 2 * (7 + 1)


def test_a_gap_breaks_the_line() -> None:
    ring = Ring(1)
    ring.add(_block(0.0, np.zeros((5, 1))))
    ring.add(_block(5 * STEP, np.zeros((5, 1))))
    assert len(ring) == 10
    ring.add(_block(1.0, np.zeros((5, 1))))
    _, drawn = ring.window(10.0, 100)
    assert np.isnan(drawn).any()


@pytest.fixture(scope="module")
def page(qapp: QApplication) -> Generator[RunPage]:  # noqa: ARG001 - Qt needs its application
    """One page for all runs: nothing of a run may remain in the next one."""
    with page_alone(RunPage, 600) as shown:
        shown.show()
        yield shown


PREDICTION = {
    "omega": Column(np.array([15.0, 16.0, 17.0]), "rad/s", ""),
    "beta": Column(np.full(3, 0.4), "1", ""),
    "alpha_2": Column(np.array([0.3, 0.2, 0.4]), "1", ""),
    "layer": Column(np.array(["rocking"] * 3), "", ""),
}


@pytest.fixture
def link(page: RunPage, spoken: type[ScriptedClient]) -> Generator[ScriptedClient]:
    """The link of a run that has begun."""
    page.predict(PREDICTION)
    page._controller.start(order(Path("never")))
    yield spoken.latest
    page._controller._take(Ended("completed", "", {}, "", Path("never")))


@pytest.fixture
def driven(window: Window, spoken: type[ScriptedClient]) -> ScriptedClient:
    """The link of a run that has begun in the window."""
    window.run.predict(PREDICTION)
    window._controller.start(order(Path("never")))
    return spoken.latest


def test_curves_hold_what_was_measured_in_the_unit_of_their_axis(page: RunPage, link: ScriptedClient) -> None:
    values = np.zeros((50, len(TRACES)))
    values[25, TRACES.index("drift")] = 0.004
    values[30, TRACES.index("acceleration")] = -1.25
    link.said = [Traces(1, 0.0, STEP, values.astype(np.float32), values.astype(np.float32), 0.0)]
    page._controller._look()
    page.traces.draw()
    curves = [curve.getData()[1] for curve in page.traces.curves]
    assert curves[4].max() == pytest.approx(4.0)  # mm
    assert curves[1].min() == pytest.approx(-1.25)
    low, high = page.traces.plots[4].viewRange()[1]
    assert low <= -4.0
    assert high >= 4.0


def test_the_axis_runs_on_between_blocks_and_stands_when_nothing_comes(
    page: RunPage, link: ScriptedClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Block of 0.1 s read at 50 s of the clock: the newest sample is as far from the right edge as it is old."""
    clock = 50.0
    monkeypatch.setattr("bench.app.gui.traces.now", lambda: clock)
    still = np.zeros((50, len(TRACES)), np.float32)
    still[:, TRACES.index("u1")] = np.arange(50)
    link.said = [Traces(1, 3.0, STEP, still, still, 50.0), Beat(State.RUNNING, "", 3.1, 0, 0)]
    page._controller._look()
    traces = page.traces
    for clock, place in ((50.0, 0.0), (50.03, -0.03), (50.09, -0.09), (58.0, -AHEAD)):
        traces.draw()
        assert [curve.pos().x() for curve in traces.curves] == pytest.approx([place] * 5)
        # one moment is shown a block behind, and so moves evenly through it
        moment = min(3.0 + clock - 50.0, 3.1)
        assert traces.moment == pytest.approx(moment)
        assert traces.ring.at(traces.moment)[TRACES.index("u1")] == pytest.approx((moment - 3.0) / STEP, abs=1.1)
    page._refresh()
    assert page.lost.text() == "newest sample 8.0 s old"
    assert "not live for 8 s" in traces.plots[-1].getAxis("bottom").labelText
    page._draw()
    assert "not live for 8 s" in page.picture.source.text()
    assert {curve.opts["pen"].color().name() for curve in traces.curves} == {LIGHT.faint}
    link.said = [Beat(State.WAITING, "a question", 3.1, 0, 0)]
    page._controller._look()
    assert "not live" in page.lost.text()
    assert "0:08" in page.lost.text()
    clock = 58.5
    link.said = [Traces(1, 11.0, STEP, still, still, 58.5)]
    page._controller._look()
    traces.draw()
    assert traces.plots[-1].getAxis("bottom").labelText == texts.SECONDS
    assert LIGHT.faint not in {curve.opts["pen"].color().name() for curve in traces.curves}


def test_a_block_is_drawn_as_soon_as_it_is_mounted(page: RunPage, link: ScriptedClient) -> None:
    """And traces are labelled for what laser 2 measures."""
    specimen, titles = Specimen(), lambda: " ".join(plot.titleLabel.text for plot in page.traces.plots)
    link.said = [Published(SpecimenMounted(specimen.coupled(0.4), OperatorTask.MOUNT_SPRING, time=1.0))]
    page._controller._look()
    assert page.picture.canvas.arrangement.spring
    assert "storey 2, u2" in titles()
    link.said = [Published(SpecimenMounted(specimen, OperatorTask.WATCH_BLOCK, 0.3, time=2.0))]
    page._controller._look()
    shown = page.picture.canvas.arrangement
    assert (shown.block, shown.spring, shown.face) == (True, False, 0.3)
    assert "laser 2, block 300 mm above the table" in titles()
    assert "storey 2" not in titles()


def test_the_running_gain_and_the_finished_point(page: RunPage, link: ScriptedClient) -> None:
    point = HarmonicPoint(
        omega_rad_s=16.0, beta=0.4, status=PointStatus.STEADY, layer="rocking", alpha_2=0.21, alpha_2_uncertainty=0.01
    )
    link.said = [Published(Estimate(16.0, 0.4, 12, 0.01, 0.24, 0.0041, 0.2, time=1.0))]
    page._controller._look()
    assert "0.2400 ± 0.0041" in page.verdict.sentence
    assert "+20.0 %" in page.verdict.sentence
    link.said = [Published(PointFinished(point, time=2.0)), Published(Warned("drift comes near", time=3.0))]
    page._controller._look()
    assert page.gains.measured == [(16.0, 0.21)]
    assert page.picture.canvas.arrangement.spring
    assert "▲ warning: drift comes near" in page.log.toPlainText()


@pytest.mark.parametrize(
    "end", [Published(StepStarted("start 2", time=2.0)), Ended("aborted", "", {}, "", Path("never"))]
)
def test_a_running_gain_ends_with_its_motion(page: RunPage, link: ScriptedClient, end: Published | Ended) -> None:
    """The motion after which a block has fallen, for instance."""
    nothing = page.verdict.sentence
    running = Estimate(16.0, 0.4, 12, 0.01, 0.24, 0.0041, 0.2, time=1.0)
    link.said = [Published(running)]
    page._controller._look()
    page.gains.show_running(running)
    assert "0.2400" in page.verdict.sentence
    assert len(page.gains._now.getData()[0]) == 1
    link.said = [end]
    page._controller._look()
    assert (page.verdict.sentence, page.point.text()) == (nothing, "")
    assert len(page.gains._now.getData()[0]) == 0


def test_a_point_without_a_gain_is_no_longer_said_to_be_measured(page: RunPage, link: ScriptedClient) -> None:
    link.said = [Published(Estimate(16.0, 0.64, 12, 0.01, nan, nan, nan, time=1.0))]
    page._controller._look()
    assert "measuring" in page.point.text()
    held = StabilityPoint(omega_rad_s=16.0, amplitude_factor=1.01, beta=0.64, status=OrbitStatus.NOT_HELD)
    link.said = [Published(PointFinished(held, time=2.0))]
    page._controller._look()
    assert page.point.text() == ""


def test_the_large_gain_names_its_point_and_its_uncertainty_is_that_of_the_file(
    page: RunPage, link: ScriptedClient
) -> None:
    run = page
    link.said = [Published(Estimate(16.0, 0.4, 12, 0.01, 0.24, 0.0041, 0.2, time=1.0))]
    page._controller._look()
    assert "ω = 16 rad/s, β = 0.4" in run.point.text()
    assert "measuring" in run.point.text()
    point = HarmonicPoint(
        omega_rad_s=16.0, beta=0.4, status=PointStatus.STEADY, layer="rocking", alpha_2=0.239, alpha_2_uncertainty=0.011
    )
    link.said = [Published(PointFinished(point, time=2.0))]
    page._controller._look()
    assert "last point, steady: ω = 16 rad/s, β = 0.4" in run.point.text()
    assert run.verdict.sentence.startswith("α₂ 0.239 ± 0.011 · ")

    link.said = [Published(Estimate(17.0, None, 1, 0.01, nan, nan, nan, time=3.0))]
    page._controller._look()
    assert "ω = 17 rad/s, bare frame" in run.point.text()
    assert "0.239" not in run.verdict.sentence
    fallen = point.model_copy(update={"alpha_2": None, "status": PointStatus.OVERTURNED})
    link.said = [Published(PointFinished(fallen, time=4.0))]
    page._controller._look()
    assert "overturned" in run.verdict.sentence


def test_a_protocol_without_a_gain_shows_its_fits_instead_of_an_empty_gain_plot(
    page: RunPage, link: ScriptedClient
) -> None:
    run = page
    link.said = [Ended("completed", "the plan was carried out", {}, "", Path("never"))]
    page._controller._look()
    page._controller.start(replace(order(Path("never")), protocol="free-vibration"))
    assert run.gains.isHidden()
    assert [plot.figure.curves for plot in run.live.shown] == [(), ()]
    assert "gain" not in run.verdict.sentence
    time = np.linspace(0.0, 1.0, 100)
    columns = {
        "time": Series(time, "s", ""),
        "laser_1": Series(1e-3 * np.cos(time), "m", ""),
        "laser_1_fitted": Series(1e-3 * np.cos(time), "m", ""),
        "laser_1_residual": Series(0.0 * time, "m", ""),
        "drive": Series(time, "V", ""),
    }
    fit = FitFinished("pluck 1", "k1 = 1 +- 0.1", columns, {"k1": FittedParameter(1234.5, 1.5, "N/m")})
    ScriptedClient.latest.said = [Published(fit)]
    page._controller._look()
    run._draw()
    decay, _ = run.live.shown
    assert [curve.name for curve in decay.figure.curves] == ["laser 1", "laser 1 fitted"]
    curve = decay.plot.getPlotItem().listDataItems()[0]
    assert curve.getData()[1].max() == pytest.approx(1.0), "in mm"
    assert "(1234.5 ± 3.0) N/m" in run.verdict.sentence
    assert "±" in run.point.text()
    page._controller._take(Ended("completed", "", {}, "", Path("never")))
    page._controller.start(replace(order(Path("never")), protocol="harmonic", parameters=HarmonicParameters()))
    assert not run.gains.isHidden()
    assert run.live.shown == []


def test_combinations_that_were_left_out_are_in_the_log_with_the_reason(page: RunPage, link: ScriptedClient) -> None:
    why = "Kobe, beta = 0.97 is left out, since it would exceed a limit: limits.drift"
    left_out = EarthquakePoint(
        record="Kobe", beta=0.97, status=PointOutcome.NOT_PLAYED, pga_target_m_s2=2.0, reason="limits.drift exceeded"
    )
    link.said = [Published(Warned(why, time=0.0)), Published(PointFinished(left_out, time=1.0))]
    page._controller._look()
    log = page.log.toPlainText()
    assert "β = 0.97 is left out" in log
    assert "Kobe, β 0.97: not played" in log
    assert log.count("limits.drift") == 2
    assert "no gain: not played" in page.verdict.sentence
    assert "Kobe, β = 0.97" in page.point.text()


def test_an_axis_that_is_twice_too_wide_is_narrowed(page: RunPage, link: ScriptedClient) -> None:
    traces = page.traces
    for largest, reach in ((0.010, 11.5), (0.006, 11.5), (0.005, 5.75), (0.020, 23.0)):
        traces.clear()
        values = np.zeros((50, len(TRACES)), np.float32)
        values[0, TRACES.index("u1")] = largest
        link.said = [Traces(1, 0.0, STEP, values, values, 0.0)]
        before = 11.5 if largest < 0.010 else LEAST
        traces._reach[2] = before
        page._controller._look()
        traces.draw()
        assert traces._reach[2] == pytest.approx(reach, rel=1e-5)
    size = page.size()
    page.resize(*SMALLEST)
    assert page.gains.height() >= GAINS_HEIGHT
    page.resize(size)


def test_the_model_beside_the_test_is_told_while_the_bench_is_driven(page: RunPage, link: ScriptedClient) -> None:
    assert page.twin.text().endswith(": -")
    link.said = [Published(estimate(drift_peak=0.01819, drift_peak_measured=0.01822, residual=0.003))]
    page._controller._look()
    assert "drift peak 18.22 mm, model 18.19 mm; residual 0.3 %" in page.twin.text()
    link.said = [Published(StateChanged(State.STOPPING, State.IDLE, "the output is at zero", time=1.0))]
    page._controller._look()
    page._refresh()
    assert page.twin.text().endswith(": -")
    link.said = [
        Published(estimate(drift_peak=0.01819, drift_peak_measured=0.01822, residual=0.003)),
        Ended("aborted", "abort requested", {}, "", Path("never")),
    ]
    page._controller._look()
    page._refresh()
    assert page.twin.text().endswith(": -"), "a run that is over has no live model"


def test_a_note_that_no_file_would_store_stays_in_its_field(page: RunPage, link: ScriptedClient) -> None:
    note = page.panel.note
    link.said = [Published(StateChanged(State.IDLE, State.ARMED, "armed", time=1.0))]
    page._controller._look()
    assert note.isEnabled()
    link.said = [Published(StateChanged(State.STOPPING, State.CLOSED, "the rig is closed", time=2.0))]
    page._controller._look()
    note.setText("a bolt was loose")
    note.returnPressed.emit()
    assert not note.isEnabled()
    assert note.text() == "a bolt was loose"
    assert link.asked == []
    note.clear()


def test_ramping_out_is_a_request_of_its_own(page: RunPage, link: ScriptedClient, qtbot: QtBot) -> None:
    link.said = [Beat(State.RUNNING, "", 1.0, 0, 0)]
    page._controller._look()
    qtbot.mouseClick(page.ramp_out, Qt.MouseButton.LeftButton)
    assert link.asked == ["stop"]
    assert not page._controller.latched


def test_a_live_value_is_shown_with_its_unit_and_prediction(page: RunPage, link: ScriptedClient) -> None:
    link.said = [Published(LiveValue("period", 0.6412, "s", 0.0031, 0.6389, time=3.0))]
    page._controller._look()
    assert page.verdict.sentence == "period  (0.6412 ± 0.0031) s · predicted 0.6389 · +0.4 %"
    link.said = [Published(LiveValue("cycles", 12.0, "1", time=4.0))]
    page._controller._look()
    assert page.verdict.sentence == "cycles  12.00"


def test_a_flood_of_events_leaves_the_main_loop_free(
    window: Window, driven: ScriptedClient, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
) -> None:
    """1500 events of 1 ms each: no turn handles more than its budget, none is lost, no hidden form validates itself."""
    second, turns, handled, checks = now(), list[int](), list[str](), 0
    monkeypatch.setattr("bench.app.gui.controller.BUDGET", 0.02)
    monkeypatch.setattr("bench.app.gui.controller.now", lambda: second)

    def take(event: Warned) -> None:
        nonlocal second
        second += 0.001
        handled.append(event.text)

    def turn() -> None:
        turns.append(len(handled))

    def count(*_given: object) -> tuple[()]:
        nonlocal checks
        checks += 1
        return ()

    monkeypatch.setattr("bench.app.gui.form.problems", count)
    window._controller.event_received.connect(take)
    window._controller.changed.connect(turn)
    driven.said = [Published(Warned(f"{number}", time=1.0)) for number in range(EVENTS)]
    qtbot.waitUntil(lambda: len(handled) == EVENTS, timeout=LONG_MS)
    window._controller.event_received.disconnect(take)
    window._controller.changed.disconnect(turn)
    assert handled == [f"{number}" for number in range(EVENTS)]
    assert max(np.diff([0, *turns])) <= 21
    assert len(turns) <= 2 * EVENTS / 20
    assert checks == 0
    assert driven.beats >= 5


@pytest.mark.milliseconds
@pytest.mark.seconds
@pytest.mark.usefixtures("grids")
def test_stop_acts_during_a_flood_of_events(
    window: Window, driven: ScriptedClient, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
) -> None:
    """5000 events per second for a second, by the clock: the longest gap of the main loop, and STOP meanwhile."""
    monkeypatch.setattr("bench.app.gui.controller.BUDGET", 0.02)
    window.pages.setCurrentWidget(window.run)
    qtbot.wait(200)
    begin, turns, sent = now(), list[float](), 0
    pressed = stopped = 0.0

    def feed() -> None:
        nonlocal sent
        due = min(round(5000 * (now() - begin)), 5000)
        driven.said += [
            Published(
                Warned(f"{k}", time=1.0) if k % 2 else Estimate(16.0, 0.4, k, 0.01, 0.24, 0.004, 0.2, time=k / 5000)
            )
            for k in range(sent, due)
        ]
        sent = due

    while sent < 5000 or window._controller._waiting or driven.said:
        feed()
        if sent >= 2500 and not pressed:
            pressed = now()
            QTimer.singleShot(0, lambda: QTest.mousePress(window.header.stop, Qt.MouseButton.LeftButton))
        QApplication.processEvents()
        turns.append(now())
        if driven.asked and not stopped:
            stopped = now()
        assert now() - begin < LONG
    assert driven.asked == ["abort"]
    assert stopped - pressed <= 0.15
    assert max(np.diff(turns)) <= 0.1


def test_points_stay_until_something_else_begins(
    window: Window, driven: ScriptedClient, spoken: type[ScriptedClient]
) -> None:
    """A plan that is checked leaves them; a loop check, which has no gains, begins with an empty plot."""
    point = HarmonicPoint(omega_rad_s=16.0, beta=0.4, status=PointStatus.STEADY, layer="rocking", alpha_2=0.21)
    driven.said = [
        Published(PointFinished(point, time=2.0)),
        Ended("completed", "the plan was carried out", {}, "", Path("never")),
    ]
    window._controller._look()
    window.protocol.check_plan()
    spoken.latest.said = [PlanChecked((), None, (), 60.0, 1e6, 1e9, "hash", {})]
    window._controller._look()
    assert window.protocol.why_not == ""
    assert window.run.gains.measured == [(16.0, 0.21)]
    window.setup.loop.start()
    assert window._controller.running
    assert window.run.gains.measured == []
