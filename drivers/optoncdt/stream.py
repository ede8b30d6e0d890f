"""Buffered stream of a sensor's measurements, with a thread that reads the port."""

import time
from collections import deque
from dataclasses import dataclass
from threading import Condition, Thread

import numpy as np
from numpy.typing import NDArray

from drivers.clock import now
from drivers.errors import ConnectionLost
from drivers.optoncdt.codec import Decoder
from drivers.optoncdt.dialogue import USUAL, Dialogue, Reply
from drivers.optoncdt.frames import Assembler, Frames, Layout
from sim import waiting

_PACE = 0.0025
"""Pause between two reads of the line [s]: the cost of a read does not depend on the number of bytes.

More frequent reads more often coincide with an arrival, which identifies the sensor's clock better.
"""
_KEPT = 60.0
"""Length of the buffer of unread values [s]."""


@dataclass(frozen=True)
class Readings:
    """Measurements of one laser, each array of shape (n,).

    `index` counts them since the start of the stream, with gaps where some were lost. `time` is the time of measurement
    on the sensor's own clock [s]. `code` are the raw words. `arrival` is the time on the machine's clock [s] when their
    bytes had been read: an upper bound of the arrival.
    """

    index: NDArray[np.int64]
    time: NDArray[np.float64]
    code: NDArray[np.int32]
    arrival: NDArray[np.float64]

    def __len__(self) -> int:
        return int(self.index.size)


class Stream:
    """Reads the port of `dialogue` until `end`. All methods may be called from any thread."""

    def __init__(self, dialogue: Dialogue, layout: Layout, rate: float) -> None:
        self._dialogue = dialogue
        self._decoder = Decoder()
        self._assembler = Assembler(dialogue.who, layout, rate)
        self._most = round(_KEPT * rate)
        self._held: deque[tuple[Frames, float]] = deque()
        self._holding = 0
        self._last = now()
        self._failure: ConnectionLost | None = None
        self._reply: Reply | None = None
        self._changed = Condition()
        self._over = False
        self._thread = Thread(target=self._run, name=dialogue.who, daemon=True)
        self._thread.start()

    @property
    def last_arrival(self) -> float:
        """Arrival of the last measurement, or start of the stream [s]."""
        return self._last

    def ask(self, command: str, timeout: float = USUAL) -> list[str]:
        """Send a command during the stream; values that arrive with the answer are lost. Raises as `Dialogue.ask`."""
        reply = Reply()
        with self._changed:
            self._reply = reply
        try:
            self._dialogue.send(command)
            with self._changed:
                waiting.wait_for(self._changed, lambda: reply.complete or self._failure is not None, timeout)
        finally:
            with self._changed:
                self._reply = None
        self._raise_failure()
        return self._dialogue.judged(command, reply, timeout)

    def take(self) -> Readings:
        """All values since the last call, 60 s at most; does not wait. Raises ConnectionLost."""
        self._raise_failure()
        with self._changed:
            held, self._held, self._holding = self._held, deque(), 0
        if not held:
            return Readings(np.empty(0, np.int64), np.empty(0), np.empty(0, np.int32), np.empty(0))
        frames = [frames for frames, _ in held]
        return Readings(
            np.concatenate([one.index for one in frames]),
            np.concatenate([one.time for one in frames]),
            np.concatenate([one.code for one in frames]),
            np.repeat([arrival for _, arrival in held], [one.index.size for one in frames]),
        )

    def wait(self, timeout: float) -> bool:
        """Wait until `take` has values or an error; False after `timeout` [s]."""
        with self._changed:
            return waiting.wait_for(self._changed, lambda: self._holding > 0 or self._failure is not None, timeout)

    def end(self) -> None:
        """Stop reading; no thread remains. Allowed any number of times."""
        self._over = True
        waiting.join(self._thread)

    def _run(self) -> None:
        port = self._dialogue.port
        try:
            while not self._over:
                time.sleep(_PACE)
                # bytes already received may be old; the arrival time of the next byte is known
                chunk = port.read(port.in_waiting) + port.read(1)
                chunk += port.read(port.in_waiting)
                if chunk:
                    self._accept(chunk, now())
        except ConnectionLost as error:
            self._fail(error)
        except Exception as error:
            # the library raises various errors when a port disappears; end reading after any of them
            self._fail(self._dialogue.gone(error))

    def _accept(self, chunk: bytes, arrival: float) -> None:
        with self._changed:
            reply = self._reply
            if reply is not None and not reply.complete:
                reply.feed(chunk)
                chunk = reply.rest
                self._decoder.restart()
                if reply.complete:
                    self._changed.notify_all()
        frames = self._assembler.feed(self._decoder.feed(chunk))
        if not (count := frames.index.size):
            return
        with self._changed:
            self._last = arrival
            self._held.append((frames, arrival))
            self._holding += count
            while self._holding > self._most:
                self._holding -= self._held.popleft()[0].index.size
            self._changed.notify_all()

    def _fail(self, error: ConnectionLost) -> None:
        """Raise `error` from every later call."""
        with self._changed:
            self._failure = error
            self._changed.notify_all()

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise ConnectionLost(str(self._failure)) from self._failure
