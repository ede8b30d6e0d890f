"""Load of the live page: `python -m tests.benchmarks.live_page [SECONDS]`, on Linux.

A simulated run in real time is followed by `rockbench watch`, first without browsers, then with ten that receive every
change. Printed, beside its target: processor time of the page's process as a share of one core, messages per second and
browser, and how late the blocks of the run arrived without and with the browsers.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from threading import Thread
from urllib.parse import urlsplit

import numpy as np

from bench.datafile.reader import open_datafile
from tests.patience import LONG, eventually

BROWSERS, SHARE = 10, 5.0
"""Number of browsers, and largest share of a core that they may cost [%]."""


def spent(process: subprocess.Popen[str]) -> float:
    """Processor time of a process [s]."""
    fields = Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@contextmanager
def program(*words: str) -> Generator[subprocess.Popen[str]]:
    """A command of `rockbench`, ended by SIGTERM."""
    command = [sys.executable, "-m", "bench", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            yield process
        finally:
            process.terminate()
            process.wait(LONG)


def listen(stream: HTTPResponse, counts: list[int], number: int) -> None:
    """Count the messages of one browser until its connection ends."""
    try:
        for line in stream:
            counts[number] += line.startswith(b"data: ")
    except (OSError, ValueError, AttributeError):
        # closed by the main thread
        return


def lateness(path: Path, begin: float, end: float) -> tuple[float, float]:
    """Median and largest lateness [ms] of the blocks that arrived between two shares of the recorded blocks."""
    with open_datafile(path) as record:
        times, rows, rate = np.asarray(record.blocks["time"]), np.asarray(record.blocks["row"]), record.sample_rate
    part = slice(int(begin * times.size), int(end * times.size))
    late = 1e3 * (times - rows / rate)[part]
    late -= late.min()
    return float(np.median(late)), float(late.max())


def main(seconds: float) -> None:
    with tempfile.TemporaryDirectory() as folder, ExitStack() as held:
        os.environ["ROCKBENCH_SESSIONS"] = str(Path(folder, "sessions"))
        out = Path(folder, "run")
        point = ("--omega", "16", "--beta", "0.4", "--yes", "--realtime", "--out", str(out))
        run = held.enter_context(program("run", "harmonic", *point))
        page = held.enter_context(program("watch"))
        assert page.stdout is not None
        address = urlsplit(next(word for word in page.stdout.readline().split() if word.startswith("http")))
        eventually(lambda: (out / "campaign.h5").exists())
        time.sleep(seconds)
        alone, began = spent(page), time.monotonic()
        time.sleep(seconds)
        idle = (spent(page) - alone) / (time.monotonic() - began)
        counts = [0] * BROWSERS
        for number in range(BROWSERS):
            connection = HTTPConnection(address.hostname or "", address.port or 0)
            held.callback(connection.close)
            connection.request("GET", f"{address.path}events")
            Thread(target=listen, args=(connection.getresponse(), counts, number), daemon=True).start()
        before, received, began = spent(page), sum(counts), time.monotonic()
        time.sleep(seconds)
        length = time.monotonic() - began
        busy, heard = (spent(page) - before) / length, (sum(counts) - received) / BROWSERS / length
        assert run.poll() is None
        print(f"page without browsers {100.0 * idle:.1f} % of a core; with {BROWSERS}: {100.0 * busy:.1f} %", end=" ")
        print(f"(target {SHARE:g} %), {heard:.1f} messages/s and browser")
        for name, begin, end in (("without", 0.4, 0.64), ("with", 0.7, 1.0)):
            median, largest = lateness(out / "campaign.h5", begin, end)
            print(f"lateness of the blocks {name} browsers: median {median:.1f} ms, largest {largest:.1f} ms")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
