"""A computer that stays awake during a run, and a console that is closed, on every system's own terms."""

import signal
import stat
import sys
import time
from pathlib import Path

import pytest

from bench.app.cli import closing
from bench.app.support import awake as module
from bench.app.support.awake import CONTINUOUS, SYSTEM_REQUIRED, awake
from bench.app.support.doctor import Health, _windows_usb_suspend, sleep, usb_suspend
from tests.patience import eventually

POWERCFG = """
Power Setting GUID: 48e6b7a6-50f5-4782-a5d4-53bb8f07e226  (USB selective suspend setting)
      Possible Setting Index: 000
    Current AC Power Setting Index: 0x0000000{mains}
    Current DC Power Setting Index: 0x0000000{battery}
"""


def test_a_thread_of_windows_requests_a_running_system_and_withdraws_it(monkeypatch: pytest.MonkeyPatch) -> None:
    states = list[int]()
    monkeypatch.setattr(module, "_windows_state", lambda: lambda state: states.append(state) or 1)
    with awake("win32") as possible:
        assert (possible, states) == (True, [CONTINUOUS | SYSTEM_REQUIRED])
    assert states[1:] == [CONTINUOUS]


@pytest.mark.skipif(sys.platform == "win32", reason="runs a script")
def test_the_inhibiting_program_lives_as_long_as_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program, log = tmp_path / "inhibit", tmp_path / "log"
    program.write_text(f"#!/bin/sh\necho began > {log}\ncat\necho ended >> {log}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setitem(module.COMMANDS, "linux", (str(program), *module.COMMANDS["linux"][1:]))
    with awake("linux") as possible:
        eventually(log.exists)
        assert possible
    assert log.read_text() == "began\nended\n"


def test_a_system_without_such_a_program_runs_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(module.COMMANDS, "linux", ("/not/there",))
    with awake("linux") as possible:
        assert not possible
    with awake("plan9") as possible:
        assert not possible


def test_a_closed_console_interrupts_and_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(closing, "GRANTED", 0.05)
    asked = list[int]()
    handle = closing.handler(asked.append, signal.SIGTERM)
    assert not handle(0)
    assert not handle(1)
    assert asked == []
    begun = time.monotonic()
    assert handle(2)
    assert time.monotonic() - begun >= 0.05
    assert asked == [signal.SIGTERM]


@pytest.mark.parametrize(("mains", "battery", "health"), [(0, 0, "good"), (1, 0, "bad"), (0, 1, "bad")])
def test_the_answer_of_powercfg(mains: int, battery: int, health: str) -> None:
    assert _windows_usb_suspend(POWERCFG.format(mains=mains, battery=battery)).health == health
    assert _windows_usb_suspend("").health is Health.UNKNOWN


def test_a_suspended_device_of_the_bench_is_named(tmp_path: Path) -> None:
    for name, vendor, mode in (("1-1", "3923", "on"), ("1-2", "0403", "auto"), ("1-3", "dead", "auto")):
        (tmp_path / name / "power").mkdir(parents=True)
        (tmp_path / name / "idVendor").write_text(f"{vendor}\n")
        (tmp_path / name / "power" / "control").write_text(f"{mode}\n")
    found = usb_suspend(tmp_path, "linux")
    assert (found.health, found.found) == (Health.BAD, "can be suspended when idle: 1-2")
    (tmp_path / "1-2" / "power" / "control").write_text("on\n")
    assert usb_suspend(tmp_path, "linux").health is Health.GOOD


def test_sleep_can_be_inhibited_where_the_program_is() -> None:
    assert sleep(lambda name: f"/usr/bin/{name}", "darwin").health is Health.GOOD
    assert sleep(lambda _: None, "linux").health is Health.NOTICE


@pytest.mark.skipif(sys.platform == "win32", reason="runs a script")
@pytest.mark.parametrize(("code", "health"), [(0, "good"), (1, "notice")])
def test_on_linux_the_inhibition_is_tried(tmp_path: Path, code: int, health: str) -> None:
    program = tmp_path / "systemd-inhibit"
    # refuses like logind in a session over ssh: without an error when it is started
    program.write_text(f"#!/bin/sh\necho 'Access denied' >&2\necho $* > {tmp_path / 'log'}\nexit {code}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    found = sleep(lambda _: str(program), "linux")
    assert (found.health, bool(found.remedy)) == (health, health == "notice")
    assert (tmp_path / "log").read_text().startswith("--what=sleep:idle ")
