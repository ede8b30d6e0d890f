"""The block's motion as the model has it, driven by the measured motion of the table: no sensor watches the block.

Narrow on purpose: `add` takes what was measured, `couple` says which spring is mounted, `at` gives an angle for the
picture. Who else knows the angle can stand in its place.
"""

import threading
from collections import deque
from dataclasses import dataclass
from queue import SimpleQueue
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from bench.link.messages import Traces
from bench.link.reduction import TRACES
from sim.errors import RockbenchError
from sim.specimen import Specimen

if TYPE_CHECKING:
    from sim.streaming import Stream

ACCELERATION = TRACES.index("acceleration")
TOLERANCE = 1e-6
"""Of the integration: a picture needs no more."""
KEPT = 1000
"""Angles that are kept: two seconds at two milliseconds."""
BEHIND = 2.0
"""How far the model may be behind what was measured [s of the bench's time]: a run may be faster than the clock."""
MOST = 2400
"""Blocks of a run that wait to be told of a spring: four minutes at a tenth of a second; of more, the model begins at
rest with the oldest that is kept."""


@dataclass(frozen=True, eq=False)
class _Piece:
    """Accelerations of the table [m/s2], `step` [s] apart, in bins from bench time `begin` [s] on."""

    begin: float
    step: float
    acceleration: NDArray[np.float64]


class ModelBlock:
    """Integrates in a thread of its own: the window neither waits for the compiled model nor for what it computes."""

    def __init__(self) -> None:
        self._work = SimpleQueue[_Piece | Specimen | None]()
        self._thread: threading.Thread | None = None
        self._lock = threading.Lock()
        self._time, self._angle = np.zeros(0), np.zeros(0)
        self._run, self._end = 0, 0.0
        self._stage: Literal["waiting", "going", "lost"] = "lost"
        self._waiting = deque[_Piece](maxlen=MOST)

    def couple(self, specimen: Specimen) -> None:
        """The specimen with the spring that is mounted in this run, or bare; once in a run."""
        if specimen.beta is None or self._stage != "waiting":
            return
        self._stage = "going"
        self._work.put(specimen)
        for piece in self._waiting:
            self._work.put(piece)
        self._waiting.clear()
        if self._thread is None:
            self._thread = threading.Thread(target=self._integrate, name="model of the block", daemon=True)
            self._thread.start()

    def add(self, traces: Traces) -> None:
        """Go on through the next block."""
        if traces.run != self._run:
            self._stage = "waiting"
            self._waiting.clear()
        elif abs(traces.begin - self._end) > traces.step:
            # of what came in a gap the model knows nothing, and so nothing of the rest of this run
            self._stage = "lost"
            self._waiting.clear()
        self._run, self._end = traces.run, traces.begin + traces.step * len(traces.low)
        middle = 0.5 * (traces.low[:, ACCELERATION].astype(np.float64) + traces.high[:, ACCELERATION])
        piece = _Piece(traces.begin, traces.step, middle)
        if self._stage == "waiting":
            self._waiting.append(piece)
        elif self._stage == "going":
            self._work.put(piece)

    def nearest(self, time: float) -> float:
        """The latest bench time [s] up to `time` at which the angle is known, so that frame and block are shown as they
        were at one moment; `time` itself where nothing is known of the last `BEHIND` seconds.
        """
        with self._lock:
            newest = float(self._time[-1]) if self._time.size else float("-inf")
        return newest if time - BEHIND <= newest < time else time

    def at(self, time: float) -> tuple[float, float] | None:
        """Angle [rad] at bench time [s], and how long ago the block last struck its base [s], infinite if it has not.

        None while nothing is known of that moment.
        """
        with self._lock:
            times, angles = self._time, self._angle
        if not times.size or not times[0] <= time <= times[-1] + 0.01:
            return None
        until = int(np.searchsorted(times, time, side="right"))
        sign = np.sign(angles[:until])
        struck = np.flatnonzero((sign[:-1] != 0.0) & (sign[1:] != sign[:-1]))
        ago = time - float(times[struck[-1] + 1]) if struck.size else float("inf")
        return float(angles[until - 1]), ago

    def close(self) -> None:
        """End the thread."""
        self._work.put(None)

    def _integrate(self) -> None:
        specimen: Specimen | None = None
        stream: Stream | None = None
        while (work := self._work.get()) is not None:
            if isinstance(work, Specimen):
                specimen, stream = work, None
            elif specimen is not None:
                stream = stream or _begun(specimen, work.step)
                if stream is None or not self._go_on(stream, work):
                    specimen = None

    def _go_on(self, stream: "Stream", piece: _Piece) -> bool:
        """Integrate over a piece; False where the model's block has fallen, or its input cannot be used."""
        try:
            states = stream.feed(piece.acceleration)
        except RockbenchError:
            return False
        first = len(piece.acceleration) - len(states) + 0.5
        times = piece.begin + piece.step * (first + np.arange(len(states), dtype=np.float64))
        self._keep(times, states[:, 4])
        return len(states) >= len(piece.acceleration) - 1

    def _keep(self, times: NDArray[np.float64], angles: NDArray[np.float64]) -> None:
        with self._lock:
            later = not self._time.size or (times.size and times[0] >= self._time[-1])
            before = (self._time, self._angle) if later else (np.zeros(0), np.zeros(0))
            self._time = np.append(before[0], times)[-KEPT:]
            self._angle = np.append(before[1], angles)[-KEPT:]


def _begun(specimen: Specimen, step: float) -> "Stream | None":
    from sim.streaming import Stream

    try:
        return Stream(specimen, step, peaks_from=None, tolerance=TOLERANCE)
    except RockbenchError:
        return None
