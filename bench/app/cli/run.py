"""`rockbench run <protocol>`: checks the inputs and the plan, runs the session, and reports how it ended."""

import sys
from collections.abc import Callable, Mapping
from contextlib import nullcontext, redirect_stdout
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import App

from bench.app.catalogue import CHECK, load_protocol, protocol_names
from bench.app.cli.options import Handed, RunOptions, with_flags
from bench.app.cli.output import Code, print_error, print_result, report_error
from bench.app.cli.watch import PageOptions, live_page
from bench.progress import Progress, silent
from bench.results import SUMMARY
from sim.errors import InvalidInput, RockbenchError, cause_of

if TYPE_CHECKING:
    from bench.app.session import SessionResult
    from bench.config.model import BenchConfiguration
    from bench.engine.interface import Operator
    from bench.protocol import Prepared, Protocol
    from sim.parameters import Parameters

GOOD = ("completed", "stopped")
"""Statuses of a session with valid results."""

_EXIT_CODES = (
    "The exit code is 0 if the campaign was carried out (even if a point was not reached, see its "
    "status), 1 if it failed, was aborted or did not pass a check, 2 if it was refused before it began, 130 "
    "after Ctrl-C. With --dry-run it is 0 if the campaign would be carried out, 2 if it would be refused."
)


def __getattr__(name: str) -> App:
    """The command of the protocol `name`; cyclopts imports it from this module when the command is used or listed."""
    if name not in protocol_names():
        raise AttributeError(name)
    try:
        protocol = load_protocol(name)
    except InvalidInput as refused:
        # report the error only when this protocol is listed or run, so that the others stay usable
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
    """The command function of a protocol, with the protocol's flags and the options of every run."""

    def command(
        typed: Mapping[str, Any],
        *,
        options: RunOptions = RunOptions(),  # noqa: B008 - immutable
        page: PageOptions = PageOptions(),  # noqa: B008 - immutable
        progress: Handed = silent,
    ) -> int:
        return _run(protocol, typed, options, page, progress)

    command.__doc__ = f"{protocol.summary}\n\n{protocol.details}\n\n{_EXIT_CODES}"
    title = f"Parameters of the {protocol.name} protocol"
    return with_flags(protocol.parameters, title, command, protocol.positional)


def _run(
    protocol: "Protocol[Any]", typed: Mapping[str, Any], options: RunOptions, page: PageOptions, progress: Progress
) -> int:
    progress("reading protocol and bench")
    _check_texts(options)
    if not options.watch and page != PageOptions():
        raise InvalidInput("--watch", None, "--address, --port and --no-token need the live page: add --watch")
    if options.watch and (options.dry_run or options.queue is not None):
        raise InvalidInput(
            "--watch",
            True,
            "--dry-run and --queue start no run that it could show; omit --watch, or omit --dry-run and --queue",
        )
    from bench.app.cli.inputs import configuration_from, parameters_from, with_profile
    from bench.app.cli.terminal import choose
    from bench.app.folders import checked_folder, default_folder, make_folder, remove_unused, result_names

    parameters = parameters_from(protocol.parameters, typed, options.protocol_file)
    configuration = configuration_from(options.config, options.seed, options.specimen)
    configuration = with_profile(configuration, options.profile)
    out = checked_folder(options.out, default_folder(protocol.name, datetime.now()), result_names(protocol))
    if options.queue is not None:
        _check_for_queue(options)
        return _add_to_queue(options.queue, protocol, parameters, configuration, options, progress)
    if options.dry_run:
        from bench.app.cli.dry_run import dry_run

        return dry_run(protocol, parameters, configuration, out, progress, as_json=options.json)
    operator = choose(
        serves_itself=configuration.serves_itself, yes=options.yes, ask=options.ask, terminal=sys.stdin.isatty()
    )

    def prepared_here(progress: Progress) -> "Prepared[Any]":
        from bench.app.preflight import prepare

        return prepare(protocol, parameters, configuration, progress)

    if options.out is None:
        out = make_folder(out)
    try:
        with live_page(page) if options.watch else nullcontext():
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
        report_error(ended)
        return interrupted or 1
    return _print_result(ended, out, options.json, interrupted)


def _check_texts(options: RunOptions) -> None:
    """Raise InvalidInput for a text that the data file cannot store: Python represents bytes of an argument that are
    not UTF-8 as surrogates.
    """
    for item, text in (("--operator", options.operator), *(("--note", note) for note in options.note)):
        try:
            text.encode()
        except UnicodeEncodeError as error:
            place = f"character {error.start + 1} is not"
            allowed = (
                f"it must be UTF-8, and {place}: use a terminal and scripts with this encoding, or omit the character"
            )
            raise InvalidInput(item, text, allowed) from None


def _check_for_queue(options: RunOptions) -> None:
    """Raise InvalidInput for options that a test in a queue cannot have."""
    if options.dry_run:
        raise InvalidInput("--dry-run", "--queue", "a dry run adds no test to a queue; use one of the two options")
    if options.profile is not None:
        allowed = "a queue runs its tests with the profile of its configuration: set the keys of the profile there"
        raise InvalidInput("--profile", options.profile, allowed)
    if options.seed is not None:
        allowed = (
            "the tests of a queue have one seed: give it to `rockbench queue`, or set the key simulation.seed there"
        )
        raise InvalidInput("--seed", options.seed, allowed)
    if options.specimen is not None:
        allowed = (
            "the tests of a queue have one specimen: give it to `rockbench queue`, or set the key specimen_file there"
        )
        raise InvalidInput("--specimen", str(options.specimen), allowed)
    if options.yes and options.ask:
        raise InvalidInput("--yes", "--ask", "the two options contradict each other; use one of them")


