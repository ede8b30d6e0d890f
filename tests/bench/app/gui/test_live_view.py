"""Live view and picture of every protocol, against what a short run of it measured and where its bench stood."""

from collections.abc import Callable, Generator
from dataclasses import replace

import numpy as np
import pytest
from pytestqt.qtbot import QtBot

from bench.analysis.check_line import CheckLine
from bench.app.catalogue import load_protocol
from bench.app.display import texts
from bench.app.display.figure import Curve
from bench.app.display.picture import Outline
from bench.app.display.theme import DARK, LIGHT
from bench.app.gui.controller import Controller
from bench.app.gui.live_plot import LivePlot
from bench.app.gui.run_page import RunPage
from bench.app.ipc.messages import Opened, Published, Run, Traces
from bench.config.model import BenchConfiguration
from bench.events import OperatorAnswered, PointFinished, Progress, SpecimenMounted
from bench.findings import FitFinished, TableIdentified
from bench.live_values import LiveValue, RunningGain
from bench.live_view import FITS, LiveRun, LiveView, Panel
from bench.protocol import RunView
from drivers.rig import OperatorTask
from protocols.common.replicate import TableMotion
from protocols.harmonic.protocol import HarmonicParameters, HarmonicPoint
from sim.specimen import Frame
from tests.bench.app.gui.short_runs import PARAMETERS, Moment, ShortRun, short_run

RESULTS = (PointFinished, FitFinished, TableIdentified, TableMotion)


@pytest.fixture(scope="module")
def controller(qapp: object) -> Generator[Controller]:  # noqa: ARG001 - Qt needs its application
    shared = Controller()
    yield shared
    shared.close()


@pytest.fixture(scope="module")
def page(controller: Controller) -> Generator[RunPage]:
    """One page for all runs: nothing of a run may remain in the next one."""
    shown = RunPage(controller, LIGHT)
    shown._timer.stop()
    shown.resize(1200, 600)
    shown.show()
    yield shown
    shown.close()
    shown.deleteLater()


def begin(page: RunPage, run: Run) -> None:
    page._controller.session.begin(run)
    page._controller.began.emit(run)
    page._draw()


def send(page: RunPage, moment: Moment) -> None:
    """As the controller does with the messages of a session."""
    match moment.message:
        case Opened():
            page._controller.opened.emit(moment.message)
        case Traces():
            page.traces.add([moment.message])
            page.block.place(moment.message)
        case _:
            page._controller._take(moment.message)


def event_of(moment: Moment, *kinds: type) -> object | None:
    message = moment.message
    return message.event if isinstance(message, Published) and isinstance(message.event, kinds) else None


def curves(page: RunPage, name: str) -> list[Curve]:
    """The drawn curves of this name."""
    return [curve for plot in page.live.shown for curve in plot.figure.curves if curve.name == name]


def measured(plot: LivePlot) -> list[Curve]:
    return [curve for curve in plot.figure.curves if curve.style in ("line", "points")]


@pytest.mark.parametrize("name", PARAMETERS)
def test_the_picture_and_its_labels_are_those_of_the_simulated_bench(page: RunPage, name: str) -> None:
    """After every message: what stands on the table, what is clamped, what the lasers measure, and where it is."""
    run = short_run(name)
    begin(page, run.run)
    free, actions, acting = run.run.configuration.specimen.frame, 0, False
    for number, moment in enumerate(run.moments):
        send(page, moment)
        if isinstance(moment.message, Traces):
            continue
        mounted = event_of(moment, SpecimenMounted) is not None
        actions += mounted
        # the simulated bench is changed at the answer, before the message of the change
        acting = not mounted and (acting or event_of(moment, OperatorAnswered) is not None)
        # of the frequent reports of progress, some show that nothing changes meanwhile
        frequent = event_of(moment, Progress, RunningGain) is not None
        if not acting and not (frequent and number % 50):
            page._draw()
            _compare(page, moment, free, just_mounted=mounted)
    assert actions


