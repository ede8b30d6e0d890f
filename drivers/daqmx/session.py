"""Session with a DAQ device: drive output, inputs and enable relay under one state machine."""

import threading
from collections.abc import Generator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from enum import Enum
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drivers.daqmx import library
from drivers.daqmx.connection import Connection
from drivers.daqmx.delays import InputDelay
from drivers.daqmx.devices import checked_devices, described
from drivers.daqmx.errors import translated
from drivers.daqmx.inputs import InputScaling
from drivers.daqmx.output import put_to_zero
from drivers.daqmx.parameters import AnalogInput, Daq, device_name
from drivers.daqmx.safety import EnableLine, reset_chassis
from drivers.daqmx.stale import clear_stale
from drivers.daqmx.tasks import Tasks, chassis_of, description_of
from drivers.errors import ConnectionLost, RigError
from drivers.timebase.marking import Pulses
from sim.errors import InvalidInput


class _State(Enum):
    IDLE = "not prepared"
    PREPARED = "prepared, not started"
    RUNNING = "running"
    FAILED = "stopped by an error: stop it, then prepare it again"
    CLOSED = "closed"


class DaqSession:
    """Session with a DAQ device whose output and inputs share start trigger and sample clock: output sample i is played
    while input sample i is acquired.

    The output is clocked from the terminal of the inputs' sample clock. A device that cannot route this signal rejects
    the output; `hardware.daq.clock` must then name another terminal, or OnboardClock for a separate output clock, which
    starts with the inputs and stays synchronous if both clocks have the same timebase. There is no automatic fallback.

    `pulses` are output at `daq.laser_marker`, beginning with the start of each run. A run consists of `prepare`,
    `write` with the first samples, `start`, `write` and `read` in turn, and `stop`. On any failure during a run, the
    session attempts to open the relay and to set the output to zero before the error is raised.

    One thread at a time may use a session; `cut`, `stop` and `close` may be called from any other thread. The
    constructor attempts to bring the bench into a safe state before it checks anything. It raises InvalidInput for
    unsupported settings and for a sample rate that the device cannot produce exactly, and DeviceNotFound if the driver,
    the server or a device is missing or held by another program.
    """

    def __init__(
        self, daq: Daq, inputs: Sequence[AnalogInput], sample_rate: float, lead: int, pulses: Pulses | None = None
    ) -> None:
        self._lock = threading.RLock()
        self._state = _State.IDLE
        self._at_rest = True
        self._cut, self._cuts = False, 0
        self._lost = False
        self._connection = Connection.of(daq)
        try:
            # before any check: an earlier program may have crashed with the shaker enabled
            terminals = (daq.output, *daq.digital_lines.values(), *(given.terminal for given in inputs))
            stale = clear_stale(self._connection, [device_name(terminal) for terminal in terminals])
            _make_safe(self._connection, daq)
            with translated("listing the driver's devices"):
                system = library.system(self._connection.options())
                used = checked_devices(system, daq, inputs, sample_rate, lead)
                version = system.driver_version
            self._tasks = Tasks(self._connection, daq, inputs, sample_rate, lead, used, pulses)
        except BaseException:
            self._connection.close()
            raise
        self._drive_range = daq.output_range
        self._description = description_of(daq, inputs, used, version, self._tasks, stale)

    @property
    def sample_rate(self) -> float:
        """Samples per second per channel, for inputs and output, as read back from the device [1/s]."""
        return self._tasks.inputs.rate

    @property
    def drive_range(self) -> float:
        """Largest magnitude of the drive [V]."""
        return self._drive_range

    @property
    def scalings(self) -> tuple[InputScaling, ...]:
        """Conversion from counts to volts of each input."""
        return self._tasks.inputs.scalings

    @property
    def delays(self) -> tuple[InputDelay, ...]:
        """Delay of each input; `read` returns the samples uncorrected."""
        return self._tasks.inputs.delays

    @property
    def marker(self) -> str | None:
        """The counter that outputs the pulses; None if there are no pulses or no counter."""
        return None if self._tasks.marker is None else self._tasks.marker.counter

    @property
    def dtype(self) -> type[np.int16] | type[np.int32]:
        """Type of the counts."""
        return self._tasks.inputs.dtype

    @property
    def description(self) -> dict[str, str]:
        """Identity and settings of the device, for the data file."""
        return dict(self._description)

    def output_pulses(self, pulses: Pulses) -> None:
        """Output `pulses` at `daq.laser_marker`, beginning now, until `prepare`; without a counter, do nothing. Raises
        RigError, also during a run.
        """
        with self._lock:
            self._require(_State.IDLE, "output of pulses")
            if self._tasks.marker is not None:
                with self._resting_on_failure():
                    self._tasks.marker.run_free(pulses)

    @property
    def cuts(self) -> int:
        """Number of calls of `cut`."""
        return self._cuts

    def prepare(self, cuts: int | None = None) -> None:
        """Set the output to 0 V, prepare it to start on the inputs' trigger, close the enable relay, and wait for the
        amplifier. The sample clock is started later, by `start`.

        `cuts` is their number when the caller began to arm: nothing is prepared if there was another one since. Raises
        RigError if a step fails; ConnectionLost requires a new session.
        """
        with self._lock:
            self._require(_State.IDLE, "prepare")
            if self._lost:
                raise ConnectionLost("the run cannot be prepared: the device was lost earlier; open a new session")
            if self._tasks.was_reset:
                raise ConnectionLost("the run cannot be prepared: the device had to be reset; open a new session")
            if not self._tasks.inputs.is_owner():
                raise ConnectionLost(
                    "the run cannot be prepared: another client has taken the device; open a new session"
                )
            # repeat a stop that has failed
            self._rest()
            self._state, self._at_rest, self._cut = _State.PREPARED, False, False
            with self._resting_on_failure():
                # a cut from another thread before the reset of `_cut` above has changed the number
                if cuts not in (None, self._cuts):
                    self._cut = True
                with self._interrupted():
                    self._tasks.prepare(lambda: self._cut)

    def write(self, volts: NDArray[np.float64]) -> None:
        """Append drive samples, shape (n,), finite and in range [V]; those written before `start` are played first.

        Raises DriveUnderflow if the output has run out of samples, DeviceTimeout if no space becomes free, and RigError
        if the session is not prepared.
        """
        with self._lock:
            if self._state is not _State.RUNNING:
                self._require(_State.PREPARED, "write")
            with self._resting_on_failure():
                self._tasks.output.write(volts)
                self._reset_watchdog()

    def start(self) -> None:
        """Start the sample clock at sample 0. Raises DriveUnderflow if no samples were written."""
        with self._lock:
            self._require(_State.PREPARED, "start")
            with self._resting_on_failure(), self._interrupted():
                self._reset_watchdog()
                self._beat()
                self._tasks.output.arm()
                if self._tasks.marker is not None:
                    self._tasks.marker.arm()
                self._tasks.inputs.start()
                self._require(_State.PREPARED, "start")
                self._state = _State.RUNNING

    def read(self, n: int) -> NDArray[np.int16 | np.int32]:
        """The next `n` counts of each input, shape (n, channels), a copy in C order; waits for them.

        Raises InputOverflow, DeviceTimeout, ConnectionLost, and RigError if the session is not running.
        """
        self._require(_State.RUNNING, "read")
        if n < 1:
            raise InvalidInput("samples to read", n, "it must be at least 1")
        with self._resting_on_failure():
            counts = self._tasks.inputs.read(n)
            if self._state is not _State.RUNNING:
                # the read may have restarted the stopped task
                self._tasks.inputs.stop()
                raise RigError("read was interrupted: the session was stopped")
            self._reset_watchdog()
            self._beat()
        return counts

    def acquired(self) -> int:
        """Number of samples acquired per input since `start`, a reading of the sample clock. Raises the errors of
        `read`.
        """
        self._require(_State.RUNNING, "reading the sample clock")
        with self._resting_on_failure():
            return self._tasks.inputs.acquired()

    def safety_inputs(self) -> dict[str, bool]:
        """Whether each wired safety input is good now, read in one call to the device, in every state except closed.

        The ready contact of an amplifier that is ready only while enabled is omitted while the amplifier is not
        enabled. Raises RigError if the inputs cannot be read.
        """
        safety = self._tasks.safety
        if safety is None:
            return {}
        if self._state is _State.CLOSED:
            raise RigError("reading the safety inputs is refused: the session is closed")
        enabled = self._is_enabled
        with self._resting_on_failure():
            good = safety.read()
        if self._tasks.ready_delay is not None and not (enabled and self._is_enabled):
            del good["amplifier ready"]
        return good

    def cut(self) -> bool:
        """Open the enable relay now, in one call, from any thread and in every state, even during a read.

        Returns True if the device confirmed it, or its expired watchdog has already opened the relay; False if there is
        no enable line or the device did not respond, so that only the emergency stop remains. Never raises. The sample
        clock runs until `stop`; the watchdog is no longer reset.
        """
        # in this order, see `prepare`
        self._cuts += 1
        self._cut = True
        return self._tasks.relay is not None and self._tasks.relay.cut()

    def stop(self) -> None:
        """Open the relay, end the tasks, and set the output to 0 V.

        Allowed in every state, and repeatedly. Attempts every step, and raises RigError at the end if the relay or the
        output could not be set; the next call then repeats all steps.
        """
        with self._lock:
            if self._state is _State.CLOSED:
                return
            self._state = _State.IDLE
            self._rest()

    def close(self) -> None:
        """Stop, and release the device; may be called repeatedly. Raises the errors of `stop`."""
        with self._lock:
            if self._state is _State.CLOSED:
                return
            self._state = _State.CLOSED
            with ExitStack() as ending:
                ending.callback(self._connection.close)
                ending.callback(self._tasks.clear)
                self._rest()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _require(self, state: _State, what: str) -> None:
        if self._state is not state:
            raise RigError(f"{what} is refused: the session is {self._state.value}")

    @property
    def _is_enabled(self) -> bool:
        """Whether the enable line is commanded closed."""
        return self._state in (_State.PREPARED, _State.RUNNING) and not self._cut

    def _reset_watchdog(self) -> None:
        if self._tasks.watchdog is not None and not self._cut:
            self._tasks.watchdog.reset()

    def _beat(self) -> None:
        # under the lock, so that no edge follows once a stop has set the line low
        with self._lock:
            if self._tasks.heartbeat is not None and self._is_enabled:
                self._tasks.heartbeat.beat(driving=self._state is _State.RUNNING)

    @contextmanager
    def _resting_on_failure(self) -> Generator[None]:
        """Context manager that stops the bench before an error leaves its body; a failure of the stop is added to that
        error as a note.
        """
        try:
            yield
        except BaseException as error:
            with self._lock:
                if self._state in (_State.PREPARED, _State.RUNNING):
                    self._state = _State.FAILED
                self._lost = self._lost or isinstance(error, ConnectionLost) or self._connection.late
                try:
                    self._rest()
                except RigError as second:
                    error.add_note(str(second))
                except BaseException as second:
                    error.add_note(str(second))
                    raise second from error
            raise

    @contextmanager
    def _interrupted(self) -> Generator[None]:
        """Context manager for steps during which a signal handler of this thread may stop the session: the steps that
        follow in its body may end the rest, so that an error makes the session rest again.
        """
        try:
            yield
        except BaseException:
            self._at_rest = False
            raise

    def _rest(self) -> None:
        if not self._at_rest:
            self._tasks.rest()
            self._at_rest = True


def _make_safe(connection: Connection, daq: Daq) -> None:
    """Open the relay and set the output to 0 V. Failures are ignored, since a persistent one recurs when the tasks are
    created.
    """
    with suppress(RigError):
        if daq.enable_line is not None:
            line = EnableLine(connection, daq.enable_line)
            line.close()
            if line.chassis_expired:
                # the watchdog may have been left by a program that has crashed
                with translated("looking for the chassis, whose watchdog has expired,"):
                    found = [described(device) for device in library.system(connection.options()).devices]
                if (chassis := chassis_of(daq.enable_line, found)) is not None:
                    reset_chassis(connection, chassis)
    with suppress(RigError):
        put_to_zero(connection, daq)
