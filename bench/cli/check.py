"""`rockbench check`: the loop check of the bench, with a verdict as exit code."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TextIO

from cyclopts import App

from bench.cli.catalogue import Entry
from bench.cli.run import Start, command_of
from protocols.check.line import Verdict
from protocols.check.parameters import CheckParameters

if TYPE_CHECKING:
    from bench.cli.check_lines import CheckLines
    from bench.session import Experiment


def _loop_check(parameters: CheckParameters) -> "Experiment":
    from protocols.check.experiment import LoopCheck

    return LoopCheck(parameters)


def _progress(stream: TextIO, person_answers: bool) -> "CheckLines":  # noqa: ARG001 - lines never hide a question
    from bench.cli.check_lines import CheckLines

    return CheckLines(stream)


def _passed(summary: Mapping[str, Any]) -> bool:
    return all(line["verdict"] != Verdict.FAILED for line in summary["points"])


CHECK = Entry(
    name="check",
    summary="Check the loop of the configured bench at low level, line by line: passed or failed, and what to do.",
    details=(
        "Listens to every channel at rest, then drives sines of one velocity with the frame locked to the table, and "
        "compares polarity, scale and delay of all sensors, and the drive. The exit code is 1 also when a line failed."
    ),
    parameters=CheckParameters,
    campaign=_loop_check,
    progress=_progress,
    passed=_passed,
)


def check_app(start: Start | None = None) -> App:
    """`rockbench check`; `start` as for `run_app`."""
    app = App(name="check", help=CHECK.summary, version_flags=())
    app.default(command_of(CHECK, start))
    return app
