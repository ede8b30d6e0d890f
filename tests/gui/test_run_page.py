"""What is drawn is what was measured: extremes of every pixel, points on their lines, questions inline."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from bench.events import Estimate, PointFinished, State, StateChanged, Warned
from bench.gui.ring import Ring
from bench.gui.window import Window
from bench.link.messages import Beat, Question, Told, Traces
from bench.link.reduction import TRACES
from bench.record.tables import Column
from protocols.harmonic.point import HarmonicPoint, PointStatus
from tests.gui.conftest import SpokenLink
from tests.link.experiment import order

STEP = 0.002


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
    ends = STEP * (np.arange(len(every)) + 1.0) - begin
    inside = every[-len(ring) :][ends[-len(ring) :] >= -seconds - 1e-9]
    edge = every[-len(ring) :][ends[-len(ring) :] >= -seconds + 1e-9]
    assert drawn.max() in (pytest.approx(inside.max() + 0.5), pytest.approx(edge.max() + 0.5))
    assert drawn.min() in (pytest.approx(inside.min() - 0.5), pytest.approx(edge.min() - 0.5))
    assert len(time) == len(drawn) <= 2 * buckets
    assert (np.diff(time) >= 0).all()


def test_a_gap_breaks_the_line() -> None:
    ring = Ring(1)
    ring.add(_block(0.0, np.zeros((5, 1))))
    ring.add(_block(5 * STEP, np.zeros((5, 1))))
    assert len(ring) == 10
    ring.add(_block(1.0, np.zeros((5, 1))))
    _, drawn = ring.window(10.0, 100)
    assert np.isnan(drawn).any()


@pytest.fixture
def link(window: Window, spoken: type[SpokenLink]) -> SpokenLink:
    omega = np.array([15.0, 16.0, 17.0])
    window.run.predict(
        {
            "omega": Column(omega, "rad/s", ""),
            "beta": Column(np.full(3, 0.4), "1", ""),
            "alpha_2": Column(np.array([0.3, 0.2, 0.4]), "1", ""),
            "layer": Column(np.array(["rocking"] * 3), "", ""),
        }
    )
    window._controller.start(order(Path("never")))
    return spoken.latest


def test_curves_hold_what_was_measured_in_the_unit_of_their_axis(window: Window, link: SpokenLink) -> None:
    values = np.zeros((50, len(TRACES)))
    values[25, TRACES.index("drift")] = 0.004
    values[30, TRACES.index("acceleration")] = -1.25
    link.said = [Traces(1, 0.0, STEP, values.astype(np.float32), values.astype(np.float32), 0.0)]
    window._controller._look()
    window.run.traces.draw()
    curves = [curve.getData()[1] for curve in window.run.traces.curves]
    assert curves[4].max() == pytest.approx(4.0)  # mm
    assert curves[1].min() == pytest.approx(-1.25)
    low, high = window.run.traces.plots[4].viewRange()[1]
    assert low <= -4.0
    assert high >= 4.0


def test_the_running_gain_and_the_finished_point(window: Window, link: SpokenLink) -> None:
    point = HarmonicPoint(
        omega_rad_s=16.0, beta=0.4, status=PointStatus.STEADY, layer="rocking", alpha_2=0.21, alpha_2_uncertainty=0.01
    )
    link.said = [Told(Estimate(1.0, 16.0, 0.4, 12, 0.01, 0.24, 0.0041, 0.2))]
    window._controller._look()
    assert "0.2400 ± 0.0041" in window.run.alpha.text()
    assert "+20.0 %" in window.run.predicted.text()
    link.said = [Told(PointFinished(2.0, point)), Told(Warned(3.0, "drift comes near"))]
    window._controller._look()
    assert window.run.gains.measured == [(16.0, 0.21)]
    assert "▲ warning: drift comes near" in window.run.log.toPlainText()


def test_a_question_is_inline_and_answered_once(window: Window, link: SpokenLink, qtbot: QtBot) -> None:
    link.said = [
        Told(StateChanged(1.0, State.IDLE, State.WAITING, "a question")),
        Question(7, "Mount the spring of beta = 0.4."),
    ]
    window._controller._look()
    assert window.prompt.isVisible()
    assert window.prompt.request.text() == "Mount the spring of beta = 0.4."
    assert QApplication.activeModalWidget() is None
    qtbot.mouseClick(window.prompt.done, Qt.MouseButton.LeftButton)
    qtbot.mouseClick(window.prompt.done, Qt.MouseButton.LeftButton)
    assert link.asked == [(7, True)]
    assert not window.prompt.isVisible()


def test_a_question_goes_when_the_bench_no_longer_waits(window: Window, link: SpokenLink) -> None:
    link.said = [Question(1, "Stand the block up.")]
    window._controller._look()
    link.said = [Told(StateChanged(1.0, State.WAITING, State.HALTED, "halt was asked for"))]
    window._controller._look()
    assert not window.prompt.isVisible()


def test_ramping_out_is_a_request_of_its_own(window: Window, link: SpokenLink, qtbot: QtBot) -> None:
    link.said = [Beat(State.RUNNING, "", 1.0, 0, 0)]
    window._controller._look()
    qtbot.mouseClick(window.run.ramp_out, Qt.MouseButton.LeftButton)
    assert link.asked == ["stop"]
    assert not window._controller.latched


def test_no_dialog_can_be_opened_while_armed(window: Window, link: SpokenLink) -> None:
    link.said = [Beat(State.RUNNING, "", 1.0, 0, 0)]
    window._controller._look()
    assert not window.results.open_file.isEnabled()
