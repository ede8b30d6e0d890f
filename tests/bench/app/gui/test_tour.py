"""The first minute: a step is ticked off when it was done, and begun again when it went wrong."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.display.theme import LIGHT
from bench.app.display.trouble import Trouble
from bench.app.gui.controller import Controller
from bench.app.gui.tour import DONE, LATER, NEXT, Tour
from bench.app.gui.window import Window
from bench.app.ipc.messages import Ended, PlanChecked, Question, Refused
from bench.config.model import BenchConfiguration
from bench.events import PointFinished, Warned
from sim.parameters import Parameters
from tests.bench.app.gui.shared_window import PROTOCOLS, undressed
from tests.bench.app.ipc.experiment import SHAKING, bench, order

FINE = PlanChecked((), None, (), 60.0, 1e6, 1e9, "hash", {})
COMPLETED = Ended("completed", "the plan was carried out", {}, "", Path("never"))
TIGHT = PlanChecked((), "drift: too near", (), 60.0, 1e6, 1e9, "hash", {})


def _marks(tour: Tour) -> str:
    return "".join(label.text()[0] for label in tour.steps)


@pytest.fixture
def controller(qtbot: QtBot) -> Controller:
    made = Controller()
    qtbot.addWidget(tour := Tour(made))
    tour.show()
    made.setProperty("tour", tour)
    return made


def test_steps_follow_what_was_done(controller: Controller) -> None:
    tour = controller.property("tour")
    assert _marks(tour) == NEXT + 3 * LATER
    controller.plan_checked.emit(TIGHT, None)
    assert _marks(tour) == NEXT + 3 * LATER
    controller.plan_checked.emit(FINE, None)
    assert _marks(tour) == DONE + NEXT + 2 * LATER
    controller.began.emit(order(Path("never")))
    controller.event_received.emit(Warned("of something", time=1.0))
    assert _marks(tour) == 2 * DONE + NEXT + LATER
    assert tour.steps[2].property("level") == "wait"
    controller.plan_checked.emit(TIGHT, None)
    controller.event_received.emit(PointFinished(Parameters(), time=2.0))
    assert _marks(tour) == 3 * DONE + NEXT
    tour.read_results()
    assert _marks(tour) == 3 * DONE + NEXT, "the run has not ended"
    controller.ended.emit(COMPLETED)
    assert _marks(tour) == 3 * DONE + NEXT, "until the results were read"
    tour.read_results()
    assert _marks(tour) == 4 * DONE
    assert tour.welcome.text() == texts.TOUR_COMPLETE


@pytest.mark.parametrize(
    "ended", [Ended("aborted", "abort requested", {}, "", Path("never")), Refused("no room", failed=True)]
)
def test_a_run_without_a_point_is_begun_again(controller: Controller, ended: Ended | Refused) -> None:
    controller.plan_checked.emit(FINE, None)
    controller.began.emit(order(Path("never")))
    controller.ended.emit(ended)
    assert _marks(controller.property("tour")) == NEXT + 3 * LATER


@pytest.mark.usefixtures("without_live_plots", "spoken")
def test_each_step_frames_its_part_and_waits_for_it(qtbot: QtBot) -> None:
    controller = Controller()
    with undressed():
        window = Window(controller, bench(), (SHAKING, *PROTOCOLS), LIGHT, tour=True)
    qtbot.addWidget(window)
    window.show()
    tour, tabs = window.welcome, window.results.parts
    parts = (window.protocol.check, window.protocol.start, tabs)

    def framed() -> list[bool]:
        return [part.property("guided") == "yes" for part in parts]

    window.pages.setCurrentWidget(window.setup)
    assert framed() == [True, False, False]
    qtbot.mouseClick(tour.show_me, Qt.MouseButton.LeftButton)
    assert window.pages.currentWidget() is window.protocol
    assert _marks(tour)[0] == NEXT, "showing is not doing"
    controller.plan_checked.emit(FINE, None)
    assert framed() == [False, True, False]
    controller.began.emit(order(Path("never")))
    assert framed() == [False, False, False]
    controller.event_received.emit(PointFinished(Parameters(), time=2.0))
    assert framed() == [False, False, True]
    controller.question_changed.emit(Question(1, "Mount the spring."))
    assert framed() == [False, False, False], "a question comes first"
    controller.question_changed.emit(None)
    controller.ended.emit(COMPLETED)
    qtbot.mouseClick(tour.show_me, Qt.MouseButton.LeftButton)
    assert window.pages.currentWidget() is window.results
    window.results.parts.setCurrentWidget(window.results.histories)
    assert framed() == [False, False, True]
    window.results.parts.setCurrentWidget(window.results.figures)
    assert framed() == [False, False, False]
    assert _marks(tour) == 4 * DONE
    assert not tour.show_me.isVisible()
    window.close()


@pytest.mark.usefixtures("without_live_plots", "spoken")
def test_the_tour_gives_way_to_what_matters_and_to_a_real_bench(qtbot: QtBot) -> None:
    controller = Controller()
    with undressed():
        window = Window(controller, bench(), (SHAKING, *PROTOCOLS), LIGHT, tour=True)
    qtbot.addWidget(window)
    window.show()
    assert window.welcome.isVisible()
    controller.question_changed.emit(Question(1, "Mount the spring."))
    assert (window.prompt.isVisible(), window.welcome.isVisible()) == (True, False)
    window.trouble.show_trouble(Trouble("one", "two", "three"))
    controller.question_changed.emit(None)
    assert not window.welcome.isVisible()
    window.trouble.hide()
    assert window.welcome.isVisible()
    window.setup.opened.emit(BenchConfiguration(backend="hardware"))
    assert not window.welcome.isVisible(), "there the table is real"
    window.setup.opened.emit(bench())
    assert window.welcome.isVisible()
    window.welcome.leave()
    controller.question_changed.emit(None)
    window.trouble.show_trouble(Trouble("one", "two", "three"))
    window.trouble.hide()
    assert not window.welcome.isVisible()
    window.close()
