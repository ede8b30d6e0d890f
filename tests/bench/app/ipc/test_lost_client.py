"""A client that is killed, frozen or closed: the run ramps out, its file is whole and says why."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from bench.datafile.inspection import verify
from bench.datafile.reader import DataFile, open_datafile
from bench.results import FILE
from tests.faults.setup import RAMPS, RATE
from tests.patience import LONG

ROOT = Path(__file__).parents[4]

posix = pytest.mark.skipif(os.name != "posix", reason="kills and freezes processes the POSIX way")


@contextmanager
def lone_client(out: Path, *flags: str) -> Generator[tuple[subprocess.Popen[str], int], None, None]:
    """A client in a process of its own whose run is driving the table, and the process of the session."""
    command = [sys.executable, "-m", "tests.bench.app.ipc.lone_client", str(out), *flags]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as client:
        assert client.stdout is not None
        try:
            session = int(client.stdout.readline())
            while (state := client.stdout.readline().strip()) != "running":
                assert state, "the client ended early"
            yield client, session
        finally:
            client.kill()


def gone(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    # an orphan whose new parent does not reap stays in the table of processes
    state = Path(f"/proc/{process}/stat")
    return state.exists() and state.read_text().rpartition(")")[2].split()[0] == "Z"


def wait(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + LONG
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def ramped_out(record: DataFile) -> None:
    """The last of the drive is a ramp of the asked length to zero, without a step."""
    drive = record.drive()
    assert drive[-1] == 0.0
    ramp = round(RAMPS.stop * RATE)
    driven = np.flatnonzero(drive)[-1]
    before = np.abs(drive).max()
    assert before > 0.01
    assert np.abs(drive[driven - 2 * ramp : driven - ramp]).max() > 0.5 * before
    assert np.abs(np.diff(drive[driven - ramp :])).max() < 0.1 * before
    assert np.abs(drive[driven - ramp // 4 :]).max() < 0.2 * before


@posix
@pytest.mark.parametrize(
    ("sent", "why"),
    [(signal.SIGKILL, "the client has disconnected"), (signal.SIGSTOP, "the client has been silent for 3 s")],
)
def test_a_run_without_its_client_ramps_out(sent: signal.Signals, why: str, tmp_path: Path) -> None:
    with lone_client(tmp_path / "run") as (client, session):
        time.sleep(1.0)  # beyond the start of the sine
        client.send_signal(sent)
        wait(lambda: gone(session))
        assert (client.poll() is None) == (sent == signal.SIGSTOP)
    assert verify(tmp_path / "run" / FILE).problems == ()
    with open_datafile(tmp_path / "run" / FILE) as record:
        assert record.status == "stopped"
        assert record.summary == f"{why}, and the run was not set to continue without a client"
        assert record.end_time
        ramped_out(record)
    assert (tmp_path / "run" / "summary.json").exists()


@posix
def test_a_run_that_was_told_to_go_on_goes_on(tmp_path: Path) -> None:
    with lone_client(tmp_path / "run", "go on") as (client, session):
        client.kill()
        wait(lambda: gone(session))
    with open_datafile(tmp_path / "run" / FILE) as record:
        assert (record.status, record.summary, len(record.points)) == ("completed", "the plan was carried out", 1)
