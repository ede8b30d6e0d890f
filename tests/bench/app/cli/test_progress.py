"""What a command says while it works: a line for each phase, or a bar that gives way to every other text."""

import sys
from io import StringIO

import pytest
from rich.console import Console

from bench.app.cli.main import main
from bench.app.cli.process import PhaseBar, PhaseLines, phases_on
from bench.app.cli.terminal import PlainLines
from bench.app.run_display import RunDisplay
from bench.events import Progress as RunProgress
from bench.progress import counting
from sim.loading import MODEL, load_model

Told = list[tuple[str, int, int]]


def test_elsewhere_than_on_a_terminal_each_phase_is_one_line() -> None:
    stream = StringIO()
    progress = phases_on(stream)
    assert isinstance(progress, PhaseLines)
    with progress:
        done = counting(progress, "simulating")
        done(1, 2)
        done(2, 2)
        progress("drawing\nthe figure")
    assert stream.getvalue() == "rockbench: simulating\nrockbench: drawing the figure\n"


def test_the_bar_gives_way_to_what_is_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal, result = StringIO(), StringIO()
    monkeypatch.setattr(sys, "stdout", result)
    with PhaseBar(Console(file=terminal, force_terminal=True, width=80)) as bar:
        bar("simulating", 1, 4)
        assert sys.stdout is not result
        print("the result")
        bar("drawing")
    assert sys.stdout is result
    assert result.getvalue() == "the result\n"
    assert "simulating" in terminal.getvalue()
    # the cursor is shown again
    assert terminal.getvalue().rstrip().endswith("\x1b[2K")
    assert terminal.getvalue().count("\x1b[?25l") == terminal.getvalue().count("\x1b[?25h") == 2


def test_a_run_says_what_it_prepares_and_counts_anew_when_it_begins() -> None:
    stream = StringIO()
    lines = PlainLines(stream)
    lines.prepare("planning the starts", 1, 4)
    lines.prepare("planning the starts", 2, 4)
    assert stream.getvalue().split() == ["0:00", "prepare", "planning", "the", "starts"]
    scene = RunDisplay()
    scene.prepare("planning the starts", 1, 4)
    assert (scene.reason, scene.fraction) == ("planning the starts", 0.25)
    scene.update(RunProgress(0.0, 100.0, "calibrating"))
    assert scene.fraction == 0.0


def test_a_loaded_model_is_not_told_of_again() -> None:
    load_model()
    told: Told = []
    load_model(lambda *call: told.append(call), MODEL)
    assert told == []


@pytest.mark.parametrize(
    ("line", "phases"),
    [
        ("predict steady --omega 16 --beta 0.4", {"loading the program", "computing the steady motions"}),
        (
            "predict map --omega 14:16:3 --beta 0.4:0.6:3 --band",
            {"computing the gain map", "computing the uncertainty"},
        ),
        ("run harmonic --omega 20 --beta 0.25 --dry-run", {"planning the starts", "simulating every stage"}),
        ("records fit synthetic:kobe --json", {"fitting the record"}),
    ],
)
def test_commands_tell_how_far_they_are(line: str, phases: set[str], capsys: pytest.CaptureFixture[str]) -> None:
    told: Told = []

    def progress(phase: str, done: int = 0, total: int = 0, /) -> None:
        told.append((phase, done, total))

    assert main(line.split(), progress=progress) == 0
    found = {phase for phase, _, _ in told}
    assert all(any(each.startswith(phase) for each in found) for phase in phases), found
    assert all(0 <= done <= total or total == 0 for _, done, total in told)
    # whoever shows it writes it: the command itself has left both streams to their purposes
    assert capsys.readouterr().err == ""
