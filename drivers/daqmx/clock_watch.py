"""Readings of the sample clock by a separate process, through a separate connection to a gRPC device server.

The readings do not delay the acquisition loop, and their duration does not depend on the load of that loop. If the
transmission times to and from the server differ, every time derived from a reading is shifted by half the difference,
both in the check of the bench and in a run.
"""

import json
import struct
import sys
import threading
import time
from collections import deque
from contextlib import suppress
from types import SimpleNamespace
from typing import IO, TYPE_CHECKING, Any

from drivers.child import ENDING, ChildProcess, ignore_requests
from drivers.clock import now
from drivers.timebase.marking import GOLDEN
from sim import waiting

if TYPE_CHECKING:
    from drivers.daqmx.parameters import Daq

_READING = struct.Struct("<dqd")
_PACE = 0.01
"""Pause between two readings [s]."""
_IDLE = 0.02
_MOST = 10_000

Reading = tuple[float, int, float]
"""Reading: machine's clock before the call [s], number of samples acquired, machine's clock after the call [s]."""


class ClockWatch:
    """Child process that reads the sample clock, of rate `rate` [1/s], of the task `name` on `daq.server`."""

    def __init__(self, daq: "Daq", name: str, rate: float) -> None:
        self._child = ChildProcess("drivers.daqmx.clock_watch", name, repr(rate))
        self._found: deque[Reading] = deque(maxlen=_MOST)
        self._thread = threading.Thread(target=self._collect, name="clock watch", daemon=True)
        self._thread.start()
        with suppress(OSError):
            self._child.write(_described(daq).encode() + b"\n")

    @property
    def alive(self) -> bool:
        """Whether the process can still deliver readings."""
        return self._thread.is_alive()

    def take(self) -> list[Reading]:
        """The readings since the last call."""
        return [self._found.popleft() for _ in range(len(self._found))]

    def close(self) -> None:
        """End the process; may be called repeatedly."""
        self._child.end()
        # the thread waits for a process that the system does not end
        if waiting.join(self._thread, ENDING):
            self._child.output.close()

    def _collect(self) -> None:
        while len(read := self._child.output.read(_READING.size)) == _READING.size:
            self._found.append(_READING.unpack(read))


def _described(daq: "Daq") -> str:
    """The connection to `daq.server` as one line of JSON."""
    return json.dumps(daq.model_dump(include={"server", "timeout_margin", "tls", "plain_connection"}))


def _serve(name: str, rate: float, daq: Any, readings: IO[bytes]) -> None:
    """Write readings until the connection to the server is lost."""
    from nidaqmx.errors import DaqError

    from drivers.daqmx import library
    from drivers.daqmx.connection import Connection

    connection = Connection.of(daq)
    # never closed, since that would clear the program's task
    stream = library.task(name, connection.attaching(name)).in_stream
    phase = 0.0
    while True:
        # the readings are distributed evenly over a sample period
        phase = (phase + GOLDEN) % 1.0
        time.sleep(_PACE)
        deadline = now() + phase / rate
        while now() < deadline:
            pass
        before = now()
        try:
            count = int(stream.total_samp_per_chan_acquired)
        except DaqError:
            # the task is not running
            time.sleep(_IDLE)
            continue
        after = now()
        if count > 0:
            readings.write(_READING.pack(before, count, after))
            readings.flush()


if __name__ == "__main__":
    import os

    ignore_requests()

    def await_end() -> None:
        sys.stdin.buffer.read()
        # a normal exit would let nidaqmx clear the program's tasks
        os._exit(0)

    # the models of the parameters are slow to import
    given = json.loads(sys.stdin.buffer.readline(), object_hook=lambda one: SimpleNamespace(**one))
    threading.Thread(target=await_end, daemon=True).start()
    try:
        _serve(sys.argv[1], float(sys.argv[2]), given, sys.stdout.buffer)
    except Exception:
        # the program then reads the clock itself
        os._exit(1)
