"""Samples are those of the file, also together, at the cursors and in the spectrum; a thread reads them."""

from math import isnan

import numpy as np
import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from bench.app.display.run_file import RunFile, read_file
from bench.app.display.samples import Track, read_spectra, read_stretches, read_values
from bench.app.display.theme import DARK, LIGHT
from bench.app.gui.history_view import HistoryView
from sim.errors import InvalidInput
from tests.bench.app.gui.run_files import RATE, N, counts, made, point, settle
from tests.patience import LONG_MS
from tests.read_functions import refused


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunFile, RunFile]:
    folder = tmp_path_factory.mktemp("samples")
    return tuple(read_file(made(folder / name, point(16.0, 0.2))) for name in ("monday", "tuesday"))


@pytest.fixture
def view(qtbot: QtBot, files: tuple[RunFile, RunFile]) -> HistoryView:
    shown = HistoryView(LIGHT)
    qtbot.addWidget(shown)
    shown.resize(900, 500)
    shown.show()
    shown.compare(files)
    shown.use(files[0])
    return shown


def _wait(view: HistoryView, qtbot: QtBot, *names: str, begin: float | None = None) -> None:
    qtbot.waitUntil(
        lambda: (
            [line.name for line in view.plot.lines] == [*names]
            and (begin is None or {each.begin for each in view.shown} == {begin})
        ),
        timeout=LONG_MS,
    )


