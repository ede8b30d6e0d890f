"""One sensor on its serial line: opened, identified, set up, read."""

from contextlib import suppress
from typing import Self

from drivers.clock import now
from drivers.errors import ConnectionLost, DeviceTimeout, RigError
from drivers.optoncdt.dialogue import Dialogue
from drivers.optoncdt.port import BAUDS, open_port
from drivers.optoncdt.search import silenced
from drivers.optoncdt.setup import configure, require_sensor
from drivers.optoncdt.stream import Readings, Stream
from sim.errors import InvalidInput

_LOCK_TIME = 2.0
"""How long the first trusted value may take after the stream was switched on [s]."""
_SILENT_PERIODS, _SILENT_TIME = 10.0, 0.1
"""A sensor is silent when it has said nothing for so many periods, and for so long [s]."""
_QUIET, _DRAINED = 0.05, 0.5


class SerialLaser:
    """A sensor that measures `rate` times a second over `measuring_range` [m], with its output off until `start`.

    `baud` is the baud rate it is set to; None searches for it. `name` is the laser's name in the configuration.

    Raises DeviceNotFound when the port is absent or in use, or no sensor of this type answers; InvalidInput when
    sensor and configuration do not agree; RigError when the sensor refuses a setting. The port is released then.
    """

    def __init__(self, name: str, port: str, *, baud: int | None, rate: float, measuring_range: float) -> None:
        if baud is not None and baud not in BAUDS:
            allowed = f"the sensor has {', '.join(str(one) for one in sorted(BAUDS))}"
            raise InvalidInput(f"hardware.{name}.baud", baud, allowed)
        self.name = name
        self._who = f"{name} on {port}"
        self._rate = rate
        self._port = open_port(name, port, baud or BAUDS[0])
        self._dialogue = Dialogue(self._who, self._port)
        self._stream: Stream | None = None
        self._streaming = False
        try:
            answer = silenced(self._dialogue, f"hardware.{name}.baud", baud)
            require_sensor(name, self._who, answer.info, measuring_range)
            self._layout = configure(self._dialogue, rate, answer.baud)
        except BaseException:
            self._port.close()
            raise
        self.info = answer.info
        self.baud = answer.baud

    @property
    def description(self) -> str:
        """Model, range, serial number, firmware and line of the sensor."""
        return f"{self.info.identity}, {self._port.name} at {self.baud} baud"

    @property
    def silent(self) -> bool:
        """True when no measurement has arrived for 10 periods, and for 0.1 s; also before `start` and after `stop`."""
        if self._stream is None or not self._streaming:
            return True
        return now() - self._stream.last_arrival > max(_SILENT_PERIODS / self._rate, _SILENT_TIME)

    def start(self) -> None:
        """Switch the stream on, with index and time at zero, and return when values are trusted.

        Raises DeviceTimeout when they do not come as the sensor said it would send them, ConnectionLost.
        """
        self._require_open("start")
        if self._streaming:
            raise RigError(f"start is refused: {self._who} streams already; stop it first")
        self._dialogue.ask("RESETCNT TIMESTAMP MEASCNT")
        self._stream = Stream(self._dialogue, self._layout, self._rate)
        self._streaming = True
        try:
            self._stream.ask("OUTPUT RS422")
            if not self._stream.wait(_LOCK_TIME):
                raise DeviceTimeout(
                    f"{self._who} sends no measurements at {self._rate:g} 1/s that follow each other; check the cable"
                    " and the trigger input, or lower the rate"
                )
        except BaseException:
            self.stop()
            raise

    def take(self) -> Readings:
        """Everything that came since the last time, 60 s at most; never waits.

        Raises ConnectionLost when the port is gone or the sensor was switched off in between, RigError before `start`.
        """
        if self._stream is None:
            raise RigError(f"take is refused: {self._who} was not started; start it first")
        return self._stream.take()

    def wait(self, timeout: float) -> bool:
        """Wait until there is something to take, or a failure to be told by `take`; False after `timeout` [s]."""
        return self._stream.wait(timeout) if self._stream is not None else False

    def laser(self, on: bool) -> None:
        """Switch the beam. While values come, those that come with the sensor's answer are lost. Raises RigError."""
        self._require_open("laser")
        ask = self._stream.ask if self._stream is not None and self._streaming else self._dialogue.ask
        ask(f"LASERPOW {'FULL' if on else 'OFF'}")

    def stop(self) -> None:
        """Switch the stream off; what came before can still be taken. Allowed any number of times, never raises."""
        if self._stream is None or not self._streaming:
            return
        with suppress(RigError):
            self._stream.ask("OUTPUT NONE")
        self._streaming = False
        self._stream.end()
        with suppress(ConnectionLost):
            self._dialogue.drain(_QUIET, _DRAINED)

    def close(self) -> None:
        """Switch the stream off and release the port. Allowed any number of times, never raises."""
        self.stop()
        with suppress(OSError):
            self._port.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _require_open(self, what: str) -> None:
        if not self._port.is_open:
            raise RigError(f"{what} is refused: {self._who} is closed; open it anew")