def _compare(page: RunPage, moment: Moment, free: Frame, *, just_mounted: bool) -> None:
    canvas, bench = page.picture.canvas, moment.bench
    shown, specimen = canvas.arrangement, bench.specimen
    assert (shown.block, shown.spring) == (specimen.beta is not None, bool(specimen.beta))
    assert (shown.face, shown.table_locked, shown.block_clamped) == (
        bench.watched,
        bench.table_locked,
        bench.block_clamped,
    )
    assert shown.frame_clamped == (specimen.frame != free)
    shapes = Outline(canvas.specimen).shapes(canvas.pose, shown)
    roles = {shape.role for shape in shapes}
    assert bool(roles & {"block", "unknown"}) == (specimen.beta is not None)
    assert ("spring" in roles) == bool(specimen.beta)
    heights = {shape.points[0][1] for shape in shapes if shape.role == "beam"}
    assert heights == {free.h1, free.h2 if bench.watched is None else bench.watched}
    label = page.picture.source.text()
    for clamped, part in (
        (bench.table_locked, "table_locked"),
        (bench.block_clamped, "block_clamped"),
        (specimen.frame != free, "frame_clamped"),
    ):
        assert (texts.CLAMPED[part] in label) == clamped
    assert ("Bare frame" in label) == (specimen.beta is None)
    assert ("by laser 2" in label) == (bench.watched is not None)
    assert any("block 300 mm" in plot.titleLabel.text for plot in page.traces.plots) == (bench.watched is not None)
    if just_mounted:
        pose, factor = canvas.pose, page.picture.factor.value()
        assert pose.ground == 0.0
        assert (pose.first, pose.second) == pytest.approx([factor * each for each in bench.storeys()])
        if bench.watched is not None or bench.block_clamped:
            assert pose.angle == pytest.approx(factor * bench.tilt, abs=1e-9)


def test_a_frame_that_is_pulled_by_hand_is_drawn_where_it_is_held(page: RunPage) -> None:
    run = short_run("free-vibration").run
    begin(page, run)
    held = replace(short_run("free-vibration").moments[0].bench, pull=0.02, table_locked=True)
    for work, amount in ((OperatorTask.LOCK_TABLE, None), (OperatorTask.PULL_FRAME, 0.02)):
        page._controller._take(Published(SpecimenMounted(held.specimen, work, amount, time=1.0)))
    page._draw()
    factor = page.picture.factor.value()
    expected = [factor * each for each in held.storeys()]
    assert (page.picture.pose.first, page.picture.pose.second) == pytest.approx(expected)


@pytest.mark.parametrize("name", PARAMETERS)
def test_before_the_first_result_the_view_states_what_will_appear(page: RunPage, name: str) -> None:
    """After a run of another protocol, of which nothing remains."""
    finish(page, short_run("free-rocking" if name != "free-rocking" else "identify"))
    run = short_run(name)
    begin(page, run.run)
    for moment in run.moments:
        if event_of(moment, *RESULTS):
            break
        send(page, moment)
    page._draw()
    assert page.live.gains.isHidden() == (name not in ("harmonic", "earthquake"))
    assert page.live.checks.isHidden() == (name != "check")
    for plot in page.live.shown:
        assert not measured(plot)
        assert "appear" in plot.figure.notice
        assert not plot.notice.isHidden()
    if name == "check":
        assert "pending" in page.live.checks.counts.text()
        assert "passed" not in page.live.checks.counts.text()


def finish(page: RunPage, run: ShortRun) -> None:
    """The whole run, drawn once."""
    begin(page, run.run)
    for moment in run.moments:
        send(page, moment)
    page._draw()


def _decay(page: RunPage, run: ShortRun) -> None:
    fit = [found for moment in run.moments if isinstance(found := event_of(moment, FitFinished), FitFinished)][-1]
    for laser in ("laser_1", "laser_2"):
        for name in (laser, f"{laser}_fitted"):
            (drawn,) = curves(page, name.replace("_", " "))
            np.testing.assert_array_equal(drawn.y, 1e3 * fit.columns[name].values)


def _springs(page: RunPage, run: ShortRun) -> None:
    _decay(page, run)
    (drawn,), (nominal,) = curves(page, "all decays"), curves(page, "nominal")
    spring = _points(run)[-1]
    assert drawn.y.tolist()[-1] == spring["k_c_n_m"]
    assert nominal.y[-1] == pytest.approx(spring["k_c_nominal_n_m"])


