"""Files side by side: what is drawn and said is what the files hold, and nothing is overwritten."""

import re
import shutil
from collections.abc import Generator
from math import isnan, nan
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QDesktopServices, QImage
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from scipy.io import loadmat

from bench.app.display import texts
from bench.app.display.gains import compare
from bench.app.gui.outputs import free
from bench.app.gui.results_page import ResultsPage
from bench.app.ipc.messages import Ended
from protocols.harmonic.protocol import PointStatus
from tests.bench.app.gui.run_files import close_files, counts, made, point, settle, show
from tests.bench.app.gui.shared_window import page_alone
from tests.patience import LONG_MS


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("results")
    return (
        made(folder / "monday", point(16.0, 0.200), point(17.0, None)),
        made(folder / "tuesday", point(16.0, 0.212, 0.003), point(15.0, 0.31)),
    )


@pytest.fixture(scope="module")
def verdicts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A point that agrees with its prediction, one that does not, and one that fell."""
    told = {"alpha_2_predicted": 0.199, "alpha_2_predicted_uncertainty": 0.002, "agrees": True}
    parts = '{"laser_scale": 0.001, "clock": 0.0005}'
    good = point(16.0, 0.2).model_copy(update={**told, "uncertainty_parts": parts})
    off = point(17.0, 0.3).model_copy(update={**told, "agrees": False, "status": PointStatus.MODULATED})
    return made(tmp_path_factory.mktemp("verdicts") / "wednesday", good, off, point(18.0, None))


@pytest.fixture(scope="module")
def one_page(qapp: QApplication) -> Generator[ResultsPage]:  # noqa: ARG001 - Qt needs its application
    with page_alone(ResultsPage, 700) as shown:
        shown.show()
        yield shown


@pytest.fixture
def page(one_page: ResultsPage) -> Generator[ResultsPage]:
    """The page without a file: those that a test opens are taken away again."""
    one_page.show_run()
    one_page.parts.setCurrentIndex(0)
    yield one_page
    close_files(one_page)
    one_page.everything.setChecked(False)


def test_differences_are_set_against_both_uncertainties() -> None:
    first = [point(16.0, 0.200).model_dump(), point(17.0, None).model_dump()]
    second = [point(16.0, 0.212, 0.003).model_dump(), point(15.0, 0.31).model_dump()]
    one, fallen, alone = compare(first, second)
    assert one.value == pytest.approx(0.012)
    assert one.uncertainty == pytest.approx(0.005)  # 3-4-5
    assert one.score == pytest.approx(2.4)
    assert (fallen.reference, fallen.other, isnan(fallen.value), isnan(fallen.score)) == (None, None, True, True)
    assert (alone.reference, alone.other, isnan(alone.uncertainty)) == (None, 0.31, True)
    modulated = [point(15.0, 0.86, 0.004).model_copy(update={"status": PointStatus.MODULATED}).model_dump()]
    (free,) = compare(modulated, [modulated[0] | {"alpha_2": 0.89}])
    # how much the largest drift varies from test to test is not stated
    assert (free.value, isnan(free.score)) == (pytest.approx(0.03), True)
    records = [{"record": "Kobe", "beta": b, "alpha_2": a, "alpha_2_uncertainty": nan} for b, a in ((0.4, 0.8),)]
    assert compare(records, records)[0].point == "Kobe, β = 0.4"


def test_every_point_has_its_verdict_in_six_columns(page: ResultsPage, verdicts: Path) -> None:
    show(page, verdicts)

    def cells(row: int) -> list[str]:
        items = [page.table.item(row, column) for column in range(page.table.columnCount())]
        return [item.text() for item in items if item is not None]

    assert page.table.columnCount() == 6
    first = cells(0)
    assert first[:4] == ["ω = 16 rad/s, β = 0.4", "α₂", "0.2000 ± 0.0040", "0.1990 ± 0.0020"]
    assert first[4].startswith("+0.001")
    assert "+0.5 %" in first[4]
    assert first[5] == "✓ agrees"
    assert cells(1)[5] == "modulated, ▲ DISAGREES"
    assert cells(2)[5] == "overturned"
    page.everything.setChecked(True)
    headings = [page.table.horizontalHeaderItem(column).text() for column in range(page.table.columnCount())]
    shown = [*headings, *(text for row in range(3) for text in cells(row))]
    assert not [text for text in shown if re.search(r"[a-z0-9]_[a-z0-9]|[{}]|m/s2|\+-", text)]
    assert "ω [rad/s]" in headings
    assert any("laser scale 0.001; clock 0.0005" in text for text in shown)


def test_the_verdict_of_the_run_is_above_its_points(page: ResultsPage, verdicts: Path, tmp_path: Path) -> None:
    told = {"alpha_2_predicted": 0.199, "alpha_2_predicted_uncertainty": 0.002, "agrees": True}
    good = point(16.0, 0.2).model_copy(update=told)
    show(page, made(tmp_path / "one", good))
    assert page.verdict.text().startswith("α₂ 0.2000 ± 0.0040 · predicted 0.1990 ± 0.0020")
    assert "✓ agrees" in page.verdict.text()
    show(page, verdicts)
    expected = "1 of 2 compared results agree with the prediction · ▲ DISAGREES: α₂ at ω = 17 rad/s, β = 0.4"
    assert page.verdict.text() == expected
    show(page, made(tmp_path / "none", point(18.0, None)))
    assert page.verdict.isHidden()


def test_a_file_has_the_figures_of_its_folder(page: ResultsPage, files: tuple[Path, Path], tmp_path: Path) -> None:
    path = shutil.copy(files[0], tmp_path / "campaign.h5")
    image = QImage(200, 100, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.red)
    image.save(str(path.with_name("gain_spectra.png")))
    show(page, path)
    page.parts.setCurrentWidget(page.figures)
    assert [page.figures.choice.itemText(row) for row in range(page.figures.choice.count())] == ["gain spectra"]
    shown = page.figures.picture.pixmap()
    assert shown.width() == pytest.approx(2 * shown.height(), abs=2)
    page.files.remove_chosen()
    settle(page)
    assert page.figures.picture.text() == texts.NO_FIGURE


def test_the_normalised_errors_are_below_the_figure(
    page: ResultsPage, files: tuple[Path, Path], tmp_path: Path
) -> None:
    told = {"alpha_2_predicted": 0.199, "alpha_2_predicted_uncertainty": 0.003, "agrees": True}
    good = point(16.0, 0.2).model_copy(update=told)
    off = point(17.0, 0.189).model_copy(update={**told, "agrees": False})
    show(page, made(tmp_path / "scored", point(15.0, 0.3), good, off, point(18.0, None)))
    page.show_run()
    page.parts.setCurrentWidget(page.figures)
    strip = page.figures.scores
    assert strip.isVisible()
    # 3-4-5: the combined uncertainty is 0.005; the first point has no prediction, the last one no value
    assert [(row, score) for row, score, _ in strip.scores] == [(2, pytest.approx(0.2)), (3, pytest.approx(-2.0))]
    assert strip.scores[1][2] == "3: α₂, ω = 17 rad/s, β = 0.4: Eₙ = -2"
    assert list(strip._points.getData()[1]) == [pytest.approx(0.2), pytest.approx(-2.0)]
    assert strip._item.viewRange()[1][0] < -2.0
    cells = [page.table.item(row - 1, 0).text() for row, _, _ in strip.scores]
    assert cells == ["ω = 16 rad/s, β = 0.4", "ω = 17 rad/s, β = 0.4"]
    show(page, files[1])
    assert strip.isHidden()


def test_two_files_are_drawn_together_and_compared(page: ResultsPage, files: tuple[Path, Path]) -> None:
    for path in files:
        show(page, path)
    assert page.gains.measured == [(16.0, 0.2), (16.0, 0.212), (15.0, 0.31)]
    assert page.gains.bands == 1
    assert [file.name for file in page.files.ticked] == ["monday", "tuesday"]
    assert page.table.rowCount() == 2
    cells = [page.differences.item(0, column).text() for column in range(8)]
    assert cells == ["tuesday", "ω = 16 rad/s, β = 0.4", "0.2000", "0.2120", "0.01200", "0.005000", "2.400", "▲ BEYOND"]
    assert page.differences.rowCount() == 3
    page.files.remove_chosen()
    settle(page)
    assert page.gains.measured == [(16.0, 0.2)]
    assert page.differences.rowCount() == 0
    assert "monday" in page.message.text()


def test_a_run_that_ends_takes_nobodys_comparison_away(
    page: ResultsPage, files: tuple[Path, Path], verdicts: Path
) -> None:
    show(page, files[0])
    page.show_end(Ended("completed", "the plan was carried out", {}, "", files[1].parent))
    settle(page)
    assert [file.name for file in page.files.ticked] == ["tuesday"], "one file is no comparison"
    page.files.item(0).setCheckState(Qt.CheckState.Checked)
    chosen, before = page.files.chosen, page.gains.measured
    page.show_end(Ended("aborted", "abort requested", {}, "", verdicts.parent))
    settle(page)
    assert [file.name for file in page.files.ticked] == ["monday", "tuesday"]
    assert (page.files.chosen, page.gains.measured, page.files.count()) == (chosen, before, 3)
    assert "abort requested" in page.message.text()
    page.files.item(2).setCheckState(Qt.CheckState.Checked)
    assert page.gains.measured[-1] == (17.0, 0.3)


def test_a_path_may_be_typed_and_a_wrong_one_changes_nothing(page: ResultsPage, files: tuple[Path, Path]) -> None:
    page.path.setText(f'"{files[0]}"')
    page.path.returnPressed.emit()
    settle(page)
    assert page.files.count() == 1
    page.path.setText(str(files[0].with_name("none.h5")))
    page.path.returnPressed.emit()
    settle(page)
    assert "there is no such file" in page.message.text()
    assert page.files.count() == 1


def test_export_and_report_are_those_of_the_command_line(
    page: ResultsPage, files: tuple[Path, Path], qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = files[0].parent
    (folder / "campaign-mat").mkdir()
    show(page, files[0])
    outputs = page.outputs
    outputs.export.click()
    assert not outputs.export.isEnabled()
    qtbot.waitUntil(outputs.open_made.isVisible, timeout=LONG_MS)
    assert outputs.message.text() == texts.MADE.format(path=folder / "campaign-mat-2")
    made = next((folder / "campaign-mat-2").glob("*run*1*.mat"))
    np.testing.assert_allclose(np.ravel(loadmat(made)["laser_1"]), 1e-6 * counts(1)[:, 1], rtol=1e-9)
    opened: list[QUrl] = []
    monkeypatch.setattr(QDesktopServices, "openUrl", opened.append)
    outputs.open_made.click()
    assert Path(opened[0].toLocalFile()) == folder / "campaign-mat-2"
    assert not list((folder / "campaign-mat").iterdir())


def test_what_cannot_be_made_says_why(page: ResultsPage, files: tuple[Path, Path], qtbot: QtBot) -> None:
    show(page, files[0])
    page.outputs.use(files[0].with_name("none.h5"))
    page.outputs.report.click()
    qtbot.waitUntil(page.outputs.report.isEnabled, timeout=LONG_MS)
    assert "there is no such file" in page.outputs.message.text()
    assert not page.outputs.open_made.isVisible()


def test_a_free_name_is_taken(tmp_path: Path) -> None:
    wanted = tmp_path / "campaign.report.html"
    assert free(wanted) == wanted
    wanted.touch()
    (tmp_path / "campaign.report-2.html").touch()
    assert free(wanted) == tmp_path / "campaign.report-3.html"
