"""The command `rockbench watch`, and the live page that `--watch` adds to a run."""

import json
import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated

from cyclopts import Group, Parameter

from bench.app.cli.options import Handed, switch
from bench.app.cli.output import print_warning
from bench.progress import silent
from sim.errors import InvalidInput, RockbenchError


@Parameter(name="*", group=Group("Live page", sort_key=3))
@dataclass(frozen=True, kw_only=True)
class PageOptions:
    """Options of the live page."""

    address: Annotated[
        str,
        Parameter(
            metavar="ADDRESS",
            help="Network address on which the page is served; 0.0.0.0 means all network interfaces of this computer.",
            show_default="127.0.0.1, for browsers on this computer only",
        ),
    ] = "127.0.0.1"
    port: Annotated[int, Parameter(metavar="INT", help="Port of the page.", show_default="any free port")] = 0
    no_token: Annotated[
        bool, switch("Serve the page without a secret in its address; allowed on a loopback address only.")
    ] = False


def watch(*, page: PageOptions = PageOptions(), progress: Handed = silent) -> int:
    """Serve a read-only live page of the run under way on this computer.

    The page shows the verdict, the state, the limit meters, a picture of the specimen, the traces, the points and the
    log of every run that a window or `rockbench run` starts. It cannot change or stop a run. Its address, which
    contains a secret unless --no-token is given, is printed on standard output. Ctrl-C ends the command.
    """
    progress("starting the live page")
    from bench.app.cli.interrupt import until_interrupted
    from bench.app.watch.serving import LivePage

    _warn(page)
    served = LivePage(page.address, page.port, with_token=not page.no_token)
    with until_interrupted() as over:
        print(served.url, flush=True)
        served.serve(over)
    return 0


@contextmanager
def live_page(page: PageOptions) -> Generator[None]:
    """Context manager in which a child process serves the live page of this process's run. Raises InvalidInput if the
    page cannot be served, and RockbenchError if the child process ends without an answer.
    """
    from drivers.child import ChildProcess

    _warn(page)
    child = ChildProcess("bench.app.watch.process")
    try:
        assignment = {
            "address": page.address,
            "port": page.port,
            "with_token": not page.no_token,
            "process": os.getpid(),
        }
        child.write(json.dumps(assignment).encode() + b"\n")
        line = child.output.readline()
        if not line:
            raise RockbenchError("the process of the live page ended without a message; start the run without --watch")
        answer = json.loads(line)
        if "url" not in answer:
            raise InvalidInput(answer["item"], answer["value"], answer["allowed"])
        print(f"live page: {answer['url']}", file=sys.stderr, flush=True)
        yield
    finally:
        child.end()


def _warn(page: PageOptions) -> None:
    from bench.app.watch.server import is_loopback

    if not is_loopback(page.address) and not page.no_token:
        print_warning("the live page is not encrypted: everybody on the network who learns its address can read it")
