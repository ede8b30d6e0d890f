"""Pictures of the pages, made again by the commands that the pages name."""

import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from matplotlib.testing.compare import compare_images

from bench.datafile.reader import open_datafile
from bench.figures.style import write_figure
from protocols.common.sine.holding import HoldCycle
from protocols.harmonic.report_hold import hold_figure
from tests.pages.blocks import ROOT
from tests.pages.execute import process

TOLERANCE = 3.0
"""Largest root mean square difference of the pixels, of 255: anti-aliasing and fonts, not another curve."""


@dataclass(frozen=True)
class Picture:
    """A picture in `page` and what makes it: `make` leaves the file in a folder and returns its path."""

    page: str
    path: str
    make: Callable[[Path], Path]
    repeats: bool = True
    """Whether it is the same each time; a window in the middle of a run is not, and is only made again."""

    def difference(self, *, write: bool) -> str | None:
        """How the picture of the page differs from the one that is made now; None when it does not."""
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            made = self.make(Path(folder))
            if write:
                shutil.copy(made, ROOT / self.path)
            if write or not self.repeats:
                return None
            shown = Path(folder) / "shown.png"
            shutil.copy(ROOT / self.path, shown)
            text = compare_images(str(made), str(shown), tol=TOLERANCE)
        return None if text is None else f"{self.path} differs from the one made now: {' '.join(text.split()[:12])}"


def _figure(name: str, *arguments: str) -> Callable[[Path], Path]:
    """A figure that a run leaves in its folder."""
    return _made_by(f"run/{name}", "run", *arguments, "--yes", "--out", "run")


def _plot(name: str, *arguments: str) -> Callable[[Path], Path]:
    """The figure of a prediction."""
    return _made_by(name, "predict", *arguments, "--plot", name)


def _made_by(path: str, *arguments: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        done = process([sys.executable, "-m", "bench", *arguments], folder)
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip().splitlines()[-1])
        return folder / path

    return make


def _window(name: str) -> Callable[[Path], Path]:
    """A picture of the operator's window while the virtual bench runs."""

    def make(folder: Path) -> Path:
        done = process([sys.executable, "-m", "tests.bench.app.gui.screenshots", str(folder)], ROOT)
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip().splitlines()[-1])
        return folder / name

    return make


def _hold(folder: Path) -> Path:
    """The figure of a hold."""
    options = ("harmonic", "--omega", "15", "--beta", "0.97", "--settle-limit", "40")
    _figure("campaign.h5", *options)(folder)
    with open_datafile(folder / "run" / "campaign.h5") as record:
        figure = hold_figure(record.columns_of(HoldCycle), 15.0, 0.97)
    write_figure(folder / "hold.png", figure)
    return folder / "hold.png"


PICTURES = (
    Picture("README.md", "docs/images/gain_spectra.png", _figure("gain_spectra.png", "harmonic")),
    Picture("docs/identify.md", "docs/images/table_response.png", _figure("table_response.png", "identify")),
    Picture("docs/free-rocking.md", "docs/images/free_rocking.png", _figure("free_rocking.png", "free-rocking")),
    Picture(
        "docs/predict.md",
        "docs/images/attractor.png",
        _plot("attractor.png", "attractor", "--omega", "14:15.6:65", "--beta", "0.97", "--members", "0"),
    ),
    Picture("docs/harmonic.md", "docs/images/hold.png", _hold),
    Picture("docs/stability.md", "docs/images/stability.png", _figure("stability.png", "stability")),
    *(
        Picture("docs/window.md", f"docs/images/{name}", _window(name), repeats=False)
        for name in ("window-run.png", "window-queue.png", "window-compare.png")
    ),
)
