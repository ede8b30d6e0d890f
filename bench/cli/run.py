"""`rockbench run <protocol>`: checks everything, runs the session, tells how it ended."""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from contextvars import ContextVar
from dataclasses import fields
from datetime import datetime
from functools import partial
from inspect import Signature
from pathlib import Path
from typing import TYPE_CHECKING, Any
from typing import Protocol as Interface

from cyclopts import App, Group

from bench.catalogue import load_protocol, protocol_names
from bench.cli.flags import arguments_of
from bench.cli.options import Options, arguments_of_options
from bench.cli.progress import HANDED
from bench.cli.refusal import error_object, fail, tell
from bench.progress import Progress, silent
from bench.results import SUMMARY
from sim.errors import InvalidInput, RockbenchError

if TYPE_CHECKING:
    from bench.engine.operator import Operator
    from bench.engine.requests import Requests
    from bench.events import Subscriber
    from bench.protocol import Prepared, Protocol
    from bench.session import SessionResult

GOOD = ("completed", "stopped")
"""How a session ends whose results are good."""

_EXIT_CODES = (
    "The exit code is 0 when the campaign was carried out (also when a point was not reached: its status says so), "
    "1 when it failed or was aborted, 2 when something was refused before it began, 130 after Ctrl-C. "
    "With --dry-run it is 0 when the campaign would be carried out."
)


class Start(Interface):
    """What runs a session: `bench.session.run_session`, or its stand-in in a test."""

    def __call__(
        self,
        protocol: "Protocol[Any]",
        prepared: "Prepared[Any]",
        *,
        out: Path,
        operator: "Operator",
        subscribers: "Sequence[Subscriber]",
        requests: "Requests",
        realtime: bool,
    ) -> "SessionResult":
        """Run a prepared protocol and leave its results in the folder `out`."""
        ...


STAND_IN: ContextVar[Start | None] = ContextVar("stand-in for sessions", default=None)
"""Takes the place of `bench.session.run_session` where it is set."""


CHECK = "check"
"""The protocol that is a command of its own, and none of `rockbench run`."""


def run_app(*, listed: bool) -> App:
    """`rockbench run`, with one command for each protocol that is installed, loaded when it is used; where they are
    `listed`, all of them are, with their summaries.
    """
    app = App(name="run", help="Run a protocol on the bench.", version_flags=())
    for name in protocol_names():
        if name == CHECK:
            continue
        if listed:
            app.command(__getattr__(name))
        else:
            app.command(f"{__name__}:{name}", name=name)
    return app


def __getattr__(name: str) -> App:
    """The command of the protocol `name`: cyclopts asks this module for it when it is used or listed."""
    if name not in protocol_names():
        raise AttributeError(name)
    try:
        protocol = load_protocol(name)
    except InvalidInput as refused:
        # named where it is listed or run; the others are none the worse
        failure = refused
    else:
        command = name if name == CHECK else f"run {name}"
        app = App(
            name=name, help_epilogue=f"Example: rockbench {command} {protocol.example}".rstrip(), version_flags=()
        )
        app.default(command_of(protocol))
        return app

    def unavailable(*_tokens: str) -> int:
        raise failure

    app = App(name=name, help=f"Not available: {failure.allowed}", version_flags=())
    app.default(unavailable)
    return app


def command_of(protocol: "Protocol[Any]") -> Callable[..., int]:
    """The function behind a protocol's command; its signature is the protocol's flags and the common options."""

    def execute(*values: str, **arguments: Any) -> int:
        progress = arguments.pop("progress", silent)
        if values and protocol.positional is not None:
            arguments[protocol.positional] = values
        common = {field.name for field in fields(Options)} & arguments.keys()
        options = Options(**{name: arguments.pop(name) for name in common})
        return _perform(protocol, arguments, options, progress)

    group = Group(f"Parameters of the {protocol.name} protocol", sort_key=1)
    execute.__doc__ = f"{protocol.summary}\n\n{protocol.details}\n\n{_EXIT_CODES}"
    asked = arguments_of(protocol.parameters, group, protocol.positional)
    execute.__dict__["__signature__"] = Signature([*asked, *arguments_of_options(), HANDED])
    return execute


