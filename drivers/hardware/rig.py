"""The laboratory rig: DAQ and lasers, with the values of free-running sensors resampled to the DAQ's sample clock."""

from collections.abc import Generator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from drivers.clock import WallClock, now
from drivers.daqmx.clock_watch import ClockWatch
from drivers.daqmx.delays import InputDelay
from drivers.daqmx.inputs import NAME as INPUT_TASK
from drivers.daqmx.parameters import AUTOMATIC
from drivers.daqmx.session import DaqSession
from drivers.drive import REARM, RigBase, RigState, require_block
from drivers.emulation.control import ask, place_of
from drivers.errors import RigError, SafetyInputOpened
from drivers.further import FurtherChannel
from drivers.hardware.channels import analogue_channels, require_input_range
from drivers.hardware.ownership import devices_of, owned
from drivers.hardware.parameters import Hardware
from drivers.hardware.tracks import Tracks, open_serial_lasers
from drivers.rig import Alignment, Block, Channel, Counts, OperatorTask, RawValues
from drivers.timebase.deskew import Deskew
from drivers.timebase.marking import GOLDEN, Pulses, golden_pulses, observation_pulses

_SETTLING = 0.05
"""Shortest time between the end of the pulses and the first sample of a run [s]."""
_CHUNK = 0.02
"""Longest read during the pulses [s]; short, because each read also serves the watchdog and the heartbeat relay, whose
shortest time-out is 0.1 s, and whose line rises at every second read.
"""
_FIRST_READINGS = 20
"""Number of readings of the sample clock directly after its start, when there are no earlier ones."""

_READINGS = 6
"""Number of readings of the sample clock after each block; several readings bound the clock more tightly than one."""


