"""Data files of the first edition, one of each protocol: opened, verified, replayed, analysed, reported, exported.

Without `-m soak` all are opened and verified, all but the longest are replayed (`test_results` carries these out anew),
and some are put through the rest as well.
"""

import json
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import h5py
import pytest

from tests.first_edition.command import (
    DATA,
    OF_CALIBRATION,
    OF_CALIBRATION_RATIOS,
    Rockbench,
    differences,
    rounded,
    rounded_elsewhere,
)

pytestmark = pytest.mark.usefixtures("shared_results")

NAMES = sorted(path.name.removesuffix(".h5.xz") for path in DATA.glob("*.h5.xz"))
LONGEST = {"harmonic_springs", "coupling_stiffness"}
QUICK = {"check", "free_rocking", "identify"}
PROTOCOLS = {
    "check",
    "coupling-stiffness",
    "earthquake",
    "free-rocking",
    "free-vibration",
    "harmonic",
    "identify",
    "laser-calibration",
}


@pytest.fixture
def file(request: pytest.FixtureRequest, unpacked: Callable[[str], Path]) -> Path:
    return unpacked(request.param)


def of(always: Iterable[str]) -> pytest.MarkDecorator:
    """Every file; those that are not named only with `-m soak`."""
    cases = [pytest.param(name, marks=() if name in always else pytest.mark.soak) for name in NAMES]
    return pytest.mark.parametrize("file", cases, indirect=True)


def recorded(file: Path) -> dict[str, Any]:
    """What the run printed when the file was written."""
    return json.loads((DATA / f"{file.stem}.json").read_text(encoding="utf-8"))


def test_every_protocol_has_a_file() -> None:
    assert {recorded(Path(f"{name}.h5"))["protocol"] for name in NAMES} == PROTOCOLS


@of(NAMES)
def test_it_is_opened_and_verified(file: Path, rockbench: Rockbench) -> None:
    info = rockbench("file", "info", file)
    assert info.code == 0, info.err
    assert re.search(rf"^protocol +{recorded(file)['protocol']}$", info.out, re.MULTILINE)
    verified = rockbench("file", "verify", file)
    assert verified.code == 0, verified.err
    with h5py.File(file) as content:
        count = len(content["entry/checksums/dataset"])
    assert f"{count} of {count} datasets" in verified.out


@of({*NAMES} - LONGEST)
def test_it_is_replayed_bit_for_bit(file: Path, rockbench: Rockbench, same_arithmetic: bool) -> None:
    done = rockbench("replay", file, "--json")
    found = json.loads(done.out)
    assert "hardware.lasers.listening (now hardware.lasers.observation_time)" in done.err
    with h5py.File(file) as content:
        samples = len(content["entry/instrument/drive/voltage"])
        points = len(next(iter(content["entry/points"].values())))
        events = len(content["entry/events/time"])
    assert (found["status"], found["breaks_off"]) == ("completed", None)
    assert found["samples"] == {"played": samples, "recorded": samples}
    compared = found["compared"]
    assert (compared["drive samples"], compared["journal entries"], compared["points"]) == (samples, events, points)
    if same_arithmetic:
        # the drive and the journal to the last bit; predictions and the model are computed with fused operations today
        rounded = {
            each["text"].partition(" differ by at most ")[0] for each in found["differences"] if each["rounding"]
        }
        assert rounded <= {"points", "estimates", "running gains", "twin"}
        # the delays of lasers are estimated in another way today (`command.OF_DELAY`)
        others = [each["text"].partition(" was ")[0] for each in found["differences"] if not each["rounding"]]
        rows = [*enumerate(recorded(file)["points"], 1)]
        delays = [f"row {row} of points: measured" for row, line in rows if line.get("what", "").startswith("delay ")]
        # and so are the errors of lasers in a calibration; `test_results` bounds the differences
        calibrated = {
            f"row {row} of points: {key}"
            for row, line in rows
            if "scale_uncertainty" in line
            for key in (*OF_CALIBRATION, *OF_CALIBRATION_RATIOS)
        }
        assert [each for each in others if each not in calibrated] == delays, found["differences"]
        assert len(rounded) + len(others) == len(found["differences"]), found["differences"]
        assert found["agrees"] is not bool(others)
        assert done.code == bool(others), done.err


@of(QUICK)
def test_it_is_analysed_again(file: Path, rockbench: Rockbench, same_arithmetic: bool, tmp_path: Path) -> None:
    again = tmp_path / "again.h5"
    done = rockbench("analyse", file, "--json", "--out", again)
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["recorded"] == recorded(file)["points"]
    assert len(found["points"]) == len(found["recorded"])
    share = rounded if same_arithmetic else rounded_elsewhere
    assert not sorted(differences(found["recorded"], found["points"], share=share))
    assert rockbench("file", "verify", again).code == 0


# the report of `check` is read by `test_inventory`, section by section; `test_visible_text` makes one of every file
@of({"identify"})
def test_it_is_reported(file: Path, rockbench: Rockbench, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    done = rockbench("report", file, "--html", page)
    assert done.code == 0, done.err
    text = page.read_text(encoding="utf-8")
    assert text.rstrip().endswith("</html>")
    assert text.count("<table") >= 2
    assert "<svg" in text or "<img" in text


# `test_inventory` exports `check`
@of({"free_rocking"})
@pytest.mark.parametrize("format", ["mat", "csv", "uff", "parquet"])
def test_it_is_exported(file: Path, format: str, rockbench: Rockbench, tmp_path: Path) -> None:
    folder = tmp_path / "exported"
    done = rockbench("export", file, "--to", format, "--out", folder)
    assert done.code == 0, done.err
    assert not (folder / "DAMAGED.txt").exists()
    with h5py.File(file) as content:
        runs = len(set(content["entry/instrument/blocks/run"][:]))
    assert len(list(folder.glob(f"run-[0-9]*.{format}"))) == runs