def _add_to_queue(
    path: Path,
    protocol: "Protocol[Any]",
    parameters: "Parameters",
    configuration: "BenchConfiguration",
    options: RunOptions,
    progress: Progress,
) -> int:
    """`rockbench run ... --queue FILE`: check the plan and append the test to the queue. Returns the exit code.

    Raises InvalidInput for a refused plan, and while another program owns the queue.
    """
    progress("loading the program")
    from bench.app.preflight import compile_run, prepare
    from bench.app.queue.file import QueueFile, owned
    from bench.app.queue.queue import Queue, queued

    with owned(path, "`rockbench run --queue`"):
        store = QueueFile(path)
        queue = Queue(store.read(), store.write)
        prepared = prepare(protocol, parameters, configuration, progress)
        compile_run(protocol.name, prepared, options.out or Path(), progress).require()
        queue.add(
            queued(
                protocol,
                parameters,
                options.out,
                operator=options.operator,
                note="\n".join(options.note),
                realtime=options.realtime,
                ask=options.ask,
                unattended=options.yes,
            )
        )
    number = len(queue.tests)
    print_result(
        lambda: {"queue": str(path), "test": number},
        lambda: f"added as test {number} of {path}",
        as_json=options.json,
    )
    return 0


def carry_out(
    protocol: "Protocol[Any]",
    prepare: "Callable[[Progress], Prepared[Any]]",
    out: Path,
    operator: "Operator",
    *,
    realtime: bool,
    about: Mapping[str, str],
) -> "tuple[SessionResult | Exception, int | None]":
    """Run a protocol and display its progress. Returns the result or the error of the run, and the exit code for the
    signal that requested its end, or None. Raises InvalidInput if the run is refused.
    """
    from bench.app.cli.interrupt import interruptible
    from bench.app.cli.streams import lasting
    from bench.app.cli.terminal import AtTheConsole, progress_on
    from bench.engine.interface import Requests

    person = operator if isinstance(operator, AtTheConsole) else None
    requests, stderr = Requests(), lasting(sys.stderr)
    with (
        interruptible(requests, asking=lambda: person is not None and person.asking) as interrupts,
        progress_on(stderr, person is not None, protocol) as progress,
        # standard output is reserved for the result
        redirect_stdout(stderr),
    ):
        try:
            progress.prepare("loading the program")
            with requests.without_rig():
                from bench.app.ipc.announcement import announced
                from bench.app.ipc.messages import FromSession, Refused, Run
                from bench.app.ipc.server import FAREWELL, Publisher, SessionServer, ended_message
                from bench.app.session import run_session

                prepared = prepare(progress.prepare)
            # operator's windows can attach to the run and stop it
            run = Run(protocol.name, prepared.parameters, prepared.configuration, out, realtime=realtime, about=about)
            server = SessionServer(None, requests, lambda _why: None, lambda: person is not None and person.asking)
            teller = Publisher(server)

            def stage(phase: str, done: int = 0, total: int = 0, /) -> None:
                progress.prepare(phase, done, total)
                teller.prepare(phase, done, total)

            last: FromSession = Refused("the run was interrupted", failed=True)
            try:
                with announced(server, run, "terminal"):
                    ended = run_session(
                        protocol,
                        prepared,
                        out=out,
                        operator=operator,
                        subscribers=[progress, teller],
                        requests=requests,
                        realtime=realtime,
                        about=about,
                        opened=lambda rig, publish: teller.opened(rig, publish, prepared),
                        progress=stage,
                    )
                last = ended_message(ended, out)
            except Exception as error:
                last = Refused(str(error), cause_of(error), failed=not isinstance(error, InvalidInput))
                raise
            finally:
                server.close(last, FAREWELL)
        except InvalidInput:
            raise
        except KeyboardInterrupt:
            # a summary exists only after a run: `check_folder` refuses a folder that already contains one
            if (out / SUMMARY).exists():
                raise KeyboardInterrupt(
                    f"interrupted after the run: {out} contains its results, without figures"
                ) from None
            raise KeyboardInterrupt("interrupted before anything moved") from None
        except (RockbenchError, OSError) as error:
            ended = error
    return ended, interrupts.exit_code


def _print_result(result: "SessionResult", out: Path, as_json: bool, interrupted: int | None) -> int:
    """Print the result; returns the exit code."""
    error, code = _error(result)
    print_result(
        lambda: {"status": result.status, "reason": result.reason, **result.summary},
        lambda: f"{result.table.rstrip()}\nResults are in {out}",
        as_json=as_json,
        error=error,
        code=code,
    )
    if result.status in GOOD:
        # a request to end that arrived after the end has no effect
        return 0 if error is None else 1
    print_error(f"run {result.status}: {result.reason}")
    return interrupted or (130 if result.interrupted else 1)


def _error(result: "SessionResult") -> tuple[str | None, Code]:
    """The error of a run for its JSON object, None if the run ended well, and the code of the error."""
    if result.status not in GOOD:
        return result.reason, "run_failed" if result.status == "failed" else "run_aborted"
    if result.passed:
        return None, "check_failed"
    completed = result.status == "completed"
    return "at least one check failed: see the points" if completed else "the check was not completed", "check_failed"
