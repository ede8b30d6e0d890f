"""A rig whose table follows the drive exactly: for tests of what stands above a rig."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.clock import VirtualClock
from drivers.rig import Alignment, Block, Channel, DriveUnderflow, Handwork, RigError

COUNTS_PER_UNIT = 1000.0


def channel(name: str, quantity: str, unit: str) -> Channel:
    return Channel(name, quantity, unit, 1.0 / COUNTS_PER_UNIT, 0.0, (-32767, 32767), "loopback")


class LoopbackRig:
    """Each channel reports `response(volts)`; -32768 stands for a sample that is no measurement."""

    def __init__(
        self,
        response: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] | None = None,
        lead: int = 100,
        sample_rate: float = 1000.0,
    ) -> None:
        self.response = response or {
            "table_displacement": lambda volts: 0.01 * volts,
            "table_acceleration": lambda volts: volts,
            "laser_1": lambda volts: 0.001 * volts,
            "laser_2": lambda volts: 0.002 * volts,
        }
        self.channels = tuple(channel(name, "displacement", "m") for name in self.response)
        self.sample_rate, self.drive_range, self.lead = sample_rate, 10.0, lead
        self.clock = VirtualClock()
        self.description = {"rig": "loopback"}
        self.alignments: tuple[Alignment, ...] = ()
        self.armed = False
        self.halted = False
        self.done: list[Handwork] = []
        self.played = np.zeros(0)
        self.safety: dict[str, bool] = {}
        self.alignments: tuple[Alignment, ...] = ()
        self._queue = np.zeros(0)
        self._index = 0

    def interlocks(self) -> dict[str, bool]:
        return self.safety

    def arm(self) -> None:
        self.armed, self._index, self._queue = True, 0, np.zeros(0)

    def write(self, volts: NDArray[np.float64]) -> None:
        if not self.armed:
            raise RigError("written to while not armed")
        self._queue = np.concatenate((self._queue, volts))

    def read(self, n: int) -> Block:
        if not self.armed:
            raise RigError("read while not armed")
        if self._queue.size < n:
            raise DriveUnderflow("the output ran dry")
        now, self._queue = self._queue[:n], self._queue[n:]
        self.played = np.concatenate((self.played, now))
        self.clock.wait_until(self.clock.now() + n / self.sample_rate)
        values = np.stack([respond(now) for respond in self.response.values()], axis=1)
        counts = np.where(np.isnan(values), -32768, np.round(np.nan_to_num(values) * COUNTS_PER_UNIT))
        first, self._index = self._index, self._index + n
        return Block(first, counts.astype(np.int16))

    def stop(self) -> None:
        self.armed, self._queue = False, np.zeros(0)

    def halt(self) -> None:
        self.halted = True
        self.stop()

    def close(self) -> None:
        self.stop()

    def handwork(self, work: Handwork, amount: float | None = None) -> None:  # noqa: ARG002
        if self.armed:
            raise RigError("hands off: the rig is armed")
        self.done.append(work)
