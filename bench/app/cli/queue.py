"""`rockbench queue FILE`: runs the tests of a queue in order."""

import sys
from contextlib import nullcontext, redirect_stdout
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from bench.app.cli.dry_run import plan_content, plans_text, tests_text
from bench.app.cli.interrupt import report_interrupt
from bench.app.cli.options import BenchFile, Handed, Json, Seed, SpecimenFile, Yes, switch
from bench.app.cli.output import print_error, print_result
from bench.app.cli.run import GOOD, carry_out
from bench.progress import Progress, silent
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.app.preflight import Preflight
    from bench.app.queue.queue import Queue, Queued, Ready
    from bench.config.model import BenchConfiguration
    from bench.engine.interface import Operator


def queue(
    file: Annotated[Path, Parameter(metavar="FILE", help="The queue (JSON).", negative=())],
    /,
    *,
    config: BenchFile = None,
    seed: Seed = None,
    specimen: SpecimenFile = None,
    dry_run: Annotated[bool, switch("Check every plan and print its margins, without running a test.")] = False,
    yes: Yes = False,
    as_json: Json = False,
    progress: Handed = silent,
) -> int:
    """Check every pending test, then run them in order; the file keeps the status of each.

    `rockbench run PROTOCOL ... --queue FILE` adds a test; the operator's window can store its queue in the same format.
    No test starts if one of the plans is refused. A test that fails or is stopped ends the queue; the others stay
    pending, and the same command continues with them. The exit code is 0 if every pending test was carried out, 1 if
    not, 2 if an input was refused before the first test, 130 after Ctrl-C. With --dry-run it is 0 unless a plan is
    refused.
    """
    progress("loading the program")
    from bench.app.cli.inputs import configuration_from
    from bench.app.preflight import load_bench
    from bench.app.queue.file import ITEM, QueueFile, owned
    from bench.app.queue.queue import Queue, all_ready, room_refusal

    configuration = configuration_from(config, seed, specimen)
    if not file.exists():
        raise InvalidInput(ITEM, str(file), "there is no such file; `rockbench run PROTOCOL --queue FILE` creates one")
    # a dry run does not lock the queue
    with nullcontext() if dry_run else owned(file, "`rockbench queue`"):
        store = QueueFile(file)
        tests = Queue(store.read(), store.write)
        with redirect_stdout(sys.stderr):
            load_bench(configuration, progress)
            progress("checking the tests against the bench")
            prepared = all_ready(tests.tests, configuration)
            found = {
                index: _plan(index, each, Path(tests.tests[index].out or "runs"), progress)
                for index, each in prepared.items()
            }
        refused = _refusal(found) or room_refusal([each.room for each in found.values()])
        if dry_run:
            plans = [plan_content(index + 1, tests.tests[index], plan) for index, plan in found.items()]
            print_result(lambda: {"tests": plans}, lambda: plans_text(plans), as_json=as_json, error=refused)
            if refused is not None:
                print_error(refused)
            return 0 if refused is None else 2
        if refused is not None:
            raise refused
        for test in tests.tests:
            # a missing operator is detected before the first test begins
            _operator(test, configuration, yes)
        code = _run_all(tests, configuration, yes, dict(prepared))
    print_result(
        lambda: {"tests": [test.model_dump(mode="json") for test in tests.tests]},
        lambda: tests_text(tests.tests),
        as_json=as_json,
        error="the queue was not completed: see the status of its tests" if code else None,
        code="run_failed" if code == 1 else "interrupted",
    )
    return code


def _plan(index: int, each: "Ready", folder: Path, progress: Progress) -> "Preflight":
    from bench.app.preflight import compile_run

    def numbered(phase: str, done: int = 0, total: int = 0, /) -> None:
        progress(f"test {index + 1}: {phase}", done, total)

    return compile_run(each.protocol.name, each.prepared, folder, numbered)


def _refusal(found: "dict[int, Preflight]") -> InvalidInput | None:
    for index, plan in found.items():
        if (refused := plan.refusal) is not None:
            return InvalidInput(f"test {index + 1}: {refused.item}", refused.value, refused.allowed)
    return None


def _run_all(tests: "Queue", configuration: "BenchConfiguration", yes: bool, prepared: "dict[int, Ready]") -> int:
    """Run the pending tests until one does not complete; returns the exit code."""
    while (index := tests.next) is not None:
        # each plan is dropped when its test has ended
        code = _run_one(tests, index, configuration, yes, prepared.pop(index, None))
        if code is not None:
            return code
    return 0


def _run_one(
    tests: "Queue", index: int, configuration: "BenchConfiguration", yes: bool, checked: "Ready | None"
) -> int | None:
    """Run a test; returns None when the next test may start, else the exit code of the command."""
    from bench.app.folders import check_folder, remove_unused, result_names
    from bench.app.queue.queue import own_folder, ready

    test = tests.tests[index]
    interrupted: int | None = None
    out: Path | None = None
    good, goes_on, outcome = False, False, "the program failed"
    try:
        each = checked or ready(test, index + 1, configuration)
        if test.out is not None:
            check_folder(Path(test.out), result_names(each.protocol))
        operator = _operator(test, configuration, yes)
        out = own_folder(test, datetime.now(), tests.tests)
        print(f"test {index + 1} of {len(tests.tests)}: {test.protocol}, results in {out}", file=sys.stderr)
        tests.begin(index, str(out))
        ended, interrupted = carry_out(
            each.protocol, lambda _progress: each.prepared, out, operator, realtime=test.realtime, about=test.about
        )
        if isinstance(ended, Exception):
            outcome = f"failed: {ended}"
        else:
            good = ended.status in GOOD and ended.passed
            outcome = (
                f"{ended.status}, but at least one check failed"
                if ended.status == "completed" and not ended.passed
                else f"{ended.status}: {ended.reason}"
            )
            # an interrupt after the end of the plan does not change the ending, but ends the queue
            goes_on = ended.status == "completed" and good and (interrupted is None or tests.next is None)
    except InvalidInput as refused:
        outcome = f"refused: {refused}"
    except KeyboardInterrupt as interrupt:
        outcome, interrupted = str(interrupt) or "interrupted", 130
    finally:
        try:
            tests.finish(index, good=good, outcome=outcome)
        except InvalidInput as error:
            # the test has run: its outcome is told, and the exit code is not that of a queue that was refused
            outcome, goes_on = f"{outcome}; but this is not in the queue file: {error}", False
        if out is not None and test.out is None:
            remove_unused(out)
    if goes_on:
        return None
    if interrupted is None:
        print_error(f"test {index + 1} {outcome}")
    else:
        report_interrupt(f"test {index + 1} {outcome}", in_result=True)
    return interrupted or 1


def _operator(test: "Queued", configuration: "BenchConfiguration", yes: bool) -> "Operator":
    from bench.app.cli.terminal import choose

    yes = yes or test.unattended
    asks, terminal = test.ask and not yes, sys.stdin.isatty()
    return choose(serves_itself=configuration.serves_itself, yes=yes, ask=asks, terminal=terminal)
