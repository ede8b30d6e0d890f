"""The process of the live page of one run: `python -m bench.app.watch.process`, started by `rockbench run --watch`.

It reads its assignment from standard input, one line of JSON, writes the address of the page or the reason for a
refusal to standard output, and ends when its input is closed.
"""

import json
import os
import sys
import threading

from bench.app.watch.serving import LivePage
from drivers.child import ignore_requests
from sim.errors import InvalidInput


def main() -> None:
    """Serve the page until standard input is closed."""
    ignore_requests()
    if sys.platform != "win32":
        # lower the priority, so that the run takes precedence
        os.nice(5)
    assignment = json.loads(sys.stdin.readline())
    try:
        page = LivePage(
            assignment["address"],
            assignment["port"],
            with_token=assignment["with_token"],
            process=assignment["process"],
        )
    except InvalidInput as refused:
        print(json.dumps({"item": refused.item, "value": refused.value, "allowed": refused.allowed}), flush=True)
        return
    print(json.dumps({"url": page.url}), flush=True)
    over = threading.Event()

    def wait_for_end() -> None:
        sys.stdin.read()
        over.set()

    threading.Thread(target=wait_for_end, name="input", daemon=True).start()
    page.serve(over)


if __name__ == "__main__":
    main()
