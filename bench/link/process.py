"""The process of a session: `python -m bench.link.process`, started by `bench.link.client` and by nothing else.

It reads the client's address and key from standard input, connects, is given one assignment and carries it out.
"""

import json
import os
import signal
import sys
import traceback
from multiprocessing.connection import Client, Connection
from types import FrameType

from bench.catalogue import load_protocol
from bench.config.model import BenchConfiguration
from bench.engine.operator import Unattended
from bench.engine.requests import Requests
from bench.link.host import AtTheClient, Host, Teller
from bench.link.messages import Ended, FromSession, Refused, Run, Survey, Surveyed
from bench.preflight.compiled import compile_run
from bench.session import run_session
from sim.errors import CauseCode, InvalidInput, RockbenchError, cause_of

FAREWELL = 2.0
"""Longest wait at the end for a client that does not read [s]."""


def main() -> None:
    """Connect, carry out the assignment, tell how it ended."""
    told = json.loads(sys.stdin.readline())
    with Client(told["address"], authkey=bytes.fromhex(told["key"])) as connection:
        serve(connection)


def serve(connection: Connection) -> None:
    """Carry out the one assignment that comes over `connection`."""
    assignment = connection.recv()
    requests = Requests()
    keep_going = isinstance(assignment, Run) and assignment.keep_going

    def lost(why: str) -> None:
        if not keep_going:
            requests.stop(f"{why}, and the run was not told to go on without it", CauseCode.CLIENT_LOST)

    host = Host(connection, requests, lost)
    try:
        last = _run(assignment, host, requests) if isinstance(assignment, Run) else _survey(assignment)
    except KeyboardInterrupt:
        last = Refused(f"ended before anything moved: {requests.reason}", requests.cause)
    except InvalidInput as error:
        last = Refused(str(error), error.cause)
    except (RockbenchError, OSError) as error:
        last = Refused(str(error), cause_of(error), failed=True, details=traceback.format_exc())
    except Exception as error:
        text = f"{type(error).__name__}: {error}"
        host.close(Refused(text, failed=True, details=traceback.format_exc()), FAREWELL)
        raise
    host.close(last, FAREWELL)


def _survey(asked: Survey) -> FromSession:
    _give_way()
    prepared = load_protocol(asked.protocol).prepare(asked.parameters, asked.configuration, None)
    found = compile_run(asked.protocol, prepared, asked.out)
    room = found.room
    return Surveyed(
        margins=found.margins,
        refusal=None if found.refusal is None else str(found.refusal),
        warnings=found.warnings,
        duration=found.forecast.duration,
        needed=None if room is None else room.needed,
        free=None if room is None else room.free,
        plan_hash=found.plan_hash,
        prediction=prepared.prediction,
    )


def _run(asked: Run, host: Host, requests: Requests) -> FromSession:
    configuration = asked.configuration
    _abort_on_terminate(requests)

    protocol = load_protocol(asked.protocol)
    with requests.without_rig():
        if requests.strongest is not None:
            raise KeyboardInterrupt
        prepared = protocol.prepare(asked.parameters, configuration, None)
    teller = Teller(host)
    ended = run_session(
        protocol,
        prepared,
        out=asked.out,
        operator=AtTheClient(host, requests) if asked.person else Unattended(_policy(configuration)),
        subscribers=[teller],
        opened=teller.opened,
        requests=requests,
        realtime=asked.realtime,
        about=asked.about,
    )
    return Ended(ended.status, ended.reason, ended.summary, ended.table, asked.out, ended.passed, ended.cause)


def _policy(configuration: BenchConfiguration) -> str:
    """Who is said to have answered when no person does."""
    return "the bench itself" if configuration.serves_itself else "unattended run (chosen at the window)"


def _give_way() -> None:
    """Another session may be driving the table: it goes first. Windows was told when the process was made."""
    if sys.platform != "win32":
        os.nice(10)


def _abort_on_terminate(requests: Requests) -> None:
    def handle(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        # the hearing thread raises this signal too, for what a client has asked for
        if requests.strongest is None:
            requests.abort("the session's process was told to terminate")
        if requests.breaking is not None:
            raise requests.breaking()

    signal.signal(signal.SIGTERM, handle)


if __name__ == "__main__":
    main()