def _perform(protocol: "Protocol[Any]", arguments: dict[str, Any], options: Options, progress: Progress) -> int:
    progress("reading protocol and bench")
    from bench.cli.inputs import configuration_from, parameters_from
    from bench.cli.operator import choose
    from bench.cli.output import check_folder, default_folder, make_folder, remove_unused, result_names

    parameters = parameters_from(protocol.parameters, arguments, options.protocol_file)
    configuration = configuration_from(options.config, options.seed, options.specimen)
    out = options.out or default_folder(protocol.name, datetime.now())
    check_folder(out, result_names(protocol))
    if options.queue is not None:
        from bench.cli.queueing import add_to_queue

        return add_to_queue(options.queue, protocol, parameters, configuration, options, progress)
    if options.dry_run:
        from bench.cli.dry_run import dry_run

        return dry_run(protocol, parameters, configuration, out, progress, as_json=options.json)
    operator = choose(
        serves_itself=configuration.serves_itself, yes=options.yes, ask=options.ask, terminal=sys.stdin.isatty()
    )

    def prepared_here(progress: Progress) -> "Prepared[Any]":
        from bench.preflight.compiled import prepare

        return prepare(protocol, parameters, configuration, progress)

    if options.out is None:
        out = make_folder(out)
    try:
        ended, interrupted = carry_out(
            protocol,
            prepared_here,
            out,
            operator,
            realtime=options.realtime,
            about=options.about,
        )
    finally:
        if options.out is None:
            remove_unused(out)
    if isinstance(ended, Exception):
        fail(ended)
        return interrupted or 1
    return _report(ended, out, options.json, interrupted)


def carry_out(
    protocol: "Protocol[Any]",
    prepare: "Callable[[Progress], Prepared[Any]]",
    out: Path,
    operator: "Operator",
    *,
    realtime: bool,
    about: Mapping[str, str],
) -> "tuple[SessionResult | Exception, int | None]":
    """Run a protocol and show how it goes. Returns its end, or what it failed with, and the exit code of a signal
    that asked for its end, or None. Raises InvalidInput when it is refused.
    """
    from bench.cli.console import progress_on
    from bench.cli.interrupt import interruptible
    from bench.cli.operator import AtTheConsole
    from bench.engine.requests import Requests

    person = operator if isinstance(operator, AtTheConsole) else None
    start = STAND_IN.get()
    requests = Requests()
    with (
        interruptible(requests, asking=lambda: person is not None and person.asking) as interrupts,
        progress_on(sys.stderr, person is not None, protocol) as progress,
        # standard output belongs to the result
        redirect_stdout(sys.stderr),
    ):
        try:
            progress.prepare("loading the program")
            with requests.without_rig():
                if start is None:
                    from bench.session import run_session

                    start = partial(run_session, about=about, progress=progress.prepare)
                prepared = prepare(progress.prepare)
            ended = start(
                protocol,
                prepared,
                out=out,
                operator=operator,
                subscribers=[progress],
                requests=requests,
                realtime=realtime,
            )
        except InvalidInput:
            raise
        except KeyboardInterrupt:
            # before anything moved there is no summary: `check_folder` has seen to that
            if (out / SUMMARY).exists():
                raise KeyboardInterrupt(
                    f"interrupted after the run: {out} holds its results, without pictures"
                ) from None
            raise KeyboardInterrupt("interrupted: ended before anything moved") from None
        except (RockbenchError, OSError) as error:
            ended = error
    return ended, interrupts.exit_code


def _report(result: "SessionResult", out: Path, as_json: bool, interrupted: int | None) -> int:
    """Print the result, and turn the way it ended into an exit code."""
    error = _error(result)
    if as_json:
        content = {"status": result.status, "reason": result.reason, **result.summary}
        print(json.dumps(content | ({} if error is None else {"error": error}), allow_nan=False))
    else:
        print(f"{result.table.rstrip()}\nResults are in {out}")
    if result.status in GOOD:
        # an end that was asked for when there was nothing left to end changes nothing
        return 0 if error is None else 1
    tell(f"the run was {result.status}: {result.reason}")
    return interrupted or (130 if result.interrupted else 1)


def _error(result: "SessionResult") -> dict[str, Any] | None:
    """The error that the JSON object of a run has beside its results; None for a run that came to a good end."""
    if result.status not in GOOD:
        return error_object(result.reason, "run_failed" if result.status == "failed" else "run_aborted")
    if not result.passed:
        return error_object("something that was checked failed: see the points", "check_failed")
    return None
