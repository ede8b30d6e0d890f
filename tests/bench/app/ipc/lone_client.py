"""A client that starts a run and looks after it: `python -m tests.bench.app.ipc.lone_client FOLDER [go on]`.

It prints the process of the session and every state of the bench; a test then kills or freezes it.
"""

import sys
import time
from pathlib import Path

from bench.app.ipc.messages import BEAT, Published
from bench.events import StateChanged
from tests.bench.app.ipc.experiment import begun


def main(out: Path, *, keep_going: bool) -> None:
    """Start the run, and stay until it is over."""
    link = begun(out, keep_going=keep_going, cycles=12 if keep_going else 400)
    print(link.process.pid, flush=True)
    while link.status not in ("over", "no link"):
        link.alive()
        for message in link.take():
            if isinstance(message, Published) and isinstance(message.event, StateChanged):
                print(message.event.after, flush=True)
        time.sleep(BEAT / 2)


if __name__ == "__main__":
    main(Path(sys.argv[1]), keep_going=len(sys.argv) > 2)
