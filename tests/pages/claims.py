"""Results that the pages quote, computed again: each claim yields the lines which its page must contain.

A number in a page is either the output of a block (`tests.pages.execute`) or part of a claim here; the numbers of
`docs/decisions` and of the tables whose heading names a benchmark are measurements of their day.
"""

import json
import re
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.pages.blocks import ROOT
from tests.pages.execute import collection, command_here

CORNERS = (0.5, 1.0, 1.5, 2.0)
"""Lower ends of the table's band in the table of docs/predict.md [Hz]."""

STIFFNESSES = (0.25, 0.64, 0.97)

MOTIONS = {
    "Pacoima": "RSN77_SFERN_PUL164.AT2",
    "Erzincan": "ERZIKAN_NS_EW_cms2_dt0.005.txt@column=1,dt=0.005,unit=cm/s2",
    "El Centro": "IELC180_oldPEER.AT2",
    "L'Aquila": "AQV_20090406_ITACA16837_H2_WE.cor.acc",
    "Newhall": "RSN1044_NORTHR_NWH360.AT2",
    "Kobe": "RSN1119_KOBE_TAZ000.csv@unit=g",
}
"""The recorded motions of the paper that are available, as arguments of the command line."""


@dataclass(frozen=True)
class Claim:
    """Results quoted in `page`: `compute` yields them as the page must state them."""

    page: str
    compute: Callable[[], Iterator[str]]
    slow: bool = False
    records: bool = False
    """Whether the recorded ground motions are needed."""

    @property
    def name(self) -> str:
        """Name for messages and test parameters."""
        return f"{self.page}:{self.compute.__name__.strip('_')}"

    def missing(self) -> list[str]:
        """The computed results that the page does not contain."""
        text = " ".join((ROOT / self.page).read_text(encoding="utf-8").split())
        return [line for line in self.compute() if " ".join(line.split()) not in text]


def rockbench(*arguments: str) -> dict[str, Any]:
    """The JSON object that a command prints. Raises RuntimeError with its last line when it fails."""
    with tempfile.TemporaryDirectory() as folder:
        done = command_here([*arguments, "--json"], Path(folder))
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip().splitlines()[-1])
    return json.loads(done.stdout)


def _band_table() -> Iterator[str]:
    """Gain under six records against the lower end of the table's band."""
    folder = collection()
    assert folder is not None
    betas = [f"{beta:g}" for beta in STIFFNESSES]
    for name, source in MOTIONS.items():
        record = str(folder / source)
        whole = rockbench("predict", "seismic", record, "--table-band", "none", "--beta", *betas)
        corners = [f"{corner:g}" for corner in CORNERS]
        cut = rockbench("predict", "band-study", record, "--corner", *corners, "--beta", *betas)
        cells = [_gains(whole["gains"])]
        cells += [_gains([row for row in cut["gains"] if row["band_low_hz"] == corner]) for corner in CORNERS]
        yield f"| {name} | {' | '.join(cells)} |"


def _gains(rows: list[dict[str, Any]]) -> str:
    ordered = sorted(rows, key=lambda row: row["beta"])
    return " / ".join("T" if row["toppled"] else f"{row['alpha_2']:.2f}" for row in ordered)


def _replication() -> Iterator[str]:
    """Error of the table, in what repeats, after the passes that a recorded motion takes on the simulated bench."""
    folder = collection()
    assert folder is not None
    record = str(folder / MOTIONS["Pacoima"])
    found = rockbench("run", "earthquake", record, "--beta", "0.25", "--yes", "--out", "run")
    (point,) = found["points"]
    error = re.search(r"an error of ([\d.]+)% rms", point["reason"])
    assert error is not None, point["reason"]
    yield f"Pacoima, 1 to 100 Hz: {error[1]} % rms after {point['passes']} passes"


CLAIMS = (
    Claim("docs/predict.md", _band_table, records=True),
    Claim("README.md", _replication, slow=True, records=True),
    Claim("docs/identify.md", _replication, slow=True, records=True),
)