def _tilts(page: RunPage, run: ShortRun) -> None:
    for number in (1, 2):
        (drawn,) = curves(page, f"tilt {number}")
        fits = [found for moment in run.moments if isinstance(found := event_of(moment, FitFinished), FitFinished)]
        (impacts,) = [fit for fit in fits if fit.name == f"impacts of tilt {number}"]
        np.testing.assert_array_equal(drawn.y, impacts.columns["restitution"].values)
        assert drawn.high is not None
        np.testing.assert_allclose(drawn.high - drawn.y, 2.0 * impacts.columns["restitution_uncertainty"].values)


def _table(page: RunPage, run: ShortRun) -> None:
    (table,) = [
        each for moment in run.moments if isinstance(each := event_of(moment, TableIdentified), TableIdentified)
    ]
    (response,), (coherence,) = curves(page, "response"), curves(page, "coherence")
    np.testing.assert_allclose(response.y, np.abs(table.real + 1j * table.imaginary))
    np.testing.assert_array_equal(coherence.y, table.coherence)


def _multipliers(page: RunPage, run: ShortRun) -> None:
    (point,) = _points(run)
    plane, modulus = curves(page, "measured")
    assert complex(plane.x[0], plane.y[0]) == pytest.approx(point["modulus"] * np.exp(1j * point["angle_rad"]))
    assert (modulus.x[0], modulus.y[0]) == (point["omega_rad_s"], point["modulus"])
    assert modulus.high is not None
    assert modulus.high[0] - modulus.y[0] == pytest.approx(point["modulus_uncertainty"])


def _lasers(page: RunPage, run: ShortRun) -> None:
    fits = [found for moment in run.moments if isinstance(found := event_of(moment, FitFinished), FitFinished)]
    for fit, laser in zip(fits, ("laser 1", "laser 2"), strict=True):
        error, residuals = curves(page, laser)
        np.testing.assert_allclose(error.y, 1e6 * fit.columns["error"].values)
        assert 0.0 < np.nanmax(np.abs(residuals.y)) < np.abs(error.y).max()


def _lines(page: RunPage, run: ShortRun) -> None:
    lines = [each.point for moment in run.moments if isinstance(each := event_of(moment, PointFinished), PointFinished)]
    table, counts = page.live.checks.table, page.live.checks.counts.text()
    passed = sum(isinstance(line, CheckLine) and line.verdict == "passed" for line in lines)
    assert counts.startswith(f"{passed} passed")
    assert "pending" not in counts
    assert table.rowCount() == len(lines)


def _record(page: RunPage, run: ShortRun) -> None:
    motions = [each for moment in run.moments if isinstance(each := event_of(moment, TableMotion), TableMotion)]
    (achieved,), (wanted,) = curves(page, "achieved"), curves(page, "record")
    np.testing.assert_array_equal(achieved.y, motions[-1].achieved)
    error = np.sqrt(np.mean((achieved.y - wanted.y) ** 2) / np.mean(wanted.y**2))
    assert error < 0.2, "a table that follows its record"
    assert len(page.gains.measured) == len(_points(run))
    (point,) = _points(run)
    cell = page.matrix.item(0, 0)
    assert cell is not None
    assert f"{point['alpha_2']:.4g}"[:5] in cell.text(), "the record has another name in the results than as parameter"


def _gains(page: RunPage, run: ShortRun) -> None:
    assert page.gains.measured == [(row["omega_rad_s"], row["alpha_2"]) for row in _points(run)]


def _points(run: ShortRun) -> list[dict[str, float]]:
    return [
        found.point.model_dump()
        for moment in run.moments
        if isinstance(found := event_of(moment, PointFinished), PointFinished)
    ]


DRAWN: dict[str, Callable[[RunPage, ShortRun], None]] = {
    "check": _lines,
    "laser-calibration": _lasers,
    "identify": _table,
    "free-vibration": _decay,
    "coupling-stiffness": _springs,
    "free-rocking": _tilts,
    "harmonic": _gains,
    "earthquake": _record,
    "stability": _multipliers,
}


