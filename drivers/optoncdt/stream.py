"""Buffered stream of a sensor's measurements, filled by a thread from the output of the process that reads the port."""

from collections import deque
from dataclasses import dataclass
from threading import Condition, Thread

import numpy as np
from numpy.typing import NDArray

from drivers.child import ENDING
from drivers.clock import now
from drivers.errors import ConnectionLost
from drivers.optoncdt.codec import Decoder
from drivers.optoncdt.dialogue import USUAL, Dialogue, Reply
from drivers.optoncdt.frames import Assembler, Frames, Layout
from drivers.optoncdt.line import Line
from sim import waiting

_KEPT = 60.0
"""Duration held by the buffer of unread values [s]."""


@dataclass(frozen=True)
class Readings:
    """Measurements of one laser, each array of shape (n,).

    `index` is the number of the measurement since the start of the stream, with gaps where values were lost. `time` is
    the time of the measurement on the sensor's clock [s], `code` the raw word, and `arrival` the time on the machine's
    clock [s] by which its bytes had been read, an upper bound on their arrival.
    """

    index: NDArray[np.int64]
    time: NDArray[np.float64]
    code: NDArray[np.int32]
    arrival: NDArray[np.float64]

    def __len__(self) -> int:
        return int(self.index.size)


class Stream:
    """Values of the sensor on `line`, until `end`; `dialogue` parses the sensor's replies. Methods may be called from
    any thread.
    """

    def __init__(self, dialogue: Dialogue, line: Line, layout: Layout, rate: float) -> None:
        self._dialogue, self._line = dialogue, line
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
        """Arrival time of the last measurement on the machine's clock [s]; initially the start of the stream."""
        return self._last

    def ask(self, command: str, timeout: float = USUAL) -> list[str]:
        """Send a command while streaming; values that arrive with the reply are lost. Raises the errors of
        `Dialogue.ask`.
        """
        reply = Reply()
        with self._changed:
            self._reply = reply
        try:
            self._send(command)
            with self._changed:
                waiting.wait_for(self._changed, lambda: reply.complete or self._failure is not None, timeout)
        finally:
            with self._changed:
                self._reply = None
        self._raise_failure()
        return self._dialogue.judged(command, reply, timeout)

    def take(self) -> Readings:
        """The values received since the last call, limited to the last 60 s; never waits. After a failure, raises
        ConnectionLost once the values received before it have been taken.
        """
        with self._changed:
            held, self._held, self._holding = self._held, deque(), 0
        if not held:
            self._raise_failure()
            return Readings(np.empty(0, np.int64), np.empty(0), np.empty(0, np.int32), np.empty(0))
        frames = [frames for frames, _ in held]
        return Readings(
            np.concatenate([one.index for one in frames]),
            np.concatenate([one.time for one in frames]),
            np.concatenate([one.code for one in frames]),
            np.repeat([arrival for _, arrival in held], [one.index.size for one in frames]),
        )

    def wait(self, timeout: float) -> bool:
        """Wait until `take` returns values or raises; returns False after `timeout` [s]."""
        with self._changed:
            return waiting.wait_for(self._changed, lambda: self._holding > 0 or self._failure is not None, timeout)

    def end(self) -> None:
        """Stop reading and end the thread and the process; may be called repeatedly."""
        self._over = True
        self._line.close()
        # the thread waits for a process that the system does not end, such as one in a driver that hangs
        if waiting.join(self._thread, ENDING):
            self._line.release()

    def _send(self, command: str) -> None:
        try:
            self._line.write(command.encode("ascii") + b"\r\n")
        except (OSError, ValueError) as error:
            raise self._failure or self._dialogue.gone(error) from error

    def _run(self) -> None:
        try:
            for chunk, arrival in self._line.chunks():
                self._accept(chunk, arrival)
            if not self._over:
                self._fail(self._dialogue.gone(ConnectionLost("the process that reads its port has ended")))
        except ConnectionLost as error:
            self._fail(error)
        except Exception as error:
            # any decoding error ends the stream
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
        """Make later calls of `ask` and `take` raise ConnectionLost with the text of `error`."""
        with self._changed:
            self._failure = error
            self._changed.notify_all()

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise ConnectionLost(str(self._failure)) from self._failure
