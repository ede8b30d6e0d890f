"""Tasks of one session with a DAQ device: creation, ordered start and stop, and release."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress

from drivers.clock import WallClock
from drivers.daqmx.connection import Connection
from drivers.daqmx.delays import Connected
from drivers.daqmx.devices import FoundDevice
from drivers.daqmx.inputs import Inputs
from drivers.daqmx.library import Version
from drivers.daqmx.marker import Marker
from drivers.daqmx.output import Output
from drivers.daqmx.parameters import AnalogInput, Daq, device_name
from drivers.daqmx.safety import (
    EnableLine,
    Heartbeat,
    SafetyInputs,
    Watchdog,
)
from drivers.errors import EnableLineCut, RigError, SafetyInputOpen
from drivers.timebase.marking import Pulses
from sim.errors import InvalidInput

_LOOK = 0.05
"""Interval between checks of an amplifier that is not yet ready [s]."""
_SAME_RATE = 1.0e-9
"""Relative difference below which two sample rates count as equal."""


class Tasks:
    """Enable relay, watchdog, heartbeat, safety inputs, output, inputs and marker, on the devices `used`.

    If one of the tasks cannot be created, the others are cleared. After construction the relay is open and the output
    at 0 V. `was_reset`: a device or chassis had to be reset, so that its tasks no longer exist. Raises InvalidInput for
    a sample rate that the device cannot produce exactly.
    """

    def __init__(
        self,
        connection: Connection,
        daq: Daq,
        inputs: Sequence[AnalogInput],
        sample_rate: float,
        lead: int,
        used: Sequence[FoundDevice],
        pulses: Pulses | None = None,
    ) -> None:
        self.relay: EnableLine | None = None
        self.watchdog: Watchdog | None = None
        self.heartbeat: Heartbeat | None = None
        self.safety: SafetyInputs | None = None
        self.was_reset = False
        self._relay_failed = False
        self.ready_delay = None if daq.amplifier_ready is None else daq.amplifier_ready.delay
        """Longest time from closing the enable line to the amplifier's ready signal [s]; None if the signal does not
        depend on the line.
        """
        with ExitStack() as made:
            if daq.enable_line is not None:
                self.relay = EnableLine(connection, daq.enable_line)
                made.callback(_quietly, self.relay.close)
                if daq.watchdog is not None:
                    chassis = chassis_of(daq.enable_line, used)
                    self.watchdog = Watchdog(connection, daq.enable_line, daq.watchdog, chassis, daq.output)
                    made.callback(_quietly, self.watchdog.close)
            if daq.heartbeat is not None:
                self.heartbeat = Heartbeat(connection, daq.heartbeat.line, daq.heartbeat.timeout)
                made.callback(_quietly, self.heartbeat.close)
            if daq.safety_inputs:
                self.safety = SafetyInputs(connection, daq.safety_inputs)
                made.callback(_quietly, self.safety.close)
            self.inputs = Inputs(connection, daq, inputs, sample_rate, [_connected(one, used) for one in inputs])
            made.callback(_quietly, self.inputs.close)
            self.output = Output(connection, daq, self.inputs.clock, sample_rate, lead)
            made.callback(_quietly, self.output.clear)
            _require_rate("inputs", self.inputs.rate, sample_rate)
            _require_rate("output", self.output.rate, sample_rate)
            self.marker = None if pulses is None else Marker(connection, daq, pulses)
            if self.marker is not None:
                made.callback(_quietly, self.marker.clear)
            self._made = made.pop_all()

    def prepare(self, is_cut: Callable[[], bool]) -> None:
        """Set the output to 0 V, prepare it to start on the inputs' trigger, close the enable relay and wait for the
        amplifier.

        Raises RigError if a step fails, a safety input is open, the amplifier does not report ready, or `is_cut`
        becomes true.
        """
        if self.relay is not None:
            self.relay.open()
        # a previous call interrupted by a halt may have left these tasks running
        if self.heartbeat is not None:
            self.heartbeat.rest()
        if self.safety is not None:
            self.safety.stop()
        self.output.prepare(self.inputs.trigger)
        if self.marker is not None:
            self.marker.prepare(self.inputs.trigger)
        # nothing on the device may be reserved when its watchdog starts; the first samples reserve the output
        if self.watchdog is not None:
            self.watchdog.start()
        if self.safety is not None:
            self.safety.start()
        if self.heartbeat is not None:
            self.heartbeat.beat()
        if self.safety is not None:
            self._require_good(self.safety)
        _require_not_cut(is_cut)
        if self.relay is not None:
            self.relay.energise()
        # a cut during the preceding call
        _require_not_cut(is_cut)
        if self.safety is not None and self.ready_delay is not None:
            self._await_amplifier(self.safety, self.ready_delay, is_cut)

    def rest(self) -> None:
        """Open the relay, stop the tasks, and set the output to 0 V. Attempts every step, even after a failure or an
        interrupt. Raises an error that is not a RigError, if there was any; otherwise the first failure of relay or
        output.
        """
        failures: list[BaseException] = []

        def attempt(step: Callable[[], None], *, matters: bool = False) -> bool:
            try:
                step()
            except RigError as error:
                if matters:
                    failures.append(error)
                return False
            except BaseException as error:
                failures.insert(0, error)
                return False
            return True

        self._end_expiration(attempt, failures)
        if self.relay is not None:
            self._relay_failed = not attempt(self.relay.open, matters=True)
        if self.heartbeat is not None:
            # failure is harmless: the line no longer toggles
            attempt(self.heartbeat.rest)
        if self.safety is not None:
            attempt(self.safety.stop)
        # stopping a task that ended with an error raises that error again; a task that is not cleared keeps the output,
        # so that setting it to zero fails
        cleared = attempt(self.output.clear)
        zeroed = attempt(self.output.zero, matters=cleared)
        if not (cleared or zeroed) and attempt(self.output.reset_device, matters=True):
            self.was_reset = True
            failures.append(RigError("the output was still reserved: the device was reset; open a new session"))
        attempt(self.inputs.stop)
        if self.marker is not None:
            attempt(self.marker.clear)
        # a watchdog is stopped only after everything else: without resets it opens the relay, and once expired it keeps
        # the relay open
        if self.watchdog is not None and not failures:
            attempt(self.watchdog.stop)
            if self.relay is not None:
                # a line locked by the watchdog may return to the level written last
                attempt(self.relay.open, matters=True)
        if failures:
            raise failures[0]

    def _end_expiration(self, attempt: Callable[..., bool], failures: list[BaseException]) -> None:
        """Reset a chassis whose watchdog has expired; its relay is open, and it runs no task until the reset."""
        watchdog = self.watchdog
        expired: list[bool] = []
        if (
            watchdog is None
            or self.was_reset
            or not attempt(lambda: expired.append(watchdog.has_barred_chassis))
            or not expired[0]
        ):
            return
        if attempt(watchdog.reset_chassis, matters=True):
            self.was_reset = True
            failures.append(RigError("the watchdog had expired: the chassis was reset; open a new session"))

    def clear(self) -> None:
        """Release all tasks, unless another client owns them; failures are ignored. May be called repeatedly.

        If the relay could not be opened, first wait until the watchdog has opened it: clearing its task stops it.
        """
        with self._made, suppress(RigError):
            if not self.inputs.is_owner():
                self._made.pop_all()
                if self.watchdog is not None:
                    self.watchdog.let_go()
            elif self.watchdog is not None and self._relay_failed:
                self.watchdog.await_expiry()
                self._relay_failed = False

    def _require_good(self, safety: SafetyInputs) -> None:
        """Refuse to close the relay while an input is open: the caller's check may be seconds ago, because the lasers
        have been observed since.
        """
        waits = {"amplifier ready"} if self.ready_delay is not None else set[str]()
        opened = [name for name, is_good in safety.read().items() if not (is_good or name in waits)]
        if opened:
            text = f"{', '.join(opened)} open; close every safety input, then start again"
            raise SafetyInputOpen(f"the run cannot be prepared: {text}", opened)

    def _await_amplifier(self, safety: SafetyInputs, delay: float, is_cut: Callable[[], bool]) -> None:
        clock = WallClock()
        deadline = clock.now() + delay
        while not (good := safety.read())["amplifier ready"]:
            _require_not_cut(is_cut)
            if clock.now() > deadline:
                opened = [name for name, is_good in good.items() if not is_good]
                text = f"safety inputs open {delay:g} s after the enable line was closed: {', '.join(opened)}"
                raise SafetyInputOpen(f"the run cannot be prepared: {text}", opened)
            clock.wait_until(clock.now() + _LOOK)
            if self.watchdog is not None:
                self.watchdog.reset()
            if self.heartbeat is not None:
                self.heartbeat.beat()


def chassis_of(line: str, used: Sequence[FoundDevice]) -> str | None:
    """The chassis of a line's module; None for a stand-alone device."""
    name = device_name(line).lower()
    return next((device.chassis for device in used if device.name.lower() == name), None)