@pytest.mark.parametrize("name", PARAMETERS)
def test_the_view_shows_what_the_run_measured(page: RunPage, name: str) -> None:
    run = short_run(name)
    page.predict(run.moments[0].message.prediction if isinstance(run.moments[0].message, Opened) else {})
    finish(page, run)
    DRAWN[name](page, run)
    for plot in page.live.shown:
        assert not plot.figure.notice
    page.use_theme(DARK)
    page.use_theme(LIGHT)
    DRAWN[name](page, run)


def test_a_check_that_stopped_at_rest_has_no_pending_lines(page: RunPage) -> None:
    run = short_run("check").run
    begin(page, run)
    lines = [
        CheckLine(
            subject="laser_1", what="noise at rest", verdict="failed", measured=1e-3, unit="m", remedy="clean it"
        ),
        CheckLine(subject="bench", what="motion", verdict="untested", remedy="the table was not moved"),
    ]
    for line in lines:
        page._controller._take(Published(PointFinished(line, time=1.0)))
    page._draw()
    assert page.live.checks.counts.text() == "1 FAILED · 1 without verdict"
    shown = page.live.checks.table.item(0, 2)
    assert shown is not None
    assert shown.text() == "clean it"


class Counted:
    """A live view that counts its calls."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self, run: LiveRun) -> LiveView:
        self.calls += 1
        return (Panel("values").points("value", range(n := len(run.events(LiveValue))), [0.0] * n),)


def test_the_view_sleeps_while_its_page_is_hidden(controller: Controller, qtbot: QtBot) -> None:
    page, count = RunPage(controller, LIGHT), Counted()
    qtbot.addWidget(page)
    protocol = replace(load_protocol("free-vibration"), view=RunView(live=count))
    page.live.begin(protocol, short_run("free-vibration").run)
    asleep = count.calls
    for number in range(50):
        page.live.follow(LiveValue("value", float(number), time=float(number)))
        page._draw()
    assert count.calls == asleep
    page.show()
    page._draw()
    page._draw()
    assert count.calls == asleep + 1, "one call for all events, and none without an event"
    assert len(measured(page.live.shown[0])[0].y) == 50
    page.close()


def test_an_error_in_a_live_view_is_shown_in_its_place(controller: Controller, qtbot: QtBot) -> None:
    def broken(run: LiveRun) -> LiveView:
        return (Panel("").points("measured", run.column("omega"), [1.0]),)

    page = RunPage(controller, LIGHT)
    qtbot.addWidget(page)
    page.show()
    page.live.begin(replace(load_protocol("identify"), view=RunView(live=broken)), short_run("identify").run)
    page._draw()
    (plot,) = page.live.shown
    assert "the live view of identify failed: ValueError" in plot.figure.notice
    assert "The run is not affected." in plot.figure.notice
    page.close()


def test_without_a_declaration_live_values_are_curves_over_time(controller: Controller, qtbot: QtBot) -> None:
    page = RunPage(controller, LIGHT)
    qtbot.addWidget(page)
    page.show()
    page.live.begin(replace(load_protocol("identify"), view=RunView()), short_run("identify").run)
    for time, value in ((1.0, 0.5), (2.0, 0.7)):
        page.live.follow(LiveValue("period", value, "s", 0.1, 0.6, time=time))
        page.live.follow(LiveValue("mass", value, "kg", time=time))
    page._draw()
    period, mass = page.live.shown
    assert [curve.name for curve in period.figure.curves] == ["period", "period, predicted"]
    assert period.figure.curves[0].y.tolist() == [0.5, 0.7]
    assert mass.figure.y_label == "[kg]"
    page.close()


def test_events_with_arrays_are_kept_in_a_limited_number() -> None:
    run = LiveRun(HarmonicPoint, HarmonicParameters(), BenchConfiguration())
    for number in range(FITS + 5):
        run.follow(TableMotion("record", f"pass {number}", np.zeros(3), np.zeros(3), np.zeros(3)))
    kept = run.events(TableMotion)
    assert len(kept) == FITS
    assert kept[-1].play == f"pass {FITS + 4}"
