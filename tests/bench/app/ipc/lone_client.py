"""A client that starts a run and looks after it:
`python -m tests.bench.app.ipc.lone_client FOLDER [go on [CYCLES [LINK]]]`.

It prints the process of the session and every state of the bench; a test then kills or freezes it. LINK is the number
of a socket at whose other end the session is forked.
"""

import socket
import sys
import time
from pathlib import Path

from bench.app.ipc import client
from bench.app.ipc.messages import BEAT, Ended, Published, Refused
from bench.events import StateChanged
from tests.bench.app.ipc.experiment import begun
from tests.forked_sessions import forking


def main(out: Path, *, keep_going: bool, cycles: int) -> None:
    """Start the run, and stay until it is over."""
    link = begun(out, keep_going=keep_going, cycles=cycles)
    print(link.process.pid, flush=True)
    # a session that is silent for a while, on a busy machine, is not lost
    while link.status != "over" and link.lives:
        link.alive()
        for message in link.take():
            if isinstance(message, Published) and isinstance(message.event, StateChanged):
                print(message.event.after, flush=True)
            elif isinstance(message, Ended | Refused):
                # shown with the failure of a test that did not expect the end
                print(message, file=sys.stderr, flush=True)
        time.sleep(BEAT / 2)


if __name__ == "__main__":
    folder, *options = sys.argv[1:]
    if len(options) > 2:
        client.subprocess = forking(socket.socket(fileno=int(options[2])))  # pyright: ignore[reportAttributeAccessIssue]
    main(Path(folder), keep_going=bool(options), cycles=int(options[1]) if len(options) > 1 else 12 if options else 400)
