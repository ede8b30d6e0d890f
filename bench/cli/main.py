"""The command `rockbench`."""

import sys
from collections.abc import Sequence
from importlib.metadata import version

from cyclopts import App, CycloptsError, UnusedCliTokensError

from bench.catalogue import protocol_names
from bench.cli.analyse import analyse_app
from bench.cli.benchmark import benchmark_app
from bench.cli.check import register_check
from bench.cli.completion import completion_app
from bench.cli.configure import config_app
from bench.cli.devices import devices_app
from bench.cli.emulate import emulate_app
from bench.cli.examples import add_examples
from bench.cli.export import export_app
from bench.cli.file import file_app
from bench.cli.interrupt import answer
from bench.cli.paper import paper_app
from bench.cli.predict import predict_app
from bench.cli.queue import queue_app
from bench.cli.records import records_app
from bench.cli.refusal import fail, reply_in_json
from bench.cli.replay import replay_app
from bench.cli.report import report_app
from bench.cli.run import STAND_IN, Start, run_app
from bench.cli.window import gui_app
from bench.progress import Progress, silent
from sim.errors import RockbenchError


def rockbench_app(arguments: Sequence[str] = ()) -> App:
    """The tree of all commands. Protocols are loaded when they are used, or where `arguments` ask for their list."""
    app = App(
        name="rockbench",
        help="Runs a shake-table bench for a frame coupled to a rocking block, and compares its gain with prediction.",
        help_format="plaintext",
        version=lambda: f"rockbench {version('rocking-bench')}",
        exit_on_error=False,
        print_error=False,
        result_action="return_value",
        suppress_keyboard_interrupt=False,
    )
    app.command(run_app(listed=_lists_protocols(arguments)))
    register_check(app)
    app.command(queue_app())
    app.command(gui_app())
    app.command(devices_app())
    app.command(emulate_app())
    app.command(predict_app())
    app.command(records_app())
    app.command(report_app())
    app.command(paper_app())
    app.command(file_app())
    app.command(replay_app())
    app.command(analyse_app())
    app.command(export_app())
    app.command(config_app())
    app.command(benchmark_app())
    app.command(completion_app(app))
    add_examples(app)
    return app


def main(argv: Sequence[str] | None = None, start: Start | None = None, progress: Progress = silent) -> int:
    """Carry out a command line and return its exit code; `start` stands in for `bench.session.run_session`, `progress`
    is told what is being done.

    0: done. 1: a run failed or was aborted. 2: refused before anything started. 130: ended by Ctrl-C.
    What went wrong is one line on standard error, and with --json an object on standard output (docs/errors.md).
    """
    arguments = sys.argv[1:] if argv is None else list(argv)
    app = rockbench_app(arguments)
    # also for what cannot be parsed
    reply_in_json(sys.stdout if "--json" in arguments else None)
    before = STAND_IN.set(start)
    try:
        command, bound, handed = app.parse_args(arguments, exit_on_error=False, print_error=False)
        code = command(*bound.args, **bound.kwargs, **dict.fromkeys(handed, progress))
    except UnusedCliTokensError as error:
        fail(f"unexpected argument: {' '.join(error.unused_tokens or [])} (see --help)", "usage")
        return 2
    except CycloptsError as error:
        fail(error, "usage")
        return 2
    except RockbenchError as error:
        fail(error)
        return 2
    except KeyboardInterrupt as interrupt:
        answer(str(interrupt) or "interrupted")
        return 130
    finally:
        STAND_IN.reset(before)
    return code if isinstance(code, int) else 0


def _lists_protocols(arguments: Sequence[str]) -> bool:
    """Whether `rockbench run` is asked for all of its commands: no protocol is named."""
    return arguments[:1] == ["run"] and not {*arguments[1:2]} & {*protocol_names()}
