"""`rockbench queue FILE`: runs the tests of a queue, one after the other."""

import json
import sys
from contextlib import nullcontext, redirect_stdout
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from bench.cli.inputs import Seed, SpecimenFile
from bench.cli.interrupt import answer
from bench.cli.plan_table import plans_text, tests_text
from bench.cli.progress import Handed
from bench.cli.refusal import error_object, tell
from bench.cli.run import GOOD, carry_out
from bench.progress import Progress, silent
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.cli.queueing import Ready
    from bench.config.model import BenchConfiguration
    from bench.engine.operator import Operator
    from bench.preflight.compiled import Preflight
    from bench.queue.queue import Queue
    from bench.queue.queued import Queued


def queue_app() -> App:
    """`rockbench queue`."""
    app = App(name="queue", version_flags=())

    def queue(
        file: Annotated[Path, Parameter(metavar="FILE", help="The queue (JSON).", negative=())],
        /,
        *,
        config: Annotated[
            Path | None,
            Parameter(
                metavar="FILE",
                help="Configuration of the bench (TOML), the same for every test.",
                show_default="the paper's specimen on the simulated bench",
            ),
        ] = None,
        seed: Seed = None,
        specimen: SpecimenFile = None,
        dry_run: Annotated[
            bool,
            Parameter(negative=(), show_default=False, help="Check every plan, print what it comes to, and stop."),
        ] = False,
        yes: Annotated[
            bool,
            Parameter(
                negative=(), show_default=False, help="Answer yes to the operator's questions: an unattended run."
            ),
        ] = False,
        as_json: Annotated[
            bool, Parameter(name="--json", negative=(), show_default=False, help="Print one JSON object.")
        ] = False,
        progress: Handed = silent,
    ) -> int:
        """Check every test that waits, then run them from the top; the file says what became of each.

        `rockbench run PROTOCOL ... --queue FILE` adds a test; the operator's window keeps its queue in such a file too.
        Nothing starts when one of the plans is refused. A test that fails or is stopped ends it: what waits goes on
        waiting, and the same command goes on with it. The exit code is 0 when every test that waited was carried out,
        1 when not, 2 when something was refused before anything began, 130 after Ctrl-C.
        """
        progress("loading the program")
        from bench.cli.inputs import configuration_from
        from bench.cli.queueing import all_ready, room_refusal
        from bench.preflight.compiled import load_bench
        from bench.queue.file import ITEM, QueueFile
        from bench.queue.owner import owned
        from bench.queue.queue import Queue

        configuration = configuration_from(config, seed, specimen)
        if not file.exists():
            raise InvalidInput(
                ITEM, str(file), "there is no such file; `rockbench run PROTOCOL --queue FILE` makes one"
            )
        # what only looks owns nothing
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
                print(plans_text(tests.tests, found, refused, as_json=as_json))
                if refused is not None:
                    tell(refused)
                return 0 if refused is None else 2
            if refused is not None:
                raise refused
            for test in tests.tests:
                # nobody to answer is found before the first one begins
                _operator(test, configuration, yes)
            code = _run_all(tests, configuration, yes, dict(prepared))
        print(json.dumps(_content(tests.tests, code), allow_nan=False) if as_json else tests_text(tests.tests))
        return code

    app.default(queue)
    return app


def _plan(index: int, each: "Ready", folder: Path, progress: Progress) -> "Preflight":
    from bench.preflight.compiled import compile_run

    def numbered(phase: str, done: int = 0, total: int = 0, /) -> None:
        progress(f"test {index + 1}: {phase}", done, total)

    return compile_run(each.protocol.name, each.prepared, folder, numbered)


def _refusal(found: "dict[int, Preflight]") -> InvalidInput | None:
    for index, plan in found.items():
        if (refused := plan.refusal) is not None:
            return InvalidInput(f"test {index + 1}: {refused.item}", refused.value, refused.allowed)
    return None


def _run_all(tests: "Queue", configuration: "BenchConfiguration", yes: bool, prepared: "dict[int, Ready]") -> int:
    """Run what waits until it is over or one does not come to a good end; returns the exit code."""
    while (index := tests.next) is not None:
        # what was planned is kept only as long as it is needed
        code = _run_one(tests, index, configuration, yes, prepared.pop(index, None))
        if code is not None:
            return code
    return 0


def _run_one(
    tests: "Queue", index: int, configuration: "BenchConfiguration", yes: bool, checked: "Ready | None"
) -> int | None:
    """Run a test; None when the next may follow, else the exit code of the whole."""
    from bench.cli.output import check_folder, remove_unused, result_names
    from bench.cli.queueing import own_folder, ready

    test = tests.tests[index]
    interrupted: int | None = None
    out: Path | None = None
    good, told = False, "the program failed"
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
            told = f"failed: {ended}"
        else:
            good = ended.status in GOOD and ended.passed
            told = f"{ended.status}: {ended.reason}" if ended.passed else f"{ended.status}, but not passed"
            if ended.status == "completed" and good:
                return None
    except InvalidInput as refused:
        told = f"refused: {refused}"
    except KeyboardInterrupt as interrupt:
        told, interrupted = str(interrupt) or "interrupted", 130
    finally:
        tests.finish(index, good=good, told=told)
        if out is not None and test.out is None:
            remove_unused(out)
    if interrupted is None:
        tell(f"test {index + 1} {told}")
    else:
        answer(f"test {index + 1} {told}", in_result=True)
    return interrupted or 1


def _operator(test: "Queued", configuration: "BenchConfiguration", yes: bool) -> "Operator":
    from bench.cli.operator import choose

    yes = yes or test.unattended
    asks, terminal = test.ask and not yes, sys.stdin.isatty()
    return choose(serves_itself=configuration.serves_itself, yes=yes, ask=asks, terminal=terminal)


def _content(tests: "tuple[Queued, ...]", code: int) -> dict[str, object]:
    content: dict[str, object] = {"tests": [test.model_dump(mode="json") for test in tests]}
    if code == 0:
        return content
    ended = error_object("the queue was not carried out: see the tests", "run_failed" if code == 1 else "interrupted")
    return content | {"error": ended}
