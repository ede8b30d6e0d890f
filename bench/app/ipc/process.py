"""The session process: `python -m bench.app.ipc.process`, started only by `bench.app.ipc.client`.

It reads the client's address and key from standard input, connects, receives one assignment and carries it out.
"""

import gc
import json
import os
import signal
import sys
import traceback
from multiprocessing.connection import Client, Connection
from types import FrameType

from bench.app.catalogue import load_protocol
from bench.app.ipc.announcement import announced
from bench.app.ipc.messages import FromSession, PlanCheck, PlanChecked, Refused, Run, ended_by_files
from bench.app.ipc.server import FAREWELL, Publisher, RemoteOperator, SessionServer, ended_message
from bench.app.preflight import compile_run, prepare
from bench.app.session import run_session
from bench.config.model import BenchConfiguration
from bench.engine.interface import Requests, Unattended
from sim.errors import CauseCode, InvalidInput, RockbenchError, cause_of
from sim.waiting import STEP


def main() -> None:
    """Connect, carry out the assignment and send its result."""
    told = json.loads(sys.stdin.readline())
    with Client(told["address"], authkey=bytes.fromhex(told["key"])) as connection:
        serve(connection)
    # otherwise Python searches all objects for unreachable ones at its end, which takes a third of a second
    gc.freeze()


def serve(connection: Connection) -> None:
    """Carry out the assignment received over `connection`."""
    while not connection.poll(STEP):
        pass
    assignment = connection.recv()
    requests = Requests()
    keep_going = isinstance(assignment, Run) and assignment.keep_going

    def lost(why: str) -> None:
        if not keep_going:
            requests.stop(f"{why}, and the run was not set to continue without a client", CauseCode.CLIENT_LOST)

    virtual = isinstance(assignment, Run) and not assignment.paced
    host = SessionServer(connection, requests, lost, virtual=virtual)
    try:
        if isinstance(assignment, Run):
            with announced(host, assignment, "window"):
                last = _run(assignment, host, requests)
        else:
            last = _check_plan(assignment)
    except KeyboardInterrupt:
        refused = Refused(f"ended before anything moved: {requests.reason}", requests.cause)
        # the results of a run whose figures were being drawn are complete
        ended = ended_by_files(assignment.out) if isinstance(assignment, Run) else None
        host.close(ended or refused, FAREWELL)
        # a normal exit would call the destructors of the objects of an interrupted call
        os._exit(0)
    except InvalidInput as error:
        last = Refused(str(error), error.cause)
    except (RockbenchError, OSError) as error:
        last = Refused(str(error), cause_of(error), failed=True, details=traceback.format_exc())
    except Exception as error:
        text = f"{type(error).__name__}: {error}"
        host.close(Refused(text, failed=True, details=traceback.format_exc()), FAREWELL)
        raise
    host.close(last, FAREWELL)


def _check_plan(assignment: PlanCheck) -> FromSession:
    _give_way()
    prepared = load_protocol(assignment.protocol).prepare(assignment.parameters, assignment.configuration, None)
    found = compile_run(assignment.protocol, prepared, assignment.out)
    room = found.room
    return PlanChecked(
        margins=found.margins,
        refusal=None if found.refusal is None else str(found.refusal),
        warnings=found.warnings,
        duration=found.forecast.duration,
        needed=None if room is None else room.needed,
        free=None if room is None else room.free,
        plan_hash=found.plan_hash,
        prediction=prepared.prediction,
    )


def _run(assignment: Run, host: SessionServer, requests: Requests) -> FromSession:
    configuration = assignment.configuration
    _abort_on_terminate(requests)

    protocol, teller = load_protocol(assignment.protocol), Publisher(host)
    with requests.without_rig():
        if requests.strongest is not None:
            raise KeyboardInterrupt
        prepared = prepare(protocol, assignment.parameters, configuration, teller.prepare)
    ended = run_session(
        protocol,
        prepared,
        out=assignment.out,
        operator=RemoteOperator(host, requests) if assignment.person else Unattended(_policy(configuration)),
        subscribers=[teller],
        opened=lambda rig, publish: teller.opened(rig, publish, prepared),
        progress=teller.prepare,
        requests=requests,
        realtime=assignment.realtime,
        about=assignment.about,
    )
    return ended_message(ended, assignment.out)


def _policy(configuration: BenchConfiguration) -> str:
    """Recorded name of the operator for automatic answers."""
    return "the bench itself" if configuration.serves_itself else "unattended run, chosen at the window"


def _give_way() -> None:
    """Lower the priority of a plan check, since another session may be driving the table. On Windows the priority is
    set when the process is created.
    """
    if sys.platform != "win32":
        os.nice(10)


def _abort_on_terminate(requests: Requests) -> None:
    def handle(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        # the receiving thread also raises this signal, at a client's request
        if requests.strongest is None:
            requests.abort("the session process received a request to terminate")
        requests.break_off(frame)

    signal.signal(signal.SIGTERM, handle)


if __name__ == "__main__":
    main()
