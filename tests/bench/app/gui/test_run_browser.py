"""The list of runs shows what the files hold, follows the folder, and reads nothing in the window's thread."""

import json
import os
import shutil
import threading
from collections.abc import Generator
from pathlib import Path
from time import time

import pytest
from PySide6.QtCore import QObject, QSize, Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from bench.app.display import run_list, texts
from bench.app.display.run_list import Found, RunRow, find_runs, read_row
from bench.app.display.theme import LIGHT
from bench.app.gui import run_browser, run_model
from bench.app.gui.controller import Controller
from bench.app.gui.figure_view import read_figure
from bench.app.gui.results_page import ResultsPage
from bench.app.gui.run_browser import RunBrowser
from bench.app.gui.run_model import RunModel
from bench.config.model import BenchConfiguration
from bench.datafile.reader import open_datafile
from bench.events import PointFinished
from sim.specimen import Specimen
from tests.bench.app.gui.run_files import begun, close_files, made, point, settle
from tests.bench.app.gui.shared_window import page_alone
from tests.patience import LONG_MS

AGREES = {"alpha_2_predicted": 0.199, "alpha_2_predicted_uncertainty": 0.002, "agrees": True}
SPECIMEN = {"specimen": Specimen().model_dump_json(), "configuration": BenchConfiguration().model_dump_json()}


