"""A sensor on its serial line: opening, identification, configuration and reading."""

from contextlib import suppress
from math import isclose
from typing import Self

from drivers.clock import now
from drivers.errors import ConnectionLost, DeviceNotFound, DeviceTimeout, RigError
from drivers.optoncdt.dialogue import SLOW, CommandRefused, Dialogue
from drivers.optoncdt.frames import Layout, additional_signals, layout_in
from drivers.optoncdt.line import Line
from drivers.optoncdt.port import open_port
from drivers.optoncdt.search import BAUDS, SensorInfo, silenced
from drivers.optoncdt.stream import Readings, Stream
from sim.errors import InvalidInput

_FIXED = ("AVERAGE NONE", "TRIGGER NONE", "OUTHOLD NONE", "OUTREDUCEDEVICE NONE")
"""Commands that disable averaging, the trigger, the holding of old values, and the output reduction."""


def require_sensor(
    name: str, who: str, info: SensorInfo, measuring_range: float, serial_number: str | None = None
) -> None:
    """Raise DeviceNotFound for a model that is not supported, or InvalidInput if the measuring range [m] or the serial
    number is not as configured.
    """
    if not info.supported:
        raise DeviceNotFound(
            f"{who} is of model {info.model}, whose data format is not supported; connect an ILD1420, or correct the "
            "port"
        )
    if not isclose(info.measuring_range, measuring_range, rel_tol=1e-4):
        allowed = f"{who} has a range of {info.measuring_range:g} m: correct this value, or the port of this laser"
        raise InvalidInput(f"hardware.{name}.measuring_range", measuring_range, allowed)
    if serial_number is not None and serial_number != info.serial:
        allowed = (
            f"{who} is the sensor {info.serial or 'without a serial number'}: swap the ports, or correct this "
            "serial number"
        )
        raise InvalidInput(f"hardware.{name}.serial_number", serial_number, allowed)


def configure(dialogue: Dialogue, rate: float, baud: int) -> tuple[Layout, bool]:
    """Configure all settings for measurements at `rate` [1/s]; the output must be switched off. Returns the layout of
    a measurement, and whether the sensor has confirmed its rate.

    Raises InvalidInput for a rate that `baud` or the sensor does not support, RigError if the sensor rejects a setting.
    """
    signals = additional_signals(rate, baud)
    dialogue.ask("ECHO OFF")
    _require_no_mastering(dialogue)
    is_known = _set_rate(dialogue, rate)
    for command in _FIXED:
        dialogue.ask(command)
    dialogue.ask(f"OUTADD_RS422 {' '.join(signals)}")
    layout = layout_in(dialogue.who, dialogue.setting("GETOUTINFO_RS422"), signals)
    dialogue.ask("LASERPOW FULL")
    return layout, is_known


def _require_no_mastering(dialogue: Dialogue) -> None:
    """Raise RigError if mastering is on, since it shifts the zero without an indication in the stream (manual, p. 65).

    The query is undocumented. If the sensor rejects it, the documented command MASTERMV NONE is sent (p. 108).
    """
    remedy = "set MASTERMV NONE in its web interface"
    try:
        mastering = dialogue.setting("MASTERMV", SLOW)
    except CommandRefused:
        try:
            dialogue.ask("MASTERMV NONE", SLOW)
        except CommandRefused as error:
            raise RigError(
                f"{dialogue.who} neither reports whether its zero is shifted nor resets it: {error.answer}; {remedy},"
                " or use its analogue output"
            ) from error
        return
    if mastering != ["NONE"]:
        raise RigError(f"{dialogue.who} has its zero shifted (MASTERMV {' '.join(mastering) or '?'}); {remedy}")


_RATE = "hardware.lasers.rate"
_RATES = "sensors support 250, 500, 1000, 2000 and 4000 1/s, newer ones also 8000 1/s"


def _set_rate(dialogue: Dialogue, rate: float) -> bool:
    """Set the rate [1/s] and read it back, since a rate that the sensor has not adopted makes the time base wrong.

    Returns False if the sensor does not support the query, which is undocumented; the rate must then be checked by
    counting values.
    """
    item, known = _RATE, _RATES
    try:
        dialogue.ask(f"MEASRATE {rate / 1e3:g}")
    except CommandRefused as error:
        raise InvalidInput(item, rate, f"{dialogue.who} does not accept this rate ({error.answer}); {known}") from error
    try:
        answer = " ".join(dialogue.setting("MEASRATE"))
    except CommandRefused:
        return False
    try:
        actual = float(answer.removesuffix("KHZ")) * 1e3
    except ValueError:
        raise RigError(
            f"{dialogue.who} reports an unreadable rate ({answer!r}); its firmware is not supported: use its analogue "
            f"output"
        ) from None
    if not isclose(actual, rate, rel_tol=1e-6):
        raise InvalidInput(item, rate, f"{dialogue.who} measures at {actual:g} 1/s instead; {known}")
    return True


_LOCK_TIME = 2.0
"""Longest wait for the first accepted value after the stream is switched on [s]."""
_SILENT_PERIODS, _SILENT_TIME = 10.0, 0.4
"""Number of periods and time [s] without data, whichever is longer, after which a sensor counts as silent. The
operating system may deliver received bytes in a thread of normal priority, which may be delayed by tenths of a second
while the processors are busy.
"""
_QUIET, _DRAINED = 0.05, 0.5
_COUNTING, _COUNTED = 0.5, 0.2
"""Time for which values are counted [s], and largest accepted relative deviation from the set rate; adjacent rates
differ by a factor of two.
"""


