"""The tasks of one session: made together, brought to rest together."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress

from drivers.clock import WallClock
from drivers.daqmx.connection import Connection
from drivers.daqmx.enable import EnableLine
from drivers.daqmx.heartbeat import Heartbeat
from drivers.daqmx.inputs import Inputs
from drivers.daqmx.output import Output
from drivers.daqmx.parameters import AnalogInput, Daq
from drivers.daqmx.safety_inputs import SafetyInputs
from drivers.daqmx.watchdog import Watchdog
from drivers.errors import RigError, SafetyInputOpen
from sim.errors import InvalidInput

_LOOK = 0.05
"""Time between two looks at an amplifier that is not ready yet [s]."""
_SAME_RATE = 1.0e-9
"""Relative difference below which two sample rates are one."""


class Tasks:
    """Enable relay, watchdog, heartbeat, safety inputs, output and inputs. When one cannot be made, the others are
    cleared.

    After the constructor the relay is open and the output at 0 V. `was_reset` says that the device had to be reset to
    bring the output to rest: its tasks are gone then. Raises InvalidInput for a sample rate that the
    device would not make exactly.
    """

    def __init__(
        self, connection: Connection, daq: Daq, inputs: Sequence[AnalogInput], sample_rate: float, lead: int
    ) -> None:
        self.relay: EnableLine | None = None
        self.watchdog: Watchdog | None = None
        self.heartbeat: Heartbeat | None = None
        self.safety: SafetyInputs | None = None
        self.was_reset = False
        self.ready_delay = None if daq.amplifier_ready is None else daq.amplifier_ready.delay
        """How long after the enable line the amplifier says that it is ready [s]; None when the line is no matter."""
        with ExitStack() as made:
            if daq.enable_line is not None:
                self.relay = EnableLine(connection, daq.enable_line)
                made.callback(_quietly, self.relay.close)
                if daq.watchdog is not None:
                    self.watchdog = Watchdog(connection, daq.enable_line, daq.watchdog)
                    made.callback(_quietly, self.watchdog.close)
            if daq.heartbeat is not None:
                self.heartbeat = Heartbeat(connection, daq.heartbeat.line)
                made.callback(_quietly, self.heartbeat.close)
            if daq.safety_inputs:
                self.safety = SafetyInputs(connection, daq.safety_inputs)
                made.callback(_quietly, self.safety.close)
            self.inputs = Inputs(connection, daq, inputs, sample_rate)
            made.callback(_quietly, self.inputs.close)
            self.output = Output(connection, daq, self.inputs.clock, sample_rate, lead)
            made.callback(_quietly, self.output.clear)
            _require_rate("inputs", self.inputs.rate, sample_rate)
            _require_rate("output", self.output.rate, sample_rate)
            self._made = made.pop_all()

    def prepare(self, is_cut: Callable[[], bool]) -> None:
        """Output at 0 V and armed on the inputs' trigger, enable relay closed, amplifier ready.

        Raises RigError when a step fails, the amplifier does not say that it is ready, or `is_cut` meanwhile.
        """
        if self.relay is not None:
            self.relay.open()
        # a call that a halt interrupted may have left them at work
        if self.heartbeat is not None:
            self.heartbeat.rest()
        if self.safety is not None:
            self.safety.stop()
        self.output.prepare(self.inputs.trigger)
        # while its watchdog starts nothing may be reserved on the device: that comes with the first samples
        if self.watchdog is not None:
            self.watchdog.start()
        if self.safety is not None:
            self.safety.start()
        if self.heartbeat is not None:
            self.heartbeat.beat()
        if self.relay is not None:
            self.relay.energise()
        _require_not_cut(is_cut)
        if self.safety is not None and self.ready_delay is not None:
            self._await_amplifier(self.safety, self.ready_delay, is_cut)

    def rest(self) -> None:
        """Relay open, nothing runs, output at 0 V.

        Every step is tried, whatever happens in another, also an interrupt. Raises what is no error of the rig, or
        the first failure of relay or output.
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

        if self.relay is not None:
            attempt(self.relay.open, matters=True)
        if self.heartbeat is not None:
            # a line that cannot be put low stands still as well
            attempt(self.heartbeat.rest)
        if self.safety is not None:
            attempt(self.safety.stop)
        # stopping a task that an error has ended raises that error once more; a task that is not cleared keeps the
        # output, and then the zero fails
        cleared = attempt(self.output.clear)
        zeroed = attempt(self.output.zero, matters=cleared)
        if not (cleared or zeroed) and attempt(self.output.reset_device, matters=True):
            self.was_reset = True
            failures.append(RigError("the output was held by its task: the device was reset; open a new session"))
        attempt(self.inputs.stop)
        # a watchdog is let go only when all is at rest: one that is told no more opens the relay itself, and one that
        # has barked holds it open
        if self.watchdog is not None and not failures:
            attempt(self.watchdog.stop)
            if self.relay is not None:
                # a line that the watchdog held may go back to what was written last
                attempt(self.relay.open, matters=True)
        if failures:
            raise failures[0]

    def clear(self) -> None:
        """Give everything back to the driver, as far as it still answers and nobody else has it; once."""
        with self._made, suppress(RigError):
            if not self.inputs.are_ours():
                self._made.pop_all()
                if self.watchdog is not None:
                    self.watchdog.let_go()

    def _await_amplifier(self, safety: SafetyInputs, delay: float, is_cut: Callable[[], bool]) -> None:
        clock = WallClock()
        deadline = clock.now() + delay
        while not (good := safety.read())["amplifier ready"]:
            _require_not_cut(is_cut)
            if clock.now() > deadline:
                opened = [name for name, is_good in good.items() if not is_good]
                text = f"{', '.join(opened)} not good {delay:g} s after the enable line was closed"
                raise SafetyInputOpen(f"prepare is refused: {text}", opened)
            clock.wait_until(clock.now() + _LOOK)
            if self.watchdog is not None:
                self.watchdog.tell()
            if self.heartbeat is not None:
                self.heartbeat.beat()


def _require_not_cut(is_cut: Callable[[], bool]) -> None:
    if is_cut():
        raise RigError("prepare is refused: the enable line was cut meanwhile")


def _quietly(step: Callable[[], None]) -> None:
    with suppress(RigError):
        step()


def _require_rate(what: str, made: float, asked: float) -> None:
    if abs(made - asked) > _SAME_RATE * asked:
        raise InvalidInput("sample_rate", asked, f"the {what} would make {made!r}/s of it; ask for a rate that it has")
