"""Results of an opened run become values of the next one, and the configuration can be used again."""

import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from bench.analysis.laser_calibration import LaserCalibration, LaserCurve
from bench.app.display import texts
from bench.app.gui.window import Window
from bench.config.result_files import write_calibration, write_specimen
from bench.control.table_model import TableModel
from bench.results import FILE
from sim.identified import Finding, Identified
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.gui.run_files import made, point, settle
from tests.bench.app.ipc.experiment import bench, order

pytestmark = pytest.mark.usefixtures("without_live_plots", "spoken")

NOW = datetime.now(UTC)
CURVE = LaserCurve(
    sensor="simulated", lowest=-0.04, highest=0.04, rest=0.0, error=(0.0, 1e-5), uncertainty=1e-6, scale=1.001,
    delay=6e-4, delay_uncertainty=1e-6,
)  # fmt: skip


def _table_model(sample_rate: float, date: datetime = NOW) -> TableModel:
    lines = tuple(np.linspace(0.5, 30.0, 20).tolist())
    names = ("real", "imaginary", "uncertainty", "distortion", "coherence", "noise")
    values = dict.fromkeys(names, (1.0,) * 20)
    return TableModel(date=date, specimen="bare frame", sample_rate=sample_rate, level=0.1, frequency=lines, **values)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a run with a result of every kind."""
    path = made(tmp_path_factory.mktemp("results") / "identified", point(16.0, 0.2))
    found = Finding(name="k1", value=201.5, standard_uncertainty=1.5, source="free vibration", date=NOW)
    write_specimen(path.with_name("specimen.json"), Identified(findings=(found,)))
    calibration = LaserCalibration(
        date=NOW, valid_days=365.0, laser_1=CURVE, laser_2=CURVE, **_further_fields(LaserCalibration)
    )
    write_calibration(path.with_name("laser_calibration.json"), calibration)
    _table_model(bench().sample_rate).write(path.with_name("table_model.json"))
    return path.parent


@pytest.fixture
def run(results: Path, tmp_path: Path) -> Path:
    """The file of such a run, of the test's own."""
    return Path(shutil.copytree(results, tmp_path / "identified"), FILE)


def _further_fields(model: type[LaserCalibration]) -> dict[str, float]:
    known = {"date", "valid_days", "laser_1", "laser_2"}
    return {name: 1.0 for name, each in model.model_fields.items() if each.is_required() and name not in known}


def test_every_result_of_a_run_can_be_used_and_given_back(window: Window, run: Path) -> None:
    reuse, setup = window.results.reuse, window.setup
    window.pages.setCurrentWidget(window.results)
    assert reuse.isHidden()
    window.results._open_run(run)
    settle(window.results)
    kinds = [reuse.choice.itemText(k) for k in range(reuse.choice.count())]
    assert [each.partition(" (")[0] for each in kinds] == ["specimen", "table model", "laser calibration"]
    before = setup.configuration
    for row in range(3):
        reuse.choice.setCurrentIndex(row)
        reuse.use_it.click()
    used = setup.configuration
    assert used.known_specimen.frame.k1 == 201.5
    assert used.table_model == str(run.with_name("table_model.json").absolute())
    assert used.calibrated is not None
    assert used.calibrated.laser_1 == CURVE
    for name in ("specimen.json", "table_model.json", "laser_calibration.json"):
        assert f"identified/{name}" in reuse.message.text()
        assert str(run.with_name(name)) in setup.source.text()
    assert window.runner.configuration is used
    window.protocol.check_plan()
    assert ScriptedClient.latest.assignment.configuration.known_specimen.frame.k1 == 201.5
    reuse.back.click()
    assert setup.configuration == before
    assert window.runner.configuration == before
    assert not reuse.message.text()
    assert reuse.back.isHidden()


def test_an_unsuitable_result_is_refused_with_its_reason(window: Window, run: Path) -> None:
    reuse, setup = window.results.reuse, window.setup
    window.results._open_run(run)
    settle(window.results)
    path = run.with_name("table_model.json")
    for model, why in (
        (_table_model(setup.configuration.sample_rate, NOW - timedelta(days=2)), "identif"),
        (_table_model(0.5 * setup.configuration.sample_rate), "sample"),
    ):
        path.unlink()
        model.write(path)
        reuse.choice.setCurrentIndex(1)
        reuse.use_it.click()
        assert why in reuse.message.text()
        assert "stays in use" in reuse.message.text()
        assert setup.configuration.table_model is None
    run.with_name("specimen.json").write_text("{}")
    reuse.choice.setCurrentIndex(0)
    reuse.use_it.click()
    assert "specimen file" in reuse.message.text()
    assert setup.configuration.identified is None
    # what is in use is shown beside the refusal, which ends with the choice of another run
    assert texts.VIRTUAL in setup.source.text()
    reuse.use(None)
    assert reuse.message.text() == ""


def test_nothing_is_changed_during_a_run(window: Window, run: Path) -> None:
    reuse, controller = window.results.reuse, window._controller
    window.results._open_run(run)
    settle(window.results)
    controller.start(order(run.parent / "next"))
    assert not reuse.use_it.isEnabled()
    reuse._want()
    assert window.setup.configuration.identified is None
    assert reuse.use_it.toolTip() == "a run is under way"


def test_a_run_without_results_offers_none(window: Window, results: Path, tmp_path: Path) -> None:
    window.results._open_run(Path(shutil.copy(results / FILE, tmp_path)))
    settle(window.results)
    assert window.results.files.count() == 1
    assert window.results.reuse.isHidden()