@pytest.mark.parametrize(
    ("begin", "end", "parts"), [(0.0, 4.0, 7), (1.0, 1.2, 50), (-1.0, 9.0, 4000), (0.5, 0.52, 400)]
)
def test_a_stretch_has_the_extremes_of_its_samples(
    files: tuple[RunFile, RunFile], begin: float, end: float, parts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against the counts as they were made."""
    monkeypatch.setattr("bench.app.display.samples.CHUNK", 300)
    found = read_stretches([Track(files[0].path, 2, "laser_1")], begin, end, parts)[0]
    first, last = max(round(begin * RATE), 0), min(round(end * RATE) + 1, N)
    expected = 1e-6 * counts(2)[first:last, 1]
    assert (found.values.min(), found.values.max()) == pytest.approx((expected.min(), expected.max()), rel=1e-6)
    assert found.time[0] == pytest.approx(first / RATE)
    assert found.time.size <= 2 * parts + 4
    assert found.unit == "m"
    if (last - first) < 2 * parts:
        np.testing.assert_allclose(found.values, expected, rtol=1e-6)


def test_samples_are_shown_in_millimetres_and_read_after_a_zoom(view: HistoryView, qtbot: QtBot) -> None:
    # a laser's counts are micrometres
    view.run.setCurrentIndex(1)
    view.channel.setCurrentText("drive")
    _wait(view, qtbot, "drive")
    np.testing.assert_allclose(view.plot.lines[0].y, 0.2, rtol=1e-6)
    view.channel.setCurrentText("laser 1")
    view.plot.show_range(1.0, 1.1)
    _wait(view, qtbot, "laser 1", begin=1.0)
    assert view.plot.lines[0].unit == "mm"
    np.testing.assert_allclose(view.plot.curves[0].getData()[1], 1e-3 * counts(2)[1000:1101, 1], rtol=1e-6)


def test_channels_of_several_runs_are_drawn_by_unit(view: HistoryView, qtbot: QtBot) -> None:
    for action in view._menu.actions():
        if action.text() in ("laser 1", "drive"):
            action.trigger()
    _wait(view, qtbot, "table acceleration", "laser 1", "drive")
    assert [plot.getAxis("left").labelText for plot in view.plot.plots] == ["[m/s²]", "[mm]", "[V]"]
    assert not view._menu.actions()[0].isEnabled(), "the first channel cannot be drawn twice"
    for action in view._menu.actions():
        if action.isChecked():
            action.trigger()
    view.overlay.setChecked(True)
    _wait(view, qtbot, "monday: table acceleration", "tuesday: table acceleration")
    assert len(view.plot.plots) == 1
    view.use_theme(DARK)
    assert [curve.opts["name"] for curve in view.plot.curves] == [line.name for line in view.plot.lines]
    view.plot.show_range(1.0, 1.1)
    _wait(view, qtbot, "monday: table acceleration", "tuesday: table acceleration", begin=1.0)
    assert view.plot.plots[0].viewRange()[0] == [1.0, 1.1]


def test_the_cursors_have_the_samples_of_the_file(view: HistoryView, qtbot: QtBot) -> None:
    view.channel.setCurrentText("laser 1")
    view.with_cursors.setChecked(True)
    assert view.plot.cursors == pytest.approx((N / RATE / 3, 2 * N / RATE / 3))
    # as dragging does
    for cursor, place in zip(view.plot._pairs[0], (1.0, 1.2), strict=True):
        cursor.setValue(place)
    assert view.plot.cursors == (1.0, 1.2)
    a, b = 1e-3 * counts(1)[[1000, 1200], 1]
    expected = f"B − A +0.2000 s (5.000 Hz) · laser 1: A {a:#.4g}, B {b:#.4g}, B − A {b - a:+.4g} mm"
    qtbot.waitUntil(lambda: view.reading.text().endswith(expected), timeout=LONG_MS)
    view.with_cursors.setChecked(False)
    assert view.reading.isHidden()
    assert view.plot.cursors is None


def test_nothing_of_a_file_remains_when_none_is_shown(view: HistoryView, qtbot: QtBot) -> None:
    """Neither the values at the cursors, nor a result of a reading that began before."""
    view.channel.setCurrentText("laser 1")
    view.with_cursors.setChecked(True)
    qtbot.waitUntil(lambda: view.reading.text().endswith("mm"), timeout=LONG_MS)
    view.read()
    view.use(None)
    qtbot.wait(300)
    assert view.reading.text() == ""
    assert view.shown == []
    assert not [*view.plot.lines]


def test_the_cursors_are_moved_by_keys(view: HistoryView, qtbot: QtBot) -> None:
    view.channel.setCurrentText("laser 1")
    for action in view._menu.actions():
        if action.text() == "drive":
            action.trigger()
    _wait(view, qtbot, "laser 1", "drive")
    view.with_cursors.setChecked(True)
    view.plot.show_range(0.9996, 2.0004)
    plot, none, shift = view.plot, Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier
    moves = [
        (Qt.Key.Key_Home, none, (1.0, None)),
        (Qt.Key.Key_Right, none, (1.001, None)),
        (Qt.Key.Key_Right, shift, (1.011, None)),
        (Qt.Key.Key_Left, none, (1.010, None)),
        (Qt.Key.Key_B, none, (1.010, None)),
        (Qt.Key.Key_End, none, (1.010, 2.0)),
        (Qt.Key.Key_Left, shift, (1.010, 1.99)),
    ]
    for key, held, (first, second) in moves:
        qtbot.keyClick(plot, key, held)
        assert plot.cursors == pytest.approx((first, second or plot.cursors[1]), abs=1e-9), key
    assert [plot.selected, *(pair[1].value() for pair in plot._pairs)] == pytest.approx([1, 1.99, 1.99])
    assert [cursor.pen.width() for cursor in plot._pairs[0]] == [2, 4], "the selected one is bold"
    b = 1e-3 * counts(1)[1990, 1]
    qtbot.waitUntil(lambda: f"B {b:#.4g}" in view.reading.text(), timeout=LONG_MS)
    # to the ends of the run, and the visible range follows
    for key, place in ((Qt.Key.Key_Right, (N - 1) / RATE), (Qt.Key.Key_Left, 0.0)):
        for _ in range(N // 10 + 1):
            qtbot.keyClick(plot, key, shift)
        assert plot.cursors is not None
        assert plot.cursors[1] == pytest.approx(place)
        assert plot.visible[0] <= place <= plot.visible[1]
    assert all(word in view.with_cursors.toolTip() for word in ("keys", "Shift", "Home"))


def test_an_error_stays_until_its_subject_succeeds_or_is_hidden(
    view: HistoryView, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    def said(*subjects: str) -> bool:
        shown = view.message.text() if view.message.isVisible() else ""
        return all((f"{each}: " in shown) == (each in subjects) for each in ("Samples", "spectrum", "cursors"))

    view.with_spectrum.setChecked(True)
    view.plot.show_range(1.0, 1.01)
    _wait(view, qtbot, "table acceleration", begin=1.0)
    qtbot.waitUntil(lambda: said("spectrum"), timeout=LONG_MS)
    assert "zoom out" in view.message.text()
    view.with_cursors.setChecked(True)
    qtbot.waitUntil(lambda: "B − A" in view.reading.text() and "table" in view.reading.text(), timeout=LONG_MS)
    view.overlay.setChecked(True)
    _wait(view, qtbot, "monday: table acceleration", "tuesday: table acceleration")
    assert said("spectrum"), "samples and cursors were read without an error"
    view.plot.show_range(1.0, 2.0)
    qtbot.waitUntil(said, timeout=LONG_MS)
    monkeypatch.setattr("bench.app.gui.history_view.probe", refused)
    view.plot.cursors_moved.emit()
    qtbot.waitUntil(lambda: said("cursors"), timeout=LONG_MS)
    view.read()
    settle(view)
    assert said("cursors")
    view.with_cursors.setChecked(False)
    assert said()


def test_values_outside_a_run_are_absent(files: tuple[RunFile, RunFile]) -> None:
    track = Track(files[0].path, 2, "drive")
    inside, outside = read_values([track], (0.0, N / RATE))[0]
    assert inside == pytest.approx(0.2)
    assert isnan(outside)


def test_the_spectrum_is_that_of_the_visible_samples(view: HistoryView, qtbot: QtBot) -> None:
    view.channel.setCurrentText("laser 1")
    view.plot.show_range(1.0, 2.0)
    view.with_spectrum.setChecked(True)
    qtbot.waitUntil(lambda: len(view.spectrum.lines) == 1 and view.spectrum.lines[0].x.size == 501, timeout=LONG_MS)
    line = view.spectrum.lines[0]
    assert line.unit == "mm"
    values = 1e-3 * counts(1)[1000:2001, 1]
    window = np.hanning(values.size)
    time = np.arange(values.size) / RATE
    # one line as a sum, in place of the fast transform
    at = 40
    wave = np.exp(-2j * np.pi * line.x[at] * time)
    expected = 2.0 * abs(np.sum((values - values.mean()) * window * wave)) / window.sum()
    assert line.y[at] == pytest.approx(expected, rel=1e-6)
    assert view.spectrum.plots[0].getAxis("left").labelText == "laser 1 [mm]"


def test_a_spectrum_of_too_few_or_too_many_samples_is_refused(
    files: tuple[RunFile, RunFile], monkeypatch: pytest.MonkeyPatch
) -> None:
    track = Track(files[0].path, 1, "laser_1")
    with pytest.raises(InvalidInput, match="zoom out"):
        read_spectra([track], 1.0, 1.01)
    monkeypatch.setattr("bench.app.display.samples.LONGEST", 100)
    with pytest.raises(InvalidInput, match=r"at most 0 s|zoom in"):
        read_spectra([track], 0.0, 4.0)


def test_a_long_spectrum_keeps_its_largest_lines(
    files: tuple[RunFile, RunFile], monkeypatch: pytest.MonkeyPatch
) -> None:
    track = Track(files[0].path, 1, "laser_1")
    whole = read_spectra([track], 0.0, 4.0)[0]
    monkeypatch.setattr("bench.app.display.samples.LINES", 100)
    short = read_spectra([track], 0.0, 4.0)[0]
    assert short.amplitude.size <= 100
    peak = int(np.argmax(whole.amplitude))
    assert (short.amplitude.max(), short.frequency[np.argmax(short.amplitude)]) == (
        whole.amplitude[peak], whole.frequency[peak],
    )  # fmt: skip