def _connected(given: AnalogInput, used: Sequence[FoundDevice]) -> Connected:
    name = device_name(given.terminal).lower()
    device = next(device for device in used if device.name.lower() == name)
    return Connected(device.name, device.product, device.simultaneous)


def _require_not_cut(is_cut: Callable[[], bool]) -> None:
    if is_cut():
        raise EnableLineCut


def _quietly(step: Callable[[], None]) -> None:
    with suppress(RigError):
        step()


def _require_rate(what: str, made: float, asked: float) -> None:
    if abs(made - asked) > _SAME_RATE * asked:
        raise InvalidInput("sample_rate", asked, f"the {what} would run at {made!r}/s; choose a supported rate")


_MISSING = "not wired to this program: it must open the enable chain by itself"


def description_of(
    daq: Daq,
    inputs: Sequence[AnalogInput],
    used: Sequence[FoundDevice],
    version: Version,
    tasks: Tasks,
    stale: Sequence[str],
) -> dict[str, str]:
    """Names and settings as text; `used` are the devices, `stale` the tasks left by another client."""
    heartbeat = daq.heartbeat
    return {
        "driver": f"NI-DAQmx {version.major_version}.{version.minor_version}.{version.update_version}",
        "server": daq.server or "none: the driver of this PC",
        **{f"device {device.name}": device.identity for device in used},
        "inputs": ", ".join(f"{given.terminal} ({given.wiring}, +-{given.range:g} V)" for given in inputs),
        "input delays": ", ".join(
            f"{given.terminal} {1e6 * delay.seconds:.1f} us ({delay.source})"
            for given, delay in zip(inputs, tasks.inputs.delays, strict=True)
        ),
        "output": f"{daq.output} (+-{daq.output_range:g} V)",
        "output transfer": tasks.output.transfer,
        "start trigger": tasks.inputs.trigger,
        "sample clock of the output": tasks.inputs.clock,
        "enable line": daq.enable_line or "none",
        "watchdog": "none: a crashed program leaves the relay in its state"
        if daq.watchdog is None
        else f"{daq.watchdog:g} s",
        "heartbeat": "none"
        if heartbeat is None
        else f"{heartbeat.line}; its relay opens {heartbeat.timeout:g} s after the last rising edge",
        **{name: f"{given.line}, {given.good} is good" for name, given in daq.safety_inputs.items()},
        **dict.fromkeys(daq.missing_inputs, _MISSING),
        "tasks left by another client": ", ".join(stale) or "none",
    }
