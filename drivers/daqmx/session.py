"""A DAQ device under this program's control: drive output, inputs and enable relay as one."""

import threading
from collections.abc import Generator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from enum import Enum
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drivers.daqmx import library
from drivers.daqmx.checks import checked_devices
from drivers.daqmx.cleanup import clear_stale
from drivers.daqmx.connection import Connection
from drivers.daqmx.description import description_of
from drivers.daqmx.enable import EnableLine
from drivers.daqmx.errors import translated
from drivers.daqmx.output import put_to_zero
from drivers.daqmx.parameters import AnalogInput, Daq, device_name
from drivers.daqmx.scaling import InputScaling
from drivers.daqmx.tasks import Tasks
from drivers.errors import ConnectionLost, RigError
from sim.errors import InvalidInput


class _State(Enum):
    IDLE = "not prepared"
    PREPARED = "prepared, not started"
    RUNNING = "running"
    FAILED = "stopped by an error: stop it, then prepare it again"
    CLOSED = "closed"


class DaqSession:
    """Output and inputs share start trigger and sample clock: sample i leaves while sample i is taken.

    The output is clocked from the terminal of the inputs' sample clock. A device that has no such route refuses the
    output: then `hardware.daq.clock` may name another terminal, or with OnboardClock leave the output a clock of its
    own, which starts with the inputs and keeps up with them where both have one timebase. Nothing falls back by itself.

    A run is `prepare`, `write` the first samples, `start`, then `write` and `read` in turn, and `stop`. Whatever
    fails in between opens the relay and puts the output to zero before it is raised. One thread at a time may run
    it; `cut`, `stop` and `close` may come from any other.

    The bench is safe before anything is checked. Raises InvalidInput for what the device cannot do, and for a sample
    rate that it would not make exactly; DeviceNotFound when driver, server or device are not there or another program
    holds them.
    """

    def __init__(self, daq: Daq, inputs: Sequence[AnalogInput], sample_rate: float, lead: int) -> None:
        self._lock = threading.RLock()
        self._state = _State.IDLE
        self._at_rest = True
        self._cut = False
        self._lost = False
        self._connection = Connection(daq.server, daq.patience)
        try:
            # whatever is wrong with the rest: an earlier program may have died with the shaker enabled
            terminals = (daq.output, *daq.digital_lines.values(), *(given.terminal for given in inputs))
            stale = clear_stale(self._connection, [device_name(terminal) for terminal in terminals])
            _make_safe(self._connection, daq)
            with translated("asking the driver for its devices"):
                system = library.system(self._connection.options())
                used = checked_devices(system, daq, inputs, sample_rate, lead)
                version = system.driver_version
            self._tasks = Tasks(self._connection, daq, inputs, sample_rate, lead)
        except BaseException:
            self._connection.close()
            raise
        self._drive_range = daq.output_range
        self._description = description_of(daq, inputs, used, version, self._tasks, stale)

    @property
    def sample_rate(self) -> float:
        """Samples per second and channel, for inputs and output alike, as the device made it [1/s]."""
        return self._tasks.inputs.rate

    @property
    def drive_range(self) -> float:
        """Largest magnitude of the drive [V]."""
        return self._drive_range

    @property
    def scalings(self) -> tuple[InputScaling, ...]:
        """From counts to volts, for each input."""
        return self._tasks.inputs.scalings

    @property
    def dtype(self) -> type[np.int16] | type[np.int32]:
        """Type of the counts."""
        return self._tasks.inputs.dtype

    @property
    def description(self) -> dict[str, str]:
        """What the device is and how it was set, for the data file."""
        return dict(self._description)

    def prepare(self) -> None:
        """Put the output to 0 V, arm it on the inputs' start trigger, close the enable relay. Nothing runs yet."""
        with self._lock:
            self._require(_State.IDLE, "prepare")
            if self._lost:
                raise ConnectionLost("prepare is refused: the device was lost in an earlier run; open a new session")
            if self._tasks.was_reset:
                raise ConnectionLost("prepare is refused: the device had to be reset; open a new session")
            if not self._tasks.inputs.are_ours():
                raise ConnectionLost("prepare is refused: another client has taken the device; open a new session")
            # what a stop could not bring to rest comes first
            self._rest()
            self._state, self._at_rest, self._cut = _State.PREPARED, False, False
            with self._resting_on_failure():
                self._tasks.prepare(lambda: self._cut)

    def write(self, volts: NDArray[np.float64]) -> None:
        """Append drive samples, shape (n,), finite and in range [V]; before `start` they are what it begins with.

        Raises DriveUnderflow when the output has run dry, DeviceTimeout when no room comes free, RigError when the
        session is not prepared.
        """
        with self._lock:
            if self._state is not _State.RUNNING:
                self._require(_State.PREPARED, "write")
            with self._resting_on_failure():
                self._tasks.output.write(volts)
                self._tell_watchdog()

    def start(self) -> None:
        """Start the sample clock: sample 0 is taken and played now. DriveUnderflow when nothing was written."""
        with self._lock:
            self._require(_State.PREPARED, "start")
            with self._resting_on_failure():
                self._tell_watchdog()
                self._beat()
                self._tasks.output.arm()
                self._tasks.inputs.start()
                self._state = _State.RUNNING

    def read(self, n: int) -> NDArray[np.int16 | np.int32]:
        """The next `n` counts of each input, shape (n, channels), a copy in C order; waits for them.

        Raises InputOverflow, DeviceTimeout, ConnectionLost, and RigError when the session does not run.
        """
        self._require(_State.RUNNING, "read")
        if n < 1:
            raise InvalidInput("samples to read", n, "it must be at least 1")
        with self._resting_on_failure():
            counts = self._tasks.inputs.read(n)
            if self._state is not _State.RUNNING:
                # the driver starts a stopped task by itself when it is read
                self._tasks.inputs.stop()
                raise RigError("read is refused: the session was stopped meanwhile")
            self._tell_watchdog()
            self._beat()
        return counts

    def acquired(self) -> int:
        """How many samples of each input the device has taken since `start`: bounds its clock. Errors as of `read`."""
        self._require(_State.RUNNING, "asking for the sample clock")
        with self._resting_on_failure():
            return self._tasks.inputs.acquired()

    def safety_inputs(self) -> dict[str, bool]:
        """Whether each safety input that is wired is good now: one call to the device; in every state but closed.

        An amplifier that says ready only while it is enabled is left out when it is not to be enabled. Raises RigError
        as of `read`.
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
        """Open the enable relay now, in one call; from any thread, while another reads, in every state.

        True when the device confirmed it. False when there is no enable line, or the device did not answer: then only
        the emergency stop is left. Never raises. The sample clock goes on until `stop`; the watchdog is told no more.
        """
        self._cut = True
        return self._tasks.relay is not None and self._tasks.relay.cut()

    def stop(self) -> None:
        """Open the relay, end the tasks, put the output to 0 V. Allowed in every state, any number of times.

        Every step is tried. Raises RigError at the end when relay or output could not be set; the next call tries
        again.
        """
        with self._lock:
            if self._state is _State.CLOSED:
                return
            self._state = _State.IDLE
            self._rest()

    def close(self) -> None:
        """Stop, and give the device back. Allowed any number of times; errors as of `stop`."""
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
        """Whether the enable line is meant to be closed."""
        return self._state in (_State.PREPARED, _State.RUNNING) and not self._cut

    def _tell_watchdog(self) -> None:
        if self._tasks.watchdog is not None and not self._cut:
            self._tasks.watchdog.tell()

    def _beat(self) -> None:
        # under the lock: no edge may come after a stop has put the line to rest
        with self._lock:
            if self._tasks.heartbeat is not None and self._is_enabled:
                self._tasks.heartbeat.beat()

    @contextmanager
    def _resting_on_failure(self) -> Generator[None]:
        """Come to rest before an error goes out; what fails of that is told with it, and tried again by `stop`."""
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

    def _rest(self) -> None:
        if not self._at_rest:
            self._tasks.rest()
            self._at_rest = True


def _make_safe(connection: Connection, daq: Daq) -> None:
    """Open the relay and put the output to 0 V, as far as their names are right and the device obeys.

    What it refuses here it refuses again, by name, when the tasks are made.
    """
    with suppress(RigError):
        if daq.enable_line is not None:
            EnableLine(connection, daq.enable_line).close()
    with suppress(RigError):
        put_to_zero(connection, daq)