class SerialLaser:
    """A sensor that measures `rate` times per second over `measuring_range` [m], with its output off until `start`.

    `baud` is its baud rate; None detects it. `name` is the laser's name in the configuration.

    Raises DeviceNotFound if the port is absent or in use, or no sensor of this type responds; InvalidInput if sensor
    and configuration do not agree; RigError if the sensor rejects a setting. In these cases the port is released.
    """

    def __init__(
        self,
        name: str,
        port: str,
        *,
        baud: int | None,
        rate: float,
        measuring_range: float,
        serial_number: str | None = None,
    ) -> None:
        if baud is not None and baud not in BAUDS:
            allowed = f"the sensor supports {', '.join(str(one) for one in sorted(BAUDS))} baud"
            raise InvalidInput(f"hardware.{name}.baud", baud, allowed)
        self.name = name
        self._who = f"{name} on {port}"
        self._rate = rate
        self._port_name = port
        self._port = open_port(name, port, baud or BAUDS[0])
        self._is_closed = False
        self._dialogue = Dialogue(self._who, self._port)
        self._stream: Stream | None = None
        self._streaming = False
        try:
            answer = silenced(self._dialogue, f"hardware.{name}.baud", baud)
            require_sensor(name, self._who, answer.info, measuring_range, serial_number)
            self._layout, self._is_rate_known = configure(self._dialogue, rate, answer.baud)
        except BaseException:
            self._port.close()
            raise
        self.info = answer.info
        self.baud = answer.baud

    @property
    def description(self) -> str:
        """Model, measuring range, serial number, firmware, port and baud rate of the sensor."""
        return f"{self.info.identity}, {self._port.name} at {self.baud} baud"

    @property
    def silent(self) -> bool:
        """True if no measurement has arrived for 10 periods or 0.4 s, whichever is longer; also before `start` and
        after `stop`.
        """
        if self._stream is None or not self._streaming:
            return True
        return now() - self._stream.last_arrival > max(_SILENT_PERIODS / self._rate, _SILENT_TIME)

    def start(self) -> None:
        """Reset the sensor's counter and time stamp and switch the stream on; returns as soon as values are accepted.

        Raises DeviceTimeout if they do not arrive in the configured format, InvalidInput if they arrive at another
        rate, ConnectionLost if the port has disappeared.
        """
        self._require_open("start")
        if self._streaming:
            raise RigError(f"start is refused: {self._who} is streaming; stop it first")
        self._dialogue.ask("RESETCNT TIMESTAMP MEASCNT")
        self._port.close()
        try:
            self._stream = Stream(self._dialogue, Line(self._who, self._port_name, self.baud), self._layout, self._rate)
        except BaseException:
            self._reopen()
            raise
        self._streaming = True
        try:
            self._stream.ask("OUTPUT RS422")
            if not self._stream.wait(_LOCK_TIME):
                raise DeviceTimeout(
                    f"{self._who} sends no consecutive measurements at {self._rate:g}/s; check the cable"
                    " and the trigger input, or lower the rate"
                )
            if not self._is_rate_known:
                self._require_counted_rate(self._stream)
        except BaseException:
            self.stop()
            raise

    def take(self) -> Readings:
        """The values received since the last call, limited to the last 60 s; never waits.

        Raises ConnectionLost if the port has disappeared or the sensor has restarted, once the values received before
        have been taken, and RigError before `start`.
        """
        if self._stream is None:
            raise RigError(f"take is refused: {self._who} was not started; start it first")
        return self._stream.take()

    def wait(self, timeout: float) -> bool:
        """Wait until `take` returns values or raises; returns False after `timeout` [s]."""
        return self._stream.wait(timeout) if self._stream is not None else False

    def laser(self, on: bool) -> None:
        """Switch the beam on or off. Values that arrive together with the reply are lost. Raises RigError."""
        self._require_open("laser")
        ask = self._stream.ask if self._stream is not None and self._streaming else self._dialogue.ask
        ask(f"LASERPOW {'FULL' if on else 'OFF'}")

    def stop(self) -> None:
        """Switch the stream off; earlier values can still be read. May be called repeatedly, and never raises."""
        if self._stream is None or not self._streaming:
            return
        with suppress(RigError):
            self._stream.ask("OUTPUT NONE")
        self._streaming = False
        self._stream.end()
        self._reopen()
        if self._port.is_open:
            with suppress(ConnectionLost):
                self._dialogue.drain(_QUIET, _DRAINED)

    def close(self) -> None:
        """Switch the stream off and release the port. May be called repeatedly, and never raises."""
        self.stop()
        self._is_closed = True
        with suppress(OSError):
            self._port.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _require_counted_rate(self, stream: Stream) -> None:
        """Count the values of a sensor that does not report its rate. Raises InvalidInput if they do not arrive at the
        set rate.
        """
        began, counted = now(), [stream.take()]
        while now() - began < _COUNTING:
            stream.wait(_COUNTING)
            counted.append(stream.take())
        values = [one for one in counted if len(one)]
        first, last = values[0], values[-1]
        # the first values may have waited in a buffer, so the rate is computed from the last values of the first and of
        # the last chunk
        passed = float(last.arrival[-1] - first.arrival[-1])
        steps = int(last.index[-1] - first.index[-1])
        actual = steps / passed if passed > 0.0 else 0.0
        if not isclose(actual, self._rate, rel_tol=_COUNTED):
            raise InvalidInput(_RATE, self._rate, f"{self._who} sends {actual:.0f} 1/s instead; {_RATES}")

    def _reopen(self) -> None:
        """Reopen the port after the process that read it has ended, if the port still exists."""
        with suppress(RigError):
            self._port = open_port(self.name, self._port_name, self.baud)
        self._dialogue = Dialogue(self._who, self._port)

    def _require_open(self, what: str) -> None:
        if self._is_closed:
            raise RigError(f"{what} is refused: {self._who} is closed; reopen it")
