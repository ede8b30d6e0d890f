"""The queue at the window: what is checked is queued, what waits can be changed, STOP ends it all."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit
from pytestqt.qtbot import QtBot

from bench.app.cli.main import main
from bench.app.display import texts
from bench.app.display.theme import LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.header import KEY
from bench.app.gui.window import Window
from bench.app.ipc.messages import Ended, FromSession, PlanChecked, Question, Refused, Run
from bench.app.queue.file import LEFT, QueueFile
from bench.app.queue.queue import Queued, Stage
from bench.config.model import BenchConfiguration
from sim.errors import Cause, InvalidInput
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.gui.shared_window import PROTOCOLS, undressed
from tests.bench.app.ipc.experiment import SHAKING, bench, order
from tests.patience import LONG_MS

pytestmark = pytest.mark.usefixtures("without_plots")

FINE = PlanChecked((), None, (), 60.0, 1e6, 1e9, "hash", {})
REFUSED = PlanChecked((), "limits.drift = 0.08 is refused: too near", (), 60.0, 1e6, 1e9, "hash", {})


def _hear(window: Window, spoken: type[ScriptedClient], message: FromSession) -> None:
    spoken.latest.said.append(message)
    window._controller._look()


def _check(window: Window, spoken: type[ScriptedClient], cycles: int) -> None:
    field = window.protocol.form.fields["cycles"]
    assert isinstance(field, QLineEdit)
    field.setText(str(cycles))
    window.protocol.check_plan()
    _hear(window, spoken, FINE)


def _stages(window: Window) -> list[Stage]:
    return [test.stage for test in window.runner.queue.tests]


@pytest.fixture
def filled(window: Window, spoken: type[ScriptedClient], tmp_path: Path) -> Window:
    """Three tests wait: 5, 6 and 7 cycles; the first with a folder of its own."""
    for cycles in (5, 6, 7):
        window.protocol.folder.setText(str(tmp_path / "first") if cycles == 5 else "")
        _check(window, spoken, cycles)
        window.protocol.enqueue()
    return window


def _start(window: Window, spoken: type[ScriptedClient], qtbot: QtBot, *answers: FromSession) -> None:
    """Start the queue and answer its plan checks, each as it is asked for; without `answers` every plan is fine."""
    told = answers or (FINE,) * window.runner.queue.waiting
    window.runner.start()
    _answer(window, spoken, qtbot, *told)


def _answer(window: Window, spoken: type[ScriptedClient], qtbot: QtBot, *answers: FromSession) -> None:
    qtbot.waitUntil(lambda: window.runner._check in window._controller._plan_checks, timeout=LONG_MS)
    for answer in answers:
        _hear(window, spoken, answer)


def _run(window: Window, spoken: type[ScriptedClient], qtbot: QtBot, status: str) -> Run:
    """The test that has begun ends; whatever follows has begun when this returns."""
    link = spoken.latest
    run = link.assignment
    assert isinstance(run, Run)
    _hear(window, spoken, Ended(status, "told", {"points": []}, "", run.out))
    qtbot.waitUntil(lambda: spoken.latest is not link or not window.runner.going, timeout=LONG_MS)
    return run


def test_only_a_plan_that_was_checked_can_be_queued(window: Window, spoken: type[ScriptedClient], qtbot: QtBot) -> None:
    page = window.protocol
    assert (page.add.isEnabled(), page.add.toolTip()) == (False, texts.START_UNCHECKED)
    page.check_plan()
    _hear(window, spoken, REFUSED)
    page.enqueue()
    assert window.runner.queue.tests == ()
    _check(window, spoken, 9)
    page.operator.setText("A. Person")
    qtbot.mouseClick(page.add, Qt.MouseButton.LeftButton)
    (test,) = window.runner.queue.tests
    assert (test.protocol, test.parameters["cycles"], test.operator) == ("shaking", 9, "A. Person")
    assert window.pages.currentWidget() is window.queue
    row = [window.queue.table.item(0, column).text() for column in range(5)]
    assert row == ["1", "○ waiting", "shaking", "cycles 9", str(Path(test.out or "-"))]


def test_a_plan_is_checked_and_queued_while_a_run_is_under_way(window: Window, spoken: type[ScriptedClient]) -> None:
    window._controller.start(order(Path("never")))
    run = spoken.latest
    _check(window, spoken, 8)
    assert spoken.latest is not run
    window.protocol.enqueue()
    assert len(window.runner.queue.tests) == 1
    assert window._controller.running
    assert run.asked == []


def test_the_tests_run_in_order_each_after_its_plan_was_checked(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot, tmp_path: Path
) -> None:
    filled.pages.setCurrentWidget(filled.queue)
    filled.run.predicted.clear()  # type: ignore[attr-defined]
    qtbot.mouseClick(filled.queue.start, Qt.MouseButton.LeftButton)
    assert filled.queue.start.text() == texts.QUEUE_PAUSES
    assert filled.protocol.why_not == texts.QUEUE_HOLDS
    for number in (1, 2, 3):
        _answer(filled, spoken, qtbot)
        assert f"the plan of test {number}; 3 waiting" in filled.queue.status.text()
        assert _stages(filled) == [Stage.WAITING] * 3, "all plans first"
        _hear(filled, spoken, FINE)
    assert _stages(filled) == [Stage.RUNNING, Stage.WAITING, Stage.WAITING]
    runs = [_run(filled, spoken, qtbot, "completed") for _ in range(3)]
    assert filled.run.predicted == [FINE.prediction] * 3  # type: ignore[attr-defined]
    assert [run.parameters.model_dump()["cycles"] for run in runs] == [5, 6, 7]
    assert runs[0].out == tmp_path / "first"
    assert len({run.out for run in runs}) == 3
    assert _stages(filled) == [Stage.DONE] * 3
    assert (filled.runner.going, filled.runner.why) == (False, "")
    assert filled.pages.currentWidget() is filled.queue
    assert filled.protocol.why_not != texts.QUEUE_HOLDS


@pytest.mark.parametrize(
    ("status", "stage"), [("stopped", Stage.DONE), ("aborted", Stage.FAILED), ("failed", Stage.FAILED)]
)
def test_a_test_that_does_not_end_well_pauses_the_queue(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot, status: str, stage: Stage
) -> None:
    _start(filled, spoken, qtbot)
    _run(filled, spoken, qtbot, status)
    assert _stages(filled) == [stage, Stage.WAITING, Stage.WAITING]
    assert f'the status of test 1 is "{status}"' in filled.queue.status.text()
    _start(filled, spoken, qtbot)
    assert _stages(filled)[1] is Stage.RUNNING


def test_a_test_that_is_not_passed_pauses_the_queue_with_this_reason(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot
) -> None:
    _start(filled, spoken, qtbot)
    run = spoken.latest.assignment
    assert isinstance(run, Run)
    _hear(filled, spoken, Ended("completed", "", {"points": []}, "", run.out, passed=False))
    qtbot.waitUntil(lambda: not filled.runner.going, timeout=LONG_MS)
    assert _stages(filled) == [Stage.FAILED, Stage.WAITING, Stage.WAITING]
    assert 'the status of test 1 is "not passed"' in filled.queue.status.text()


@pytest.mark.parametrize(
    "answer", [REFUSED, Refused("omega = 2 is refused: too slow", Cause("invalid_input", "omega"))]
)
def test_a_refused_plan_pauses_the_queue_and_nothing_is_driven(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot, answer: FromSession
) -> None:
    _start(filled, spoken, qtbot, FINE, answer)
    assert _stages(filled) == [Stage.WAITING, Stage.FAILED, Stage.WAITING], "also when it is not the first"
    assert "is refused" in filled.runner.queue.tests[1].outcome
    assert not filled._controller.running
    assert not filled.runner.going


def test_stop_pauses_and_nothing_starts_by_itself_after_it(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot
) -> None:
    _start(filled, spoken, qtbot)
    link = spoken.latest
    qtbot.keyClick(filled, KEY)
    assert link.asked == ["abort"]
    assert not filled.runner.going
    _hear(filled, spoken, Ended("aborted", "abort requested", {}, "", Path("x")))
    qtbot.wait(50)
    assert spoken.latest is link
    assert _stages(filled) == [Stage.FAILED, Stage.WAITING, Stage.WAITING]
    filled.runner.start()
    assert (filled.runner.going, filled.queue.start.toolTip()) == (False, texts.LATCHED)
    assert texts.QUEUE_STOPPED in filled.queue.status.text()
    filled._controller.clear_stop()
    qtbot.wait(50)
    assert spoken.latest is link, "clearing starts nothing either"
    assert texts.QUEUE_STOPPED not in filled.queue.status.text()
    assert filled.queue.start.isEnabled()


def test_stop_while_a_plan_is_checked_leaves_its_test_waiting(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot
) -> None:
    _start(filled, spoken, qtbot, FINE)
    qtbot.keyClick(filled, KEY)
    assert spoken.latest.asked == ["leave"]
    assert _stages(filled) == [Stage.WAITING] * 3
    assert filled.runner.queue.tests[1].out is None
    _hear(filled, spoken, FINE)
    assert not filled._controller.running


def test_pausing_lets_the_test_end_and_begins_no_other(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot
) -> None:
    _start(filled, spoken, qtbot)
    filled.queue.start.click()
    link = spoken.latest
    assert link.asked == []
    _hear(filled, spoken, Ended("completed", "told", {}, "", Path("x")))
    qtbot.wait(50)
    assert spoken.latest is link
    assert _stages(filled) == [Stage.DONE, Stage.WAITING, Stage.WAITING]


def test_a_key_that_is_held_does_not_start_and_pause_in_turn(filled: Window, qtbot: QtBot) -> None:
    filled.pages.setCurrentWidget(filled.queue)
    both = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier
    for again in (False, True):
        QTest.simulateEvent(filled, True, Qt.Key.Key_Q, both, "", again, -1)
        qtbot.wait(120)
        assert filled.runner.going
    filled.runner.pause()
    for again in (False, True, True):
        QTest.simulateEvent(filled, True, Qt.Key.Key_Delete, Qt.KeyboardModifier.NoModifier, "", again, -1)
        qtbot.wait(120)
        assert len(filled.runner.queue.tests) == 2


def test_questions_between_tests_are_asked_as_ever(filled: Window, spoken: type[ScriptedClient], qtbot: QtBot) -> None:
    _start(filled, spoken, qtbot)
    _hear(filled, spoken, Question(1, "Mount the spring of beta = 0.4."))
    assert filled.prompt.isVisible()
    qtbot.waitUntil(filled.prompt.done.isEnabled, timeout=LONG_MS)
    filled.prompt.done.click()
    assert spoken.latest.asked == [(1, True)]


def test_everything_is_done_from_the_keyboard(filled: Window, qtbot: QtBot, tmp_path: Path) -> None:
    filled.pages.setCurrentWidget(filled.queue)
    table, queue = filled.queue.table, filled.runner.queue
    table.setFocus()
    table.setCurrentCell(0, 0)

    def cycles() -> list[int]:
        return [test.parameters["cycles"] for test in queue.tests]

    control, shift = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier

    def press(name: str, key: Qt.Key, modifier: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
        # Qt shows the button pressed for a moment
        with qtbot.waitSignal(filled.queue.buttons[name].clicked, timeout=LONG_MS):
            qtbot.keyClick(table, key, modifier)

    press("down", Qt.Key.Key_Down, control)
    assert (cycles(), table.currentRow()) == ([6, 5, 7], 1)
    press("up", Qt.Key.Key_Up, control)
    assert (cycles(), table.currentRow()) == ([5, 6, 7], 0)
    filled.queue.copies.setValue(2)
    press("repeat", Qt.Key.Key_R, control)
    assert cycles() == [5, 5, 5, 6, 7]
    assert [test.out for test in queue.tests[:3]] == [str(tmp_path / name) for name in ("first", "first-2", "first-3")]
    qtbot.keyClick(table, Qt.Key.Key_Down)
    press("skip", Qt.Key.Key_T, control)
    assert _stages(filled)[1] is Stage.SKIPPED
    assert filled.queue.buttons["skip"].text() == texts.TAKE_IN
    press("skip", Qt.Key.Key_T, control)
    assert _stages(filled)[1] is Stage.WAITING
    press("remove", Qt.Key.Key_Delete)
    assert cycles() == [5, 5, 6, 7]
    press("edit", Qt.Key.Key_E, control | shift)
    assert filled.pages.currentWidget() is filled.protocol


def test_what_waits_is_edited_in_its_form_and_what_began_is_not(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot
) -> None:
    page, queue = filled.protocol, filled.runner.queue
    filled.pages.setCurrentWidget(filled.queue)
    filled.queue.table.setCurrentCell(1, 0)
    filled.queue.buttons["edit"].click()
    field = page.form.fields["cycles"]
    assert isinstance(field, QLineEdit)
    assert (field.text(), page.add.text()) == ("6", texts.SAVE)
    assert not page.add.isEnabled(), "it must be checked anew"
    # the test is moved while it is edited
    queue.move(1, 1)
    _check(filled, spoken, 66)
    with qtbot.waitSignal(page.add.clicked, timeout=LONG_MS):
        qtbot.keyClick(page, Qt.Key.Key_J, Qt.KeyboardModifier.ControlModifier)
    assert [test.parameters["cycles"] for test in queue.tests] == [5, 7, 66]
    assert filled.pages.currentWidget() is filled.queue
    assert page.add.text() == texts.ADD
    _start(filled, spoken, qtbot)
    filled.queue.table.setCurrentCell(0, 0)
    assert [name for name, button in filled.queue.buttons.items() if button.isEnabled()] == ["repeat"]


def test_options_of_an_edited_test_do_not_apply_to_the_next_run(filled: Window) -> None:
    page, options = filled.protocol, filled.protocol.options
    options.operator.setText("Weber")
    options.folder.setText("mine")
    options.person.setChecked(True)
    before = options.for_queue
    test = filled.runner.queue.tests[1]
    other = test.model_copy(update={"operator": "Müller", "note": "theirs", "unattended": True, "keep_going": True})
    page.edit(other, 2)
    page.edit(other, 2)
    assert options.for_queue != before
    page.leave_editing()
    assert options.for_queue == before
    assert options.folder.text() == "mine"


def test_the_folder_of_a_run_that_ended_during_editing_is_not_offered_again(
    filled: Window, spoken: type[ScriptedClient], tmp_path: Path
) -> None:
    page = filled.protocol
    page.folder.setText(str(tmp_path / "mine"))
    page.check_plan()
    _hear(filled, spoken, FINE)
    page.begin()
    page.edit(filled.runner.queue.tests[1], 2)
    _hear(filled, spoken, Ended("completed", "", {}, "", tmp_path / "mine"))
    page.leave_editing()
    assert page.folder.text() == ""


def test_a_test_that_begins_while_it_is_edited_is_not_changed(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot
) -> None:
    page = filled.protocol
    page.edit(filled.runner.queue.tests[0], 1)
    _start(filled, spoken, qtbot)
    _check(filled, spoken, 55)
    page.enqueue()
    assert [test.parameters["cycles"] for test in filled.runner.queue.tests] == [5, 6, 7]
    assert texts.QUEUE_GONE in filled.trouble.answers[0].text()
    assert filled.runner.going, "that is no reason to pause"
    field = page.form.fields["cycles"]
    assert isinstance(field, QLineEdit)
    assert field.text() == "55", "what was typed is not lost"


def test_of_equal_copies_the_one_that_was_opened_is_changed(filled: Window) -> None:
    runner = filled.runner
    runner.queue.repeat(1, 2)
    first, opened = runner.queue.tests[1], runner.queue.tests[2]
    assert first == opened
    assert runner.replace(opened, opened.model_copy(update={"note": "this one"}))
    assert [test.note for test in runner.queue.tests] == ["", "", "this one", "", ""]


REAL = bench().model_copy(update={"backend": "hardware"})


@pytest.mark.parametrize(
    ("configuration", "how", "person"),
    [
        (bench(), {}, False),
        (bench(), {"ask": True}, True),
        (bench(), {"ask": True, "unattended": True}, False),
        (REAL, {}, True),
        (REAL, {"unattended": True}, False),
    ],
)
def test_a_person_is_asked_where_the_bench_or_the_test_wants_one(
    window: Window,
    spoken: type[ScriptedClient],
    qtbot: QtBot,
    configuration: BenchConfiguration,
    how: dict[str, bool],
    person: bool,
) -> None:
    window.runner.configuration = configuration
    window.runner.queue.add(Queued.model_validate({"protocol": "shaking", **how}))
    _start(window, spoken, qtbot)
    run = spoken.latest.assignment
    assert isinstance(run, Run)
    assert (run.configuration, run.person) == (configuration, person)


def test_tests_that_share_a_folder_or_do_not_fit_together_are_found_before_the_first(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot, tmp_path: Path
) -> None:
    runner = filled.runner
    big = PlanChecked((), None, (), 60.0, 0.4e9, 1e9, "hash", {})
    _start(filled, spoken, qtbot, big, big, big)
    assert _stages(filled) == [Stage.WAITING] * 3
    assert "may need 1.20 GB, but 1.00 GB are free" in filled.queue.status.text()
    runner.queue.add(Queued(protocol="shaking", out=str(tmp_path / "first")))
    link = spoken.latest
    runner.start()
    qtbot.waitUntil(lambda: not runner.going, timeout=LONG_MS)
    assert "test 1 has the same folder" in filled.queue.status.text()
    assert spoken.latest is link, "not even checked"
    assert not filled._controller.running


def test_a_full_disk_leaves_no_test_that_runs_without_its_session(
    filled: Window, spoken: type[ScriptedClient], qtbot: QtBot
) -> None:
    runner, kept = filled.runner, filled.runner.queue._keep
    _start(filled, spoken, qtbot)
    full = [True]

    def keep(tests: Sequence[Queued]) -> None:
        if full:
            raise InvalidInput("queue file", "queue.json", "it cannot be written: no space left on device")
        kept(tests)

    runner.queue._keep = keep
    _run(filled, spoken, qtbot, "completed")
    assert (_stages(filled)[0], runner.going) == (Stage.DONE, False), "so it is, kept or not"
    _start(filled, spoken, qtbot)
    assert (_stages(filled)[1], runner.going) == (Stage.WAITING, False)
    assert not filled._controller.running


def test_the_end_of_another_run_is_none_of_a_test(filled: Window, spoken: type[ScriptedClient]) -> None:
    filled.runner.queue.begin(0, "nowhere")
    filled._controller.start(order(Path("by hand")))
    _hear(filled, spoken, Ended("aborted", "by hand", {}, "", Path("by hand")))
    assert _stages(filled)[0] is Stage.RUNNING


def _window(qtbot: QtBot, queue: Path) -> Window:
    with undressed():
        window = Window(Controller(), bench(), (SHAKING, *PROTOCOLS), LIGHT, queue=queue)
    qtbot.addWidget(window)
    window.show()
    return window


def test_the_queue_outlives_the_window(qtbot: QtBot, spoken: type[ScriptedClient], tmp_path: Path) -> None:
    path = tmp_path / "runs" / "queue.json"
    first = _window(qtbot, path)
    for _ in range(2):
        first.runner.do(lambda: first.runner.queue.add(Queued(protocol="shaking", parameters={"cycles": 5})))
    _start(first, spoken, qtbot)
    first.leave()
    again = _window(qtbot, path)
    assert _stages(again) == [Stage.FAILED, Stage.WAITING]
    assert again.runner.queue.tests[0].outcome == LEFT
    assert not again.runner.going, "nothing starts by itself"
    assert str(path) in again.queue.kept.text()
    again.leave()


def test_a_queue_that_cannot_be_kept_says_so_and_pauses(
    qtbot: QtBot, spoken: type[ScriptedClient], tmp_path: Path
) -> None:
    path = tmp_path / "queue.json"
    window = _window(qtbot, path)
    window.runner.do(lambda: window.runner.queue.add(Queued(protocol="shaking")))
    other = QueueFile(path)
    other.write([*other.read(), Queued(protocol="harmonic")])
    _start(window, spoken, qtbot)
    assert not window.runner.going
    assert window.trouble.isVisible()
    assert "another program has changed the file" in window.trouble.answers[0].text()
    assert _stages(window) == [Stage.WAITING]
    window.leave()


def test_a_queue_that_another_window_runs_is_left_to_it(
    qtbot: QtBot, spoken: type[ScriptedClient], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "queue.json"
    first = _window(qtbot, path)
    first.runner.do(lambda: first.runner.queue.add(Queued(protocol="shaking")))
    _start(first, spoken, qtbot)
    before = path.read_bytes()
    second = _window(qtbot, path)
    assert "the operator's window (process" in second.trouble.answers[0].text()
    second.runner.do(lambda: second.runner.queue.add(Queued(protocol="shaking")))
    for command in (["run", "harmonic", "--queue", str(path)], ["queue", str(path)]):
        assert main(command) == 2
        assert "the operator's window (process" in capsys.readouterr().err
    assert path.read_bytes() == before
    second.leave()
    _run(first, spoken, qtbot, "completed")
    assert [test.stage for test in QueueFile(path).read()] == [Stage.DONE]
    first.leave()


@pytest.mark.usefixtures("spoken")
def test_a_file_that_cannot_be_read_is_left_alone(qtbot: QtBot, tmp_path: Path) -> None:
    path = tmp_path / "queue.json"
    path.write_text("{", encoding="utf-8")
    window = _window(qtbot, path)
    assert window.trouble.isVisible()
    assert "cannot be read as JSON" in window.trouble.answers[0].text()
    window.runner.do(lambda: window.runner.queue.add(Queued(protocol="shaking")))
    assert path.read_text(encoding="utf-8") == "{"
    window.leave()
