"""Data files of harmonic campaigns with known points and samples, as the recorder writes them."""

from pathlib import Path

import numpy as np
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget

from bench.app.gui.background import Reader
from bench.app.gui.results_page import ResultsPage
from bench.config.model import BenchConfiguration
from bench.datafile.recorder import Recorder
from bench.datafile.tables import Column
from bench.events import Acquired, PointFinished
from drivers.clock import now
from drivers.rig import Block, Channel
from protocols.harmonic.protocol import HarmonicPoint, PointStatus
from tests.patience import LONG

RATE, N = 1000.0, 4000
CHANNELS = (
    Channel("table_acceleration", "acceleration", "m/s2", 1e-3, 0.0, (-32_000, 32_000), "made"),
    Channel("laser_1", "displacement", "m", 1e-6, 0.0, (-32_000, 32_000), "made"),
)


def point(omega: float, alpha_2: float | None, spread: float = 0.004) -> HarmonicPoint:
    """A point with its expanded uncertainty; fallen without a gain."""
    status = PointStatus.OVERTURNED if alpha_2 is None else PointStatus.STEADY
    return HarmonicPoint(
        omega_rad_s=omega, beta=0.4, status=status, layer="rocking", alpha_2=alpha_2, alpha_2_uncertainty=spread
    )


def counts(seed: int) -> np.ndarray:
    """Counts of both channels in run `seed`, shape (N, 2)."""
    return np.random.default_rng(seed).integers(-30_000, 30_000, (N, 2)).astype(np.int16)


def made(folder: Path, *points: HarmonicPoint, **about: str) -> Path:
    """The file of a completed campaign in the new `folder`, with the metadata `about`."""
    path, recorder = begun(folder, **about)
    for each in points:
        recorder(PointFinished(each, time=2.0))
    recorder.close("completed", "the plan was carried out")
    return path


def close_files(page: ResultsPage) -> None:
    """Take all files off the Results page, without a look at those that remain after each."""
    settle(page)
    files = page.files
    files.blockSignals(True)
    files._files.clear()
    files.clear()
    files.blockSignals(False)
    files.chosen_changed.emit()
    files.ticked_changed.emit()
    settle(page)


def begun(folder: Path, **about: str) -> tuple[Path, Recorder]:
    """A file with samples that is still open, and its recorder."""
    folder.mkdir(parents=True)
    omega = np.array([15.0, 16.0, 17.0])
    prediction = {
        "omega": Column(omega, "rad/s", ""),
        "beta": Column(np.full(3, 0.4), "1", ""),
        "alpha_2": Column(np.array([0.3, 0.2, 0.4]), "1", ""),
        "alpha_2_low": Column(np.array([0.28, 0.19, 0.38]), "1", ""),
        "alpha_2_high": Column(np.array([0.32, 0.22, 0.43]), "1", ""),
        "layer": Column(np.array(["rocking"] * 3), "", ""),
    }
    path = folder / "campaign.h5"
    metadata = {"configuration": BenchConfiguration().model_dump_json(), "protocol": "harmonic", **about}
    recorder = Recorder(
        path, channels=CHANNELS, sample_rate=RATE, point_type=HarmonicPoint, metadata=metadata,
        tables={"prediction": prediction},
    )  # fmt: skip
    for run in (1, 2):
        for first in range(0, N, 500):
            block = Block(first, counts(run)[first : first + 500])
            recorder(Acquired(run, block, np.full(500, 0.1 * run), time=first / RATE))
    return path, recorder


def show(page: ResultsPage, *paths: Path) -> None:
    """Open files on the page, and wait until they are shown."""
    for path in paths:
        page.show_file(path)
    settle(page)


def settle(shown: QWidget) -> None:
    """Wait until everything that the page reads has been read."""
    end = now() + LONG
    while any(reader.busy for reader in shown.findChildren(Reader)):
        assert now() < end
        QTest.qWait(5)