def _picture(path: Path, size: tuple[int, int] = (300, 100)) -> None:
    image = QImage(*size, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.red)
    image.save(str(path))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two campaigns, one of them below a further folder, a damaged file and one of another kind."""
    folder = tmp_path_factory.mktemp("runs")
    one = made(folder / "monday", point(16.0, 0.200).model_copy(update=AGREES), operator="A. Meyer", **SPECIMEN)
    _picture(one.with_name("gain_spectra.png"))
    _picture(one.with_name("another.png"))
    two = made(folder / "evening" / "tuesday", point(16.0, 0.212), point(15.0, 0.31), operator="B. Ruiz", notes="rain")
    (folder / "cut").mkdir()
    cut = shutil.copy(one, folder / "cut" / "campaign.h5")
    os.truncate(cut, 5000)
    (folder / "foreign.h5").write_text("not HDF5")
    for age, path in enumerate((one, two, Path(cut), folder / "foreign.h5")):
        os.utime(path, (1e9 - age, 1e9 - age))
    return folder


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("one") / "run", point(16.0, 0.2))


@pytest.fixture(scope="module")
def one_page(qapp: QApplication, folder: Path) -> Generator[ResultsPage]:  # noqa: ARG001 - Qt needs its application
    with page_alone(ResultsPage, 700) as shown:
        shown.browser.folder = folder
        shown.show()
        yield shown


@pytest.fixture
def page(one_page: ResultsPage, folder: Path, qtbot: QtBot) -> Generator[ResultsPage]:
    """The page with the list of the folder, of which no file is open."""
    browser = one_page.browser
    _wait(browser, qtbot, 4)
    yield one_page
    close_files(one_page)
    browser.search.clear()
    browser.table.sortByColumn(run_browser.DATE, Qt.SortOrder.DescendingOrder)
    browser.use_folder(folder)
    one_page.browse()
    # a problem is told until the folder was listed again
    qtbot.waitUntil(lambda: not browser._problem, timeout=LONG_MS)


def _wait(browser: RunBrowser, qtbot: QtBot, files: int) -> None:
    model = browser.model
    qtbot.waitUntil(
        lambda: model.all == files and all(map(model.row, model.shown)) and not browser._unread, timeout=LONG_MS
    )


def _names(browser: RunBrowser) -> list[str]:
    return [path.parent.name for path in browser.model.shown]


def _cells(browser: RunBrowser, name: str) -> list[str]:
    model, row = browser.model, _names(browser).index(name)
    return [str(model.index(row, column).data() or "") for column in range(1, model.columnCount())]


def test_a_row_has_the_result_the_specimen_and_the_origin_of_a_run(page: ResultsPage) -> None:
    browser = page.browser
    protocol, status, result, specimen, operator, _, folder = _cells(browser, "monday")
    assert (protocol, status, operator, folder) == ("harmonic", "completed", "A. Meyer", "monday")
    assert result == "α₂ 0.2000 ± 0.0040 · ✓ agrees · ω = 16 rad/s, β = 0.4"
    assert specimen == "assumed, 50 × 400 mm, k₁ 213.4 N/m"
    assert _cells(browser, "tuesday")[2] == "α₂ 0.2120 to 0.3100, 2 values"
    tip = browser.model.index(_names(browser).index("tuesday"), 3).data(Qt.ItemDataRole.ToolTipRole)
    assert tip.endswith("rain")


def test_files_that_are_no_runs_are_rows_with_the_reason(page: ResultsPage, folder: Path) -> None:
    browser = page.browser
    assert _cells(browser, "cut")[1] == "damaged"
    assert _cells(browser, folder.name)[1:3] == ["not a run", "this is not an HDF5 file"]
    row = _names(browser).index("cut")
    assert browser.model.index(row, 0).data(Qt.ItemDataRole.CheckStateRole) is None
    browser.table.setCurrentIndex(browser.model.index(row, 2))
    assert not browser.open.isEnabled()
    assert not browser.against.isEnabled()
    browser.table.entered_row.emit(browser.table.currentIndex())
    settle(page)
    assert page.views.currentWidget() is browser
    assert browser.message.text().startswith("▲")
    browser.look()  # as every few seconds
    settle(page)
    assert browser.message.text().startswith("▲")
    browser.search.setText("cut")
    assert not browser.message.text().startswith("▲")


def test_every_word_of_the_search_is_found_anywhere(page: ResultsPage) -> None:
    browser = page.browser
    for text, found in (
        ("meyer harm", ["monday"]),
        ("RAIN", ["tuesday"]),
        ("meyer rain", []),
        ("hdf5", [browser.folder.name]),
        ("  ", None),
    ):
        browser.search.setText(text)
        assert _names(browser) == found or found is None
    assert len(_names(browser)) == 4


def test_the_newest_is_first_until_a_column_is_chosen(page: ResultsPage) -> None:
    browser = page.browser
    # the file was changed before it was begun: the start counts
    assert set(_names(browser)[:2]) == {"monday", "tuesday"}
    browser.table.setCurrentIndex(browser.model.index(_names(browser).index("monday"), 3))
    browser.table.sortByColumn(texts.RUN_TITLES.index("operator"), Qt.SortOrder.DescendingOrder)
    assert _names(browser)[:2] == ["tuesday", "monday"]
    browser.table.sortByColumn(texts.RUN_TITLES.index("operator"), Qt.SortOrder.AscendingOrder)
    assert _names(browser)[-2:] == ["monday", "tuesday"]
    assert browser.selected is not None
    assert browser.selected.found.path.parent.name == "monday", "the selection stays with its run"


def test_a_run_is_opened_ticked_and_made_the_reference(page: ResultsPage, qtbot: QtBot) -> None:
    browser, model = page.browser, page.browser.model
    first, second = (model.index(_names(browser).index(name), 0) for name in ("monday", "tuesday"))
    browser.table.setCurrentIndex(first)
    qtbot.keyClick(browser.table, Qt.Key.Key_Return)
    settle(page)
    assert page.views.currentWidget() is page.view
    assert [file.name for file in page.files.ticked] == ["monday"]
    page.all_runs.click()
    assert page.views.currentWidget() is browser
    model.setData(second, Qt.CheckState.Checked.value, Qt.ItemDataRole.CheckStateRole)
    settle(page)
    assert [file.name for file in page.files.ticked] == ["monday", "tuesday"]
    assert page.views.currentWidget() is browser, "ticking leaves the list open"
    browser.table.setCurrentIndex(second)
    browser.against.click()
    assert [file.name for file in page.files.ticked] == ["tuesday", "monday"]
    assert "reference: tuesday, compared: 1" in browser.message.text()
    assert page.differences.item(0, 0).text() == "monday"
    assert page.files.chosen is not None
    assert page.files.chosen.name == "monday"
    model.setData(first, Qt.CheckState.Unchecked.value, Qt.ItemDataRole.CheckStateRole)
    assert [file.name for file in page.files.ticked] == ["tuesday"]
    assert model.index(_names(browser).index("tuesday"), 3).data(Qt.ItemDataRole.FontRole).bold()
    browser.back.click()
    assert page.views.currentWidget() is page.view


def test_files_of_the_list_are_opened_during_a_run_too(
    page: ResultsPage, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    browser = page.browser
    monkeypatch.setattr(Controller, "running", True)
    browser.table.setCurrentIndex(browser.model.index(_names(browser).index("monday"), 0))
    qtbot.keyClick(browser.table, Qt.Key.Key_Return)
    browser.model.setData(
        browser.model.index(_names(browser).index("tuesday"), 0),
        Qt.CheckState.Checked.value,
        Qt.ItemDataRole.CheckStateRole,
    )
    settle(page)
    assert {file.name for file in page.files.ticked} == {"monday", "tuesday"}


def test_one_key_leads_to_the_list_and_back(page: ResultsPage, qtbot: QtBot) -> None:
    with qtbot.waitActive(page):
        page.activateWindow()
    qtbot.keyClick(page, Qt.Key.Key_F, Qt.KeyboardModifier.ControlModifier)
    qtbot.keyClicks(page.browser.search, "meyer")
    assert _names(page.browser) == ["monday"]
    page._open_run(page.browser.model.shown[0])
    settle(page)
    for view in (page.browser, page.view, page.browser):
        qtbot.keyClick(page, Qt.Key.Key_B, Qt.KeyboardModifier.ControlModifier)
        assert page.views.currentWidget() is view


def test_the_list_follows_a_run_in_progress_without_disturbing_it(
    page: ResultsPage, qtbot: QtBot, tmp_path: Path
) -> None:
    browser = page.browser
    browser.use_folder(tmp_path / "later")
    qtbot.waitUntil(lambda: "does not exist yet" in browser.message.text(), timeout=LONG_MS)
    path, recorder = begun(tmp_path / "later" / "run", operator="C")
    browser.look()
    _wait(browser, qtbot, 1)
    assert _cells(browser, "run")[1] == texts.RUN_GOING
    recorder(PointFinished(point(16.0, 0.3), time=2.0))
    recorder.close("completed", "done")
    with open_datafile(path, judging=True) as record:
        assert (record.status, len(record.points)) == ("completed", 1)
    # the watcher notices further runs
    made(tmp_path / "later" / "next", point(16.0, 0.2))
    qtbot.waitUntil(lambda: browser.model.all == 2, timeout=LONG_MS)
    _wait(browser, qtbot, 2)
    assert _cells(browser, "run")[1] == "completed"


def test_a_file_that_was_not_closed_is_not_shown_as_running(tmp_path: Path) -> None:
    path, recorder = begun(tmp_path / "killed")
    os.utime(path, (1e9, 1e9))
    row = read_row(find_runs(tmp_path)[0])
    recorder.close("stopped", "")
    assert row.cells[1] == texts.RUN_CUT
    assert "rockbench file recover" in row.tips[1]


@pytest.mark.usefixtures("qapp")
def test_a_run_that_was_killed_is_read_again_without_a_change_of_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, recorder = begun(tmp_path / "killed")
    owner = QObject()
    model, found = RunModel(LIGHT, owner), find_runs(tmp_path)
    assert model.use(found) == [*found]
    model.update([read_row(each) for each in found])
    assert model.use(found) == []
    monkeypatch.setattr(run_list, "time", lambda: time() + 2.0 * run_list.RECENT)
    assert model.use(found) == [*found]
    model.update([read_row(each) for each in found])
    assert model.use(found) == []
    recorder.close("stopped", "")
    row = model.row(found[0].path)
    assert row is not None
    assert row.cells[1] == texts.RUN_CUT


@pytest.mark.parametrize(
    ("summary", "shown"),
    [
        ('{"points": [{"alpha_2": 0.4}]}', "α₂ 0.4000 · -"),
        ('{"points": [{"alpha_2": 0.4, "beta": [], "omega_rad_s": {}}]}', "the plan was carried out"),
        ('{"points": 3}', "the plan was carried out"),
        ("nonsense", "the plan was carried out"),
        ("[]", "α₂ 0.2000 ± 0.0040 · ω = 16 rad/s, β = 0.4"),
        ('{"passed": false, "points": []}', texts.RUN_NOT_PASSED),
    ],
)
def test_the_results_of_another_version_are_no_error(one: Path, summary: str, shown: str) -> None:
    one.with_name("summary.json").write_text(summary)
    row = read_row(find_runs(one.parent)[0])
    assert row.usable
    assert row.cells[2] == shown


def test_a_thousand_runs_are_read_in_the_thread_and_pictures_on_demand(
    folder: Path, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = folder / "monday"
    summary = tmp_path / "summary.json"
    summary.write_text(json.dumps({"points": [point(16.0, 0.2).model_dump(mode="json")]}))
    for number in range(1000):
        run = tmp_path / "many" / f"run-{number:04}"
        run.mkdir(parents=True)
        for name in ("campaign.h5", "gain_spectra.png"):
            os.link(source / name, run / name)
        os.link(summary, run / "summary.json")
    threads, pictures = set[int](), list[Path]()

    def read(found: Found) -> RunRow:
        threads.add(threading.get_ident())
        return read_row(found)

    fit = run_model._fitted

    def fitted(path: Path, size: object) -> QImage:
        threads.add(threading.get_ident())
        pictures.append(path)
        return fit(path, size)

    monkeypatch.setattr(run_browser, "read_row", read)
    monkeypatch.setattr(run_model, "_fitted", fitted)
    browser = RunBrowser(LIGHT, tmp_path / "many")
    qtbot.addWidget(browser)
    browser.resize(1000, 600)
    with qtbot.waitExposed(browser):
        browser.show()
    qtbot.waitUntil(lambda: browser.model.all == 1000, timeout=LONG_MS)
    assert len(browser.model.shown) == 1000, "files are listed before they are read"
    qtbot.waitUntil(lambda: len(pictures) > 3, timeout=LONG_MS)
    assert threading.get_ident() not in threads
    assert len(pictures) < 100
    browser.hide()


@pytest.mark.usefixtures("qapp")
def test_threads_read_png_only_and_never_ask_the_plug_in_for_svg(folder: Path, tmp_path: Path) -> None:
    """That plug-in connects signals, which in a thread may stop the program while a widget is deleted."""
    drawn = tmp_path / "drawn.png"
    drawn.write_text('<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"><rect width="9" height="9"/></svg>')
    figure, size = folder / "monday" / "gain_spectra.png", QSize(64, 40)
    assert not run_model.load_pictures([(figure, ())], size)[figure, ()].isNull()
    assert not read_figure(figure).isNull()
    assert run_model.load_pictures([(drawn, ())], size)[drawn, ()].isNull()
    assert read_figure(drawn).isNull()


def test_the_picture_is_the_main_figure_of_the_protocol(folder: Path) -> None:
    row = next(read_row(each) for each in find_runs(folder) if each.path.parent.name == "monday")
    assert row.figure is not None
    assert row.figure.name == "gain_spectra.png"
    image = run_model._fitted(row.figure, run_model.PICTURE)
    assert image.size() == run_model.PICTURE
    assert (image.pixelColor(32, 20).red(), image.pixelColor(32, 2).alpha()) == (255, 0)


def test_the_number_of_listed_files_is_limited(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_list, "MOST", 2)
    assert len(find_runs(folder)) == 2
