"""An interrupt just before and after a result gets its name: nothing is left, or a whole file is kept and named."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from bench.app.cli.interrupt import Interrupts
from bench.app.cli.main import main
from bench.datafile.recorder import Recorder
from bench.events import Event, PointFinished
from tests.interrupts import COMMANDS, misjudged
from tests.patience import LONG
from tests.whole import partial

PREDICT = ["predict", "modes", "--out"]


def interrupted_at_rename(monkeypatch: pytest.MonkeyPatch, *, after: bool) -> None:
    """Make every rename of a file raise KeyboardInterrupt, before or after it was carried out."""
    rename: Callable[[Path, Path], None] = os.replace

    def replace(source: Path, target: Path) -> None:
        if after:
            rename(source, target)
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", replace)


def test_an_interrupt_inside_compiled_code_is_not_blamed_on_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A lock of h5py turns it into a SystemError."""

    def opened(_: Path) -> None:
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr("bench.datafile.reader.open_datafile", opened)
    file = tmp_path / "campaign.h5"
    file.touch()
    assert main(["export", str(file), "--to", "csv", "--out", str(tmp_path / "new")]) == 130
    assert capsys.readouterr().err == "rockbench: error: interrupted\n"


@pytest.mark.parametrize("answered", [True, False])
def test_an_error_that_native_code_makes_of_an_interrupt_is_none_of_the_file(
    answered: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """numba's C code raises ImportError when Ctrl-C ends its import of a module."""

    def command() -> int:
        raise ImportError("numba._devicearray failed to import") from ValueError("something else")

    parsed = command, SimpleNamespace(args=(), kwargs={}), {}
    monkeypatch.setattr(
        "bench.app.cli.main.rockbench_app", lambda _: SimpleNamespace(parse_args=lambda *_, **__: parsed)
    )
    handler = Interrupts()
    handler.first = signal.SIGINT if answered else None
    before = signal.signal(signal.SIGINT, handler)
    try:
        code = main(["report", "campaign.h5"])
    finally:
        signal.signal(signal.SIGINT, before)
    said = capsys.readouterr().err
    assert (code, "damaged" in said or "cannot be evaluated" in said) == ((130, False) if answered else (1, True))
    assert (said == "rockbench: error: interrupted\n") is answered


def test_a_complete_result_is_kept_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new.h5"
    interrupted_at_rename(monkeypatch, after=True)
    assert main([*PREDICT, str(out)]) == 130
    assert f"interrupted after its result was written: {out} is complete" in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == [out]
    assert partial(out) is None


def test_an_incomplete_result_is_removed_and_not_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    interrupted_at_rename(monkeypatch, after=False)
    assert main([*PREDICT, str(tmp_path / "new.h5")]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == "rockbench: error: interrupted"
    assert not [*tmp_path.iterdir()]


def test_an_older_file_of_the_name_is_not_the_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from bench.unfinished import completed, forget_completed, write_new

    out = tmp_path / "report.html"
    out.write_text("older")
    interrupted_at_rename(monkeypatch, after=False)
    forget_completed()
    with pytest.raises(KeyboardInterrupt):
        write_new(out, lambda path: path.write_text("new") and None, overwrite=True)
    assert (completed(), out.read_text(), [*tmp_path.iterdir()]) == ([], "older", [out])


def test_an_interrupted_run_names_no_figures_that_were_not_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Interrupted(Recorder):
        def __call__(self, event: Event) -> None:
            super().__call__(event)
            if isinstance(event, PointFinished):
                signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("bench.app.session.Recorder", Interrupted)
    out = tmp_path / "run"
    assert main(["check", "--omega", "12", "18", "27", "40", "--cycles", "4", "--out", str(out), "--json"]) == 130
    shown, kept = json.loads(capsys.readouterr().out), json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert not [path.name for path in out.iterdir() if path.suffix in (".png", ".pdf", ".svg")]
    for summary in (shown, kept):
        assert (summary["figure"], summary.get("further_figures"), len(summary["points"]) > 0) == (None, None, True)


HANGING = """
import ctypes, os, signal, sys, threading
from bench.app.cli.process import run

rename = os.replace

def replace(source, target):
    rename(source, target)
    # the signal arrives while native code runs: the main thread does not handle it
    threading.Timer(0.1, lambda: signal.pthread_kill(threading.get_ident(), signal.SIGINT)).start()
    ctypes.CDLL(None).sleep(20)

os.replace = replace
sys.argv = ["rockbench", *sys.argv[1:]]
run()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal to one of its own threads")
def test_the_thread_that_ends_the_process_keeps_and_names_it(tmp_path: Path) -> None:
    out = tmp_path / "new.h5"
    process = [sys.executable, "-c", HANGING, *PREDICT, str(out)]
    done = subprocess.run(process, capture_output=True, text=True, timeout=LONG)
    assert (done.returncode, [*tmp_path.iterdir()], partial(out)) == (130, [out], None)
    assert done.stderr.count(f"{out} is complete") == 1


def test_the_judge_finds_what_is_partial_foreign_or_misreported(tmp_path: Path) -> None:
    command = next(each for each in COMMANDS if each.name == "predict map")
    out = tmp_path / "new.h5"
    assert main([*PREDICT, str(out)]) == 0
    assert misjudged(command, [f"interrupted after its result was written: {out} is complete"], tmp_path) == []
    assert misjudged(command, ["interrupted; nothing was written"], tmp_path) != []
    whole = out.read_bytes()
    out.write_bytes(whole[: len(whole) // 2])
    assert misjudged(command, ["interrupted"], tmp_path)[0].startswith("not whole: new.h5")
    out.rename(tmp_path / ".new.123.h5")
    assert misjudged(command, ["interrupted"], tmp_path)[0].startswith("left behind")
    (tmp_path / ".new.123.h5").unlink()
    assert misjudged(command, [f"{out} is complete"], tmp_path)[0].startswith("called complete")
    page = next(each for each in COMMANDS if each.name == "report")
    (tmp_path / "new.html").write_text("<!doctype html><p>cut")
    assert misjudged(page, ["interrupted"], tmp_path) == ["not whole: new.html: it is cut"]
