"""kill -9 of `rockbench run` itself, beside the emulated laboratory, which lives on in this process."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from bench.config.model import BenchConfiguration
from bench.config.template import as_toml
from bench.datafile.reader import open_datafile
from bench.results import FILE
from drivers.emulation.control import ask
from drivers.emulation.laboratory import Laboratory
from drivers.hardware.rig import HardwareRig
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.installed import example
from tests.patience import LONG

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="kills processes the POSIX way"),
    pytest.mark.milliseconds,
    pytest.mark.seconds,
]

LATE = 0.5
"""What a busy machine may add to a time-out [s]."""


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BenchConfiguration]:
    site = tmp_path_factory.mktemp("plugins") / "site"
    bench = VirtualBenchParameters(sample_rate=1000.0)
    with example(site, "tone_sweep"), Laboratory(bench, Specimen(), seed=1, connection="analogue") as emulated:
        given = BenchConfiguration(backend="hardware", hardware=emulated.hardware)
        yield given.model_copy(update={"acquisition": given.acquisition.model_copy(update={"lead": 0.4})})


def _until(truth: Callable[[], dict[str, Any]], what: Callable[[dict[str, Any]], bool], patience: float) -> float:
    """Seconds until it is so."""
    begin = time.monotonic()
    while not what(truth()):
        assert time.monotonic() < begin + patience, truth()
        time.sleep(0.005)
    return time.monotonic() - begin


def _armed(truth: dict[str, Any]) -> bool:
    return bool(truth["enabled"])


def _driven(truth: dict[str, Any]) -> bool:
    return _armed(truth) and abs(truth["drive"]) > 0.01


@pytest.mark.parametrize(
    "state",
    ["running", pytest.param("armed", marks=pytest.mark.soak), pytest.param("aborting", marks=pytest.mark.soak)],
)
def test_the_chain_opens_by_itself(state: str, laboratory: BenchConfiguration, tmp_path: Path) -> None:
    hardware = laboratory.hardware
    hands, timeout = hardware.emulator_address, hardware.daq.watchdog
    assert hands is not None
    assert timeout is not None

    def truth() -> dict[str, Any]:
        told: dict[str, Any] = ask(hands, "truth")
        return told

    file = tmp_path / "bench.toml"
    file.write_text(as_toml(laboratory), encoding="utf-8")
    command = [sys.executable, "-m", "bench", "run", "tone-sweep", "--config", str(file)]
    command += ["--yes", "--out", str(tmp_path)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        _until(truth, _armed if state == "armed" else _driven, LONG)
        if state == "aborting":
            process.send_signal(signal.SIGINT)
            time.sleep(laboratory.acquisition.block_duration)
    finally:
        process.kill()
    assert process.wait(LONG) == -signal.SIGKILL
    assert _until(truth, lambda told: not told["enabled"], timeout + LATE) < timeout + LATE
    time.sleep(laboratory.acquisition.lead)
    held = truth()["drive"]
    time.sleep(0.1)
    assert truth()["drive"] == held
    with open_datafile(tmp_path / FILE) as record:
        assert record.status == "running"
    with HardwareRig(hardware, lead=100) as rig:
        assert "rockbench_out" in rig.description["tasks left by another client"]
        assert (truth()["enabled"], truth()["drive"]) == (False, 0.0)