class HardwareRig(RigBase):
    """DAQ and lasers as one rig. The sample clock starts with the first block that is read.

    Samples are corrected for the delays of filters and multiplexers. A block can be returned only when its most delayed
    input is complete, so the largest delay is added to `lead`, the number of drive samples that must be queued beyond a
    block.
    `further` are additional sensors. Raises InvalidInput or RigError if a device is missing, in use or inconsistent
    with the configuration; all devices are then closed.
    """

    def __init__(self, hardware: Hardware, *, lead: int, further: Sequence[FurtherChannel] = ()) -> None:
        inputs = [*(one for _, one in (*hardware.transducers, *hardware.analogue_lasers)), *further]
        with ExitStack() as opened:
            self._ownership = opened.enter_context(ExitStack())
            self._ownership.enter_context(owned(devices_of(hardware)))
            # the DAQ comes first: opening it brings the bench into a safe state after any earlier program
            marked = bool(hardware.serial_lasers) and hardware.daq.laser_marker is not None
            pulses = golden_pulses(hardware.lasers.rate) if marked else None
            self._daq = DaqSession(hardware.daq, inputs, hardware.sample_rate, lead, pulses)
            self._pulses = pulses if self._daq.marker is not None else None
            self._must_follow = hardware.daq.laser_marker != AUTOMATIC
            opened.callback(self._daq.close)
            scaled = analogue_channels(hardware, self._daq.scalings, self._daq.description, further)
            analogue = tuple(map(_with_delay, scaled, self._daq.delays))
            delays = [channel.delay for channel in analogue]
            self._deskew = Deskew(delays, self._daq.sample_rate, [channel.valid for channel in analogue])
            # a block can be returned only when its most delayed input is complete
            super().__init__(self._daq.drive_range, lead + self._deskew.latency, WallClock())
            self._laboratory = hardware.emulator_address
            if self._laboratory is not None:
                place_of(self._laboratory)
            for name, given in hardware.analogue_lasers:
                require_input_range(f"hardware.{name}.range", given.range, hardware.lasers.load)
            # add further kinds of sensors with their own clocks here
            tracks = open_serial_lasers(hardware)
            self._tracks = Tracks(tracks) if tracks else None
            if self._tracks is not None:
                opened.callback(self._tracks.close)
            self._watch: ClockWatch | None = None
            if self._tracks is not None and hardware.daq.server is not None:
                self._watch = ClockWatch(hardware.daq, INPUT_TASK, hardware.sample_rate)
                opened.callback(self._watch.close)
            self._between = None if self._pulses is None else observation_pulses(hardware.lasers.rate)
            if self._between is not None:
                self._daq.output_pulses(self._between)
            self._started = 0.0
            self.channels = analogue if self._tracks is None else (*analogue, *self._tracks.channels)
            self._opened = opened.pop_all()
        self.sample_rate = self._daq.sample_rate
        self.description = {
            "backend": "hardware",
            **self._daq.description,
            **{channel.name: channel.device for channel in self.channels},
        }
        self._failed = False
        self._phase = 0.0
        self.skipped = 0 if self._pulses is None else ceil((self._pulses.end + _SETTLING) * self.sample_rate)
        """Number of samples acquired before the first sample of each run, for the alignment of the lasers."""

    @property
    def alignments(self) -> tuple[Alignment, ...]:
        if self._tracks is None:
            return ()
        skipped = self.skipped / self.sample_rate
        return tuple(replace(one, offset=one.offset - skipped) for one in self._tracks.alignments)

    def raw_values(self) -> tuple[RawValues, ...]:
        return self._tracks.raw() if self._tracks is not None else ()

    def interlocks(self) -> Mapping[str, bool]:
        with self._ending_on_failure():
            return self._daq.safety_inputs()

    def arm(self) -> None:
        self.require_stopped("arm", REARM)
        cuts = self._daq.cuts
        if self._tracks is not None:
            self._tracks.begin(self.sample_rate, self.clock, self._between)
        with self._ending_on_failure():
            self._daq.prepare(cuts)
            if self.skipped:
                self._daq.write(np.zeros(self.skipped))
        self._drive.begin()
        self._deskew.begin()
        self._failed = False
        self._state = RigState.ARMED

    def write(self, volts: NDArray[np.float64]) -> None:
        self.require_armed("write")
        with self._ending_on_failure():
            samples = self._drive.append(volts)
            if samples.size:
                self._daq.write(samples)

    def read(self, n: int) -> Block:
        self.require_armed("read")
        require_block(n)
        with self._ending_on_failure():
            self._drive.require(n)
            if self._state is RigState.ARMED:
                self._start()
            counts = self._read_all(n)
        return Block(self._drive.advance(n), counts)

    def stop(self) -> None:
        was_stopped = self._state in (RigState.STOPPED, RigState.CLOSED)
        self._rest()
        if self._between is not None and not was_stopped:
            # the next run needs them, but can do without
            with suppress(RigError):
                self._daq.output_pulses(self._between)

    def halt(self) -> None:
        if self._state is RigState.CLOSED:
            return
        try:
            self._daq.cut()
        finally:
            self._rest()

    def close(self) -> None:
        if self._state is RigState.CLOSED:
            return
        self._state = RigState.CLOSED
        with self._raised_once(), self._opened:
            self._daq.stop()

    def perform(self, work: OperatorTask, amount: float | None = None) -> None:
        self.require_stopped(work.value)
        # on a real bench the operator has carried out the task; an emulated laboratory must change its virtual specimen
        if self._laboratory is not None:
            ask(self._laboratory, "handwork", work=work.value, amount=amount)

    def _rest(self) -> None:
        if self._state is RigState.CLOSED:
            return
        self._state = RigState.STOPPED
        with self._raised_once():
            self._daq.stop()

    def _start(self) -> None:
        self._daq.start()
        self._started = now()
        self._state = RigState.RUNNING
        if self._tracks is not None:
            self._observe_clock(self._tracks, _FIRST_READINGS)
            if self._pulses is not None:
                self._mark(self._tracks, self._pulses)

    def _mark(self, tracks: Tracks, pulses: Pulses) -> None:
        """Align the lasers by pulses before the first sample of the run; the drive is zero."""
        for chunk in np.array_split(np.arange(self.skipped), ceil(self.skipped / (_CHUNK * self.sample_rate))):
            self._daq.read(chunk.size)
            if opened := [name for name, is_good in self._daq.safety_inputs().items() if not is_good]:
                raise SafetyInputOpened(f"{', '.join(opened)} opened before the first sample of the run", opened)
            self._observe_clock(tracks, _READINGS)
        others = tracks.mark(pulses, self.lead)
        if others and self._must_follow:
            raise RigError(
                f"{' and '.join(others)} did not follow the pulses of hardware.daq.laser_marker; check the wire from "
                "the counter to the input that switches the laser on, or omit this key"
            )

    def _observe_clock(self, tracks: Tracks, times: int) -> None:
        """Add readings of the sample clock, each bounded by readings of the machine's clock before and after it. The
        readings of the separate process are used, if there are any; otherwise the clock is read `times` times here,
        unless that process has only just been started.

        The readings are spread over the sample period: if all were made right after a block, they would have the same
        phase, and the bounds would be no tighter than one period.
        """
        watched = [] if self._watch is None else self._watch.take()
        for before, count, after in watched:
            # an earlier reading may be from the previous run
            if before > self._started:
                tracks.observe(before, count, after)
        if self._watch is not None and self._watch.alive and (watched or times == _FIRST_READINGS):
            return
        for _ in range(times):
            self._phase = (self._phase + GOLDEN) % 1.0
            self.clock.wait_until(now() + self._phase / self.sample_rate)
            before = now()
            count = self._daq.acquired()
            tracks.observe(before, count, now())

    def _read_all(self, n: int) -> Counts:
        """Counts of all channels, shape (n, n_channels), from the DAQ and the tracks."""
        counts = self._deskew.moved(self._daq.read(self._deskew.missing(n)))
        if self._tracks is None:
            return counts
        self._observe_clock(self._tracks, _READINGS)
        return np.column_stack((counts, self._tracks.counts(self.skipped + self._drive.index, n, self.lead)))

    @contextmanager
    def _ending_on_failure(self) -> Generator[None]:
        """Context manager that cuts the output on any failure and raises the original error, not a consequential
        one.
        """
        try:
            yield
        except BaseException as error:
            try:
                self.halt()
            except RigError as second:
                # the message must also name the relay or output that could not be set
                error.args = (f"{error}; {second}", *error.args[1:])
            finally:
                self._failed = True
            raise

    @contextmanager
    def _raised_once(self) -> Generator[None]:
        """Context manager that suppresses a RigError raised while the devices are stopped, if an earlier failure was
        raised.
        """
        try:
            yield
        except RigError:
            if not self._failed:
                raise


def _with_delay(channel: Channel, delay: InputDelay) -> Channel:
    return replace(channel, delay=delay.seconds, delay_uncertainty=delay.uncertainty)
