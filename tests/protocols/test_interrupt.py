"""Ctrl-C on a real process: the table is ramped down, the file closed as aborted, and the exit code is 130."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from bench.datafile.reader import open_datafile
from tests.patience import LONG, eventually


@pytest.mark.skipif(sys.platform == "win32", reason="sends SIGINT to one process")
def test_ctrl_c(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    command = [sys.executable, "-c", "from bench.app.cli.process import run; run()", "run", "harmonic"]
    # far longer than it takes to interrupt it
    command += ["--omega", "16", "--beta", "0.4", "--starts", "1", "--measured-cycles", "1000", "--out", str(folder)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        _wait_until_running(folder / "campaign.h5", process)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=LONG)
    finally:
        process.kill()
    assert process.returncode == 130
    assert "aborted" in errors
    assert "Traceback" not in errors
    with h5py.File(folder / "campaign.h5", "r") as file:
        assert file["entry/status"][()] == b"aborted"
        drive = file["entry/instrument/drive/voltage"][:]
    assert np.abs(drive).max() > 0.0
    assert drive[-1] == 0.0
    with open_datafile(folder / "campaign.h5") as record:
        reasons = [event.text for event in record.events if event.kind == "StateChanged"]
    assert any("abort requested" in reason for reason in reasons)


@pytest.mark.skipif(sys.platform == "win32", reason="sends SIGINT to one process")
@pytest.mark.seconds
# `tests/bench/app/cli/test_interrupts.py` sends one signal while a run is planned
@pytest.mark.parametrize("times", [pytest.param(1, marks=pytest.mark.soak), 3])
def test_ctrl_c_while_the_run_is_planned(tmp_path: Path, times: int) -> None:
    """The default campaign plans its starts for many seconds, most of them in native code."""
    command = [sys.executable, "-m", "bench", "run", "harmonic", "--out", str(tmp_path / "run")]
    said = tmp_path / "said"
    with said.open("w", encoding="utf-8") as errors:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)
    try:
        eventually(lambda: "planning the starts" in said.read_text(encoding="utf-8"))
        time.sleep(0.3)
        asked = time.monotonic()
        for _ in range(times):
            process.send_signal(signal.SIGINT)
            time.sleep(0.05)
        output, _ = process.communicate(timeout=LONG)
        took = time.monotonic() - asked
    finally:
        process.kill()
    text = said.read_text(encoding="utf-8")
    assert (process.returncode, output) == (130, "")
    assert text.splitlines()[-1].startswith("rockbench: error: interrupted")
    assert "Traceback" not in text
    assert list(tmp_path.iterdir()) == [said]
    # half a second, and what a machine under full load may be late
    assert took < 2.0


def _wait_until_running(path: Path, process: "subprocess.Popen[str]") -> None:
    """Wait until the drive moves the table."""
    deadline = time.monotonic() + LONG
    while time.monotonic() < deadline:
        assert process.poll() is None, process.communicate()
        if path.exists():
            try:
                with open_datafile(path) as record:
                    if record.rows > 20_000:
                        return
            except Exception:  # the file is being laid out
                pass
        time.sleep(0.05)
    raise AssertionError("the run did not start")
