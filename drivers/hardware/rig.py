"""The bench in the laboratory behind the interface of every rig: the DAQ is master, what has a clock of its own is
placed on its clock."""

from collections.abc import Generator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from enum import Enum
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock, WallClock, now
from drivers.daqmx.session import DaqSession
from drivers.drive import Drive, require_block
from drivers.errors import RigError
from drivers.further import FurtherChannel
from drivers.hands import Person, RemoteHands
from drivers.hardware.channels import analogue_channels
from drivers.hardware.parameters import Hardware
from drivers.hardware.serial_lasers import open_serial_lasers
from drivers.hardware.tracks import Tracks
from drivers.optoncdt.analogue import require_input_range
from drivers.rig import Alignment, Block, Channel, Counts, Handwork

_FIRST_LOOKS = 20
"""How often the sample clock is read when it has just been started: it is then known to a fraction of a call."""

_GOLDEN = 0.6180339887498949
"""Step between the phases of two looks: its multiples fill a period evenly."""
_LOOKS = 6
"""How often it is read after each block: the best of a few calls is much better than one."""


class _State(Enum):
    STOPPED = "not armed"
    ARMED = "armed"
    RUNNING = "running"
    CLOSED = "closed"


class HardwareRig:
    """DAQ and lasers as one rig. The sample clock starts with the first block that is read.

    `lead` is the number of drive samples that must be waiting, `further` are sensors besides those of every bench.
    Raises InvalidInput or RigError when the bench is not as configured; nothing is left open then.
    """

    def __init__(self, hardware: Hardware, *, lead: int, further: Sequence[FurtherChannel] = ()) -> None:
        self._clock = WallClock()
        inputs = [*(one for _, one in (*hardware.transducers, *hardware.analogue_lasers)), *further]
        with ExitStack() as opened:
            # the DAQ before all that can fail: opening it makes the bench safe, whatever an earlier program left
            self._daq = DaqSession(hardware.daq, inputs, hardware.sample_rate, lead)
            opened.callback(self._daq.close)
            self._drive = Drive(self._daq.drive_range, lead)
            self._hands = RemoteHands(hardware.hands) if hardware.hands is not None else Person()
            for name, given in hardware.analogue_lasers:
                require_input_range(f"hardware.{name}.range", given.range, hardware.lasers.load)
            # a second kind of sensor with a clock of its own joins this list
            tracks = open_serial_lasers(hardware)
            self._tracks = Tracks(tracks) if tracks else None
            if self._tracks is not None:
                opened.callback(self._tracks.close)
            analogue = analogue_channels(hardware, self._daq.scalings, self._daq.description, further)
            self._channels = analogue if self._tracks is None else (*analogue, *self._tracks.channels)
            self._opened = opened.pop_all()
        self._state = _State.STOPPED
        self._failed = False
        self._phase = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        return self._channels

    @property
    def sample_rate(self) -> float:
        return self._daq.sample_rate

    @property
    def drive_range(self) -> float:
        return self._daq.drive_range

    @property
    def lead(self) -> int:
        return self._drive.lead

    @property
    def clock(self) -> Clock:
        return self._clock

    @property
    def description(self) -> dict[str, str]:
        return {
            "backend": "hardware",
            **self._daq.description,
            **{channel.name: channel.device for channel in self._channels},
        }

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        return self._tracks.alignments if self._tracks is not None else ()

    def interlocks(self) -> Mapping[str, bool]:
        with self._ending_on_failure():
            return self._daq.safety_inputs()

    def arm(self) -> None:
        if self._state is not _State.STOPPED:
            raise RigError(f"arm is refused: the rig is {self._state.value}; stop it first, or open a new one")
        if self._tracks is not None:
            self._tracks.begin(self.sample_rate, self._clock)
        with self._ending_on_failure():
            self._daq.prepare()
        self._drive.begin()
        self._failed = False
        self._state = _State.ARMED

    def write(self, volts: NDArray[np.float64]) -> None:
        self._require_armed("write")
        with self._ending_on_failure():
            samples = self._drive.append(volts)
            if samples.size:
                self._daq.write(samples)

    def read(self, n: int) -> Block:
        self._require_armed("read")
        require_block(n)
        with self._ending_on_failure():
            self._drive.require(n)
            if self._state is _State.ARMED:
                self._start()
            counts = self._read_all(n)
        return Block(self._drive.advance(n), counts)

    def stop(self) -> None:
        if self._state is _State.CLOSED:
            return
        self._state = _State.STOPPED
        with self._told_once():
            self._daq.stop()

    def halt(self) -> None:
        if self._state is _State.CLOSED:
            return
        try:
            self._daq.cut()
        finally:
            self.stop()

    def close(self) -> None:
        if self._state is _State.CLOSED:
            return
        self._state = _State.CLOSED
        with self._told_once(), self._opened:
            self._daq.stop()

    def handwork(self, work: Handwork, amount: float | None = None) -> None:
        if self._state is not _State.STOPPED:
            raise RigError(f"{work.value} is refused: the rig is {self._state.value}; hands belong on a stopped rig")
        self._hands.do(work, amount)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _start(self) -> None:
        self._daq.start()
        self._state = _State.RUNNING
        if self._tracks is not None:
            self._look_at_clock(self._tracks, _FIRST_LOOKS)

    def _look_at_clock(self, tracks: Tracks, times: int) -> None:
        """Bound the sample clock between two looks at the machine's clock.

        The looks are spread over the sample period: right after a block they would all fall on one phase of it, and
        the bounds would be no tighter than a period.
        """
        for _ in range(times):
            self._phase = (self._phase + _GOLDEN) % 1.0
            self._clock.wait_until(now() + self._phase / self.sample_rate)
            before = now()
            count = self._daq.acquired()
            tracks.observe(before, count, now())

    def _read_all(self, n: int) -> Counts:
        """Counts of all channels, shape (n, n_channels): from the DAQ, and from the tracks."""
        counts = self._daq.read(n)
        if self._tracks is None:
            return counts
        self._look_at_clock(self._tracks, _LOOKS)
        return np.column_stack((counts, self._tracks.counts(self._drive.index, n)))

    def _require_armed(self, what: str) -> None:
        if self._state not in (_State.ARMED, _State.RUNNING):
            raise RigError(f"{what} is refused: the rig is {self._state.value}; arm it first")

    @contextmanager
    def _ending_on_failure(self) -> Generator[None]:
        """Whatever fails inside, the output is cut, and what failed is what is told."""
        try:
            yield
        except BaseException as error:
            try:
                self.halt()
            except RigError as second:
                # that relay or output did not obey is part of what failed
                error.args = (f"{error}; {second}", *error.args[1:])
            finally:
                self._failed = True
            raise

    @contextmanager
    def _told_once(self) -> Generator[None]:
        """A device that has failed may fail again when it is stopped: that has been told."""
        try:
            yield
        except RigError:
            if not self._failed:
                raise
