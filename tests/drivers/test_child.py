"""Child processes outlive the requests to end that reach the whole group, and end with the program."""

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from importlib import reload
from pathlib import Path
from typing import Any

import pytest

from bench.app.ipc import client
from bench.app.ipc.client import SessionClient
from drivers import child
from drivers.daqmx.clock_watch import ClockWatch
from drivers.daqmx.parameters import Daq
from drivers.errors import DeviceNotFound
from drivers.optoncdt.line import Line
from tests.bench.app.ipc.experiment import order
from tests.patience import LONG

NO_WINDOW = 0x08000000
"""CREATE_NO_WINDOW of the Windows API, "Process Creation Flags"."""


Opened = tuple["subprocess.Popen[bytes]", Callable[[], None]]


def open_line(port: str) -> Opened:
    opened = Line("laser_1", port, 921_600)

    def close() -> None:
        opened.close()
        opened.release()

    return opened._child._process, close  # pyright: ignore[reportPrivateUsage]


def watch_clock(_port: str) -> Opened:
    watch = ClockWatch(Daq(server="127.0.0.1:1"), "no task", 1000.0)
    return watch._child._process, watch.close  # pyright: ignore[reportPrivateUsage]


def ignored(process: int) -> set[int]:
    """Signals that a process ignores, from Linux's own account."""
    status = Path(f"/proc/{process}/status").read_text()
    mask = int(next(row.split()[1] for row in status.splitlines() if row.startswith("SigIgn")), 16)
    return {number for number in range(1, 65) if mask >> (number - 1) & 1}


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc, and sends signals to one process")
@pytest.mark.parametrize("opened", [open_line, watch_clock])
def test_a_request_to_end_does_not_end_a_child_but_the_end_of_its_program_does(
    opened: Callable[[str], Opened],
) -> None:
    master, slave = os.openpty()
    try:
        process, close = opened(os.ttyname(slave))
        try:
            asked = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
            end = time.monotonic() + LONG
            while not asked <= ignored(process.pid):
                assert time.monotonic() < end
                time.sleep(0.005)
            for number in asked:
                process.send_signal(number)
            time.sleep(0.05)
            assert process.poll() is None
        finally:
            close()
        assert process.returncode == 0
    finally:
        os.close(master)
        os.close(slave)


def begin_line(_: Path) -> None:
    with pytest.raises(DeviceNotFound, match="ended at once"):
        Line("laser_1", "COM5", 921_600)


def begin_watch(_: Path) -> None:
    ClockWatch(Daq(), "task", 1000.0).close()


def begin_session(folder: Path) -> None:
    session = SessionClient(order(folder))
    end = time.monotonic() + LONG
    while not session.take():
        assert time.monotonic() < end
        time.sleep(0.005)


@pytest.mark.skipif(sys.platform == "win32", reason="the platform is an imitation")
@pytest.mark.parametrize(("module", "begin"), [(child, begin_line), (child, begin_watch), (client, begin_session)])
def test_on_windows_a_child_is_not_attached_to_the_console(
    module: object, begin: Callable[[Path], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flags, real = list[int](), subprocess.Popen

    def record(_: object, *, creationflags: int = 0, **others: Any) -> object:
        flags.append(creationflags)
        return real([sys.executable, "-c", ""], **others)

    with monkeypatch.context() as patched:
        patched.setattr(sys, "platform", "win32")
        patched.setattr(subprocess, "CREATE_NO_WINDOW", NO_WINDOW, raising=False)
        windows = reload(child).OWN_CONSOLE
    reload(child)
    monkeypatch.setattr(module, "OWN_CONSOLE", windows)
    monkeypatch.setattr(subprocess, "Popen", record)
    begin(tmp_path)
    assert flags[0] & NO_WINDOW


def test_a_child_imports_nothing_from_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file there may have the name of a module that the child needs."""
    (tmp_path / "argparse.py").write_text("raise SystemExit(3)\n")
    monkeypatch.chdir(tmp_path)
    started = child.ChildProcess("json.tool", "--compact")
    started.write(b'{"a": 1}')
    started.input.close()
    assert started.output.read().strip() == b'{"a":1}'
    started.output.close()
    started.end()


def test_a_child_that_does_not_end_does_not_hold_the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its thread still reads from it; the pipe stays open until both are gone."""
    monkeypatch.setattr("drivers.daqmx.clock_watch.ENDING", 0.2)
    watch = ClockWatch(Daq(server="127.0.0.1:1"), "no task", 1000.0)
    gone = threading.Event()
    stuck = threading.Thread(target=gone.wait, daemon=True)
    stuck.start()
    real = watch._thread  # pyright: ignore[reportPrivateUsage]
    watch._thread = stuck  # pyright: ignore[reportPrivateUsage]
    begun = time.monotonic()
    watch.close()
    assert time.monotonic() - begun < LONG
    gone.set()
    real.join(LONG)
    watch.close()


def test_no_process_that_is_started_imports_from_the_current_folder() -> None:
    root = Path(child.__file__).parents[1]
    calls = [
        line.strip()
        for package in ("bench", "drivers", "protocols", "sim")
        for path in (root / package).rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.search(r'sys\.executable, "', line)
    ]
    assert len(calls) >= 8
    assert [line for line in calls if 'sys.executable, "-P"' not in line] == []
