"""The measurements of a sensor as they arrive: a thread reads the port, the values wait until they are taken."""

import time
from collections import deque
from dataclasses import dataclass
from threading import Condition, Thread

import numpy as np
from numpy.typing import NDArray

from drivers.clock import now
from drivers.errors import ConnectionLost
from drivers.optoncdt.codec import Decoder
from drivers.optoncdt.dialogue import USUAL, Dialogue
from drivers.optoncdt.frames import Assembler, Frames
from drivers.optoncdt.layout import Layout
from drivers.optoncdt.reply import Reply

_PACE = 0.0025
"""How long the line is left alone between two reads [s]: each costs the same, however much there is. The more reads,
the more often one of them comes just when values do, and the clock of the sensor is known by these."""
_KEPT = 60.0
"""How much is kept when nobody takes it [s]."""


@dataclass(frozen=True)
class Readings:
    """Measurements of one laser, each array of shape (n,).

    `index` counts them since the stream was started, with gaps where some were lost. `time` is when they were taken,
    on the sensor's own clock [s]. `code` are the words as they came. `arrival` is when the bytes that they came with
    had been read, on the machine's clock [s]: they had arrived then, perhaps some time before.
    """

    index: NDArray[np.int64]
    time: NDArray[np.float64]
    code: NDArray[np.int32]
    arrival: NDArray[np.float64]

    def __len__(self) -> int:
        return int(self.index.size)


class Stream:
    """Reads the port of `dialogue` from now on, until `end`. All methods may be called from any thread."""

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
        """When the last measurement arrived, or the stream was made [s]."""
        return self._last

    def ask(self, command: str, timeout: float = USUAL) -> list[str]:
        """Give a command while values come; those that come with the answer are lost. Raises as `Dialogue.ask`."""
        reply = Reply()
        with self._changed:
            self._reply = reply
        try:
            self._dialogue.send(command)
            with self._changed:
                self._changed.wait_for(lambda: reply.complete or self._failure is not None, timeout)
        finally:
            with self._changed:
                self._reply = None
        self._raise_failure()
        return self._dialogue.judged(command, reply, timeout)

    def take(self) -> Readings:
        """Everything that came since the last time, the last 60 s at most; does not wait. Raises ConnectionLost."""
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
        """Wait until there is something to take, or a failure to be told; False when `timeout` [s] passed before."""
        with self._changed:
            return self._changed.wait_for(lambda: self._holding > 0 or self._failure is not None, timeout)

    def end(self) -> None:
        """Stop reading; no thread is left. Allowed any number of times."""
        self._over = True
        self._thread.join()

    def _run(self) -> None:
        port = self._dialogue.port
        try:
            while not self._over:
                time.sleep(_PACE)
                # what has waited may have come long ago; what comes next tells when it came
                chunk = port.read(port.in_waiting) + port.read(1)
                chunk += port.read(port.in_waiting)
                if chunk:
                    self._accept(chunk, now())
        except ConnectionLost as error:
            self._fail(error)
        except Exception as error:
            # the library fails in many ways when a port goes, and whatever it is, nobody reads any more
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
        """Have `error` told by everything that is asked from now on."""
        with self._changed:
            self._failure = error
            self._changed.notify_all()

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise ConnectionLost(str(self._failure)) from self._failure
