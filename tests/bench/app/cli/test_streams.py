"""A run outlasts the terminal that shows it."""

import errno
import json
import os
import signal
import subprocess
import sys
from collections.abc import Generator
from io import StringIO
from pathlib import Path

import pytest

from bench.app.cli.interrupt import until_interrupted
from bench.app.cli.main import main
from bench.app.cli.streams import lasting
from tests.installed import example
from tests.patience import LONG, eventually

RUN = ["run", "tone-sweep", "--omega", "40", "--cycles", "4"]
"""The shortest run that is measured, evaluated and drawn."""
FULL = Path("/dev/full")


@pytest.fixture(scope="module")
def plugged(tmp_path_factory: pytest.TempPathFactory) -> Generator[None]:
    with example(tmp_path_factory.mktemp("plugins") / "site", "tone_sweep"):
        yield


class Broken(StringIO):
    """A terminal that is gone after some texts."""

    def __init__(self, number: int, after: int) -> None:
        super().__init__()
        self._number, self._left = number, after

    @property
    def gone(self) -> bool:
        return self._left < 0

    def write(self, text: str) -> int:
        self._left -= 1
        if self.gone:
            raise OSError(self._number, os.strerror(self._number))
        return super().write(text)


# every error and every moment once; all nine pairs with the mark soak
QUICK = ((0, errno.EPIPE), (3, errno.ENOSPC), (8, errno.EIO))
PAIRS = [
    pytest.param(after, number, marks=() if (after, number) in QUICK else pytest.mark.soak)
    for after in (0, 3, 8)
    for number in (errno.EPIPE, errno.ENOSPC, errno.EIO)
]


@pytest.mark.usefixtures("plugged")
@pytest.mark.parametrize(("after", "number"), PAIRS)
def test_a_run_goes_on_without_its_display(
    number: int, after: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stderr", terminal := Broken(number, after))
    assert main([*RUN, "--out", str(tmp_path / "run"), "--json"]) == 0
    assert terminal.gone
    assert json.loads(capsys.readouterr().out)["status"] == "completed"


@pytest.mark.usefixtures("plugged")
@pytest.mark.parametrize("how", ["full disk", pytest.param("closed pipe", marks=pytest.mark.soak)])
def test_a_command_whose_standard_error_is_gone_ends_well(how: str, tmp_path: Path) -> None:
    if how == "full disk" and not FULL.exists():
        pytest.skip("no device that is always full")
    reader, writer = os.pipe()
    os.close(reader)
    target = writer if how == "closed pipe" else os.open(FULL, os.O_WRONLY)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "bench", *RUN, "--out", str(tmp_path / "run"), "--json"],
            stdout=subprocess.PIPE,
            stderr=target,
            timeout=LONG,
        )
    finally:
        for handle in {writer, target}:
            os.close(handle)
    assert done.returncode == 0
    assert json.loads(done.stdout)["status"] == "completed"


NOHUP = """
import signal
from bench.app.cli.process import run

signal.signal(signal.SIGHUP, signal.SIG_IGN)
run()
"""


@pytest.mark.usefixtures("plugged")
@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGHUP")
def test_a_run_started_with_nohup_outlasts_its_terminal(tmp_path: Path) -> None:
    out = tmp_path / "run"
    process = subprocess.Popen([sys.executable, "-c", NOHUP, *RUN, "--out", str(out), "--json"], stdout=subprocess.PIPE)
    try:
        eventually((out / "campaign.h5").exists)
        process.send_signal(signal.SIGHUP)
        answer, _ = process.communicate(timeout=LONG)
    finally:
        process.kill()
    assert (process.returncode, json.loads(answer)["status"]) == (0, "completed")


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGHUP")
@pytest.mark.parametrize("ignored", [True, False])
def test_a_server_started_with_nohup_outlasts_its_terminal(ignored: bool) -> None:
    # default_int_handler instead of SIG_DFL, which would end the tests if nothing replaced it
    inherited = signal.SIG_IGN if ignored else signal.default_int_handler
    before = signal.signal(signal.SIGHUP, inherited)
    try:
        with until_interrupted() as over:
            signal.raise_signal(signal.SIGHUP)
            assert over.is_set() is not ignored
        assert signal.getsignal(signal.SIGHUP) is inherited
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_result_that_cannot_be_printed_is_one_line(tmp_path: Path) -> None:
    if not FULL.exists():
        pytest.skip("no device that is always full")
    with FULL.open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "bench", "config", "init", str(tmp_path / "bench.toml"), "--help"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=LONG,
        )
    assert done.returncode == 1
    assert "No space left on device" in done.stderr
    assert "Traceback" not in done.stderr


def test_what_outlasts_its_reader_is_wrapped_once() -> None:
    stream = lasting(StringIO())
    assert lasting(stream) is stream
    print("text", file=stream)
    assert stream.getvalue() == "text\n"  # type: ignore[attr-defined]
