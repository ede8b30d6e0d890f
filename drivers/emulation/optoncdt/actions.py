"""Commands that are not settings: queries, reset, storage and mastering (manual of the optoNCDT 1420, p. 97 to 108)."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from drivers.emulation.optoncdt.sensor import Sensor
from drivers.emulation.optoncdt.settings import BASIC, WRONG_COUNT, WRONG_TYPE, Refusal, number, single

_MASTERING_TIME = 2.0
"""Time-out of mastering without a valid distance [s] (manual, p. 108)."""


@dataclass(frozen=True)
class Request:
    """A parsed command, received at the host time `now` [s]."""

    text: str
    parameters: list[str]
    now: float


@dataclass(frozen=True)
class Identity:
    """Identification of the sensor; `measuring_range` in metres."""

    name: str
    serial: str
    measuring_range: float

    @property
    def lines(self) -> list[str]:
        """The lines that identify the sensor; layout and other entries as in the manual of the optoNCDT 1420, p. 97."""
        return [
            f"Name:            {self.name}",
            f"Serial:          {self.serial}",
            "Option:          000",
            "Article:         4120212",
            "Cable head:      Wire",
            f"Measuring range: {1e3 * self.measuring_range:.2f}mm",
            "Version:         001.010",
            "Hardware-rev:    00",
            "Boot-version:    001.000",
        ]


class Mastering:
    """A pending mastering request, which waits for a valid distance for at most two seconds."""

    def __init__(self, sensor: Sensor, value: float, done: list[str], now: float) -> None:
        self._sensor, self._value, self._done = sensor, value, done
        self._deadline = now + _MASTERING_TIME

    def outcome(self, now: float) -> list[str] | None:
        """The answer; None while no valid distance has been measured. Raises Refusal after the time-out."""
        if self._sensor.master(self._value, now):
            return self._done
        if now >= self._deadline:
            raise Refusal(104, "Timeout")
        return None


class Actions:
    """The actions of `sensor`, in `table` by command; each returns the lines of its answer, or a pending answer.

    Every action raises Refusal for an invalid request. `boot_time` is the duration of a reset [s].
    """

    def __init__(self, sensor: Sensor, identity: Identity, password: str, boot_time: float) -> None:
        self._sensor, self._identity = sensor, identity
        self._password, self._boot_time = password, boot_time
        self._factory = sensor.stored
        self.table: dict[str, Callable[[Request], list[str] | Mastering]] = {
            "GETINFO": self._info,
            "GETOUTINFO_RS422": self._outputs,
            "GETUSERLEVEL": self._user_level,
            "LOGIN": self._login,
            "LOGOUT": self._logout,
            "RESETCNT": self._reset_counters,
            "RESET": self._reset,
            "MASTERMV": self._master,
            "BASICSETTINGS": self._basic_settings,
            "MEASSETTINGS": self._measuring_settings,
            "SETDEFAULT": self._set_default,
        }

    def done(self, request: Request) -> list[str]:
        """The answer to a command that succeeds and returns no value (manual, p. 98)."""
        return [f"{request.text} ok"] if self._sensor.settings.echo else []

    def require_professional(self) -> None:
        """Raise Refusal if the user level is USER."""
        if not self._sensor.settings.professional:
            raise Refusal(202, "Access denied")

    @property
    def mastering(self) -> str:
        """The mastering setting in the sensor's format."""
        mastering = self._sensor.settings.mastering
        return "MASTERMV NONE" if mastering is None else f"MASTERMV MASTER {1e3 * mastering.value:.6f}"

    def _info(self, request: Request) -> list[str]:
        _no_parameters(request)
        # existing clients expect one line, the echo, before the name
        return [request.text, *self._identity.lines] if self._sensor.settings.echo else self._identity.lines

    def _outputs(self, request: Request) -> list[str]:
        _no_parameters(request)
        return [" ".join(("GETOUTINFO_RS422 DIST1", *self._sensor.settings.additional))]

    def _user_level(self, request: Request) -> list[str]:
        _no_parameters(request)
        return [f"GETUSERLEVEL {'PROFESSIONAL' if self._sensor.settings.professional else 'USER'}"]

    def _login(self, request: Request) -> list[str]:
        if single(request.parameters) != self._password.upper():
            raise Refusal(202, "Access denied")
        self._sensor.settings = replace(self._sensor.settings, professional=True)
        return self.done(request)

    def _logout(self, request: Request) -> list[str]:
        _no_parameters(request)
        self._sensor.settings = replace(self._sensor.settings, professional=False)
        return self.done(request)

    def _reset_counters(self, request: Request) -> list[str]:
        asked = set(request.parameters) or {"TIMESTAMP", "MEASCNT"}
        if not asked <= {"TIMESTAMP", "MEASCNT"}:
            raise Refusal(234, WRONG_TYPE)
        grid = self._sensor.grid
        if "TIMESTAMP" in asked:
            grid.epoch.reset(request.now)
        if "MEASCNT" in asked:
            grid.count.reset(grid.end(request.now))
        return self.done(request)

    def _reset(self, request: Request) -> list[str]:
        _no_parameters(request)
        self._sensor.boot(request.now + self._boot_time)
        return []

    def _master(self, request: Request) -> list[str] | Mastering:
        if not request.parameters:
            return [self.mastering]
        self.require_professional()
        if request.parameters == ["NONE"]:
            self._sensor.settings = replace(self._sensor.settings, mastering=None)
            return self.done(request)
        if len(request.parameters) != 2:
            raise Refusal(232, WRONG_COUNT)
        if request.parameters[0] != "MASTER":
            raise Refusal(234, WRONG_TYPE)
        value = 1e-3 * number(request.parameters[1], float)
        if not 0.0 <= value <= 2.0 * self._identity.measuring_range:
            raise Refusal(602, "Master value is out of range")
        return Mastering(self._sensor, value, self.done(request), request.now)

    def _basic_settings(self, request: Request) -> list[str]:
        self.require_professional()
        sensor = self._sensor
        match request.parameters:
            case ["STORE"]:
                sensor.stored = replace(sensor.stored, **{name: getattr(sensor.settings, name) for name in BASIC})
            case ["READ"]:
                sensor.settings = replace(sensor.settings, **{name: getattr(sensor.stored, name) for name in BASIC})
            case _:
                raise Refusal(234, WRONG_TYPE)
        return self.done(request)

    def _measuring_settings(self, request: Request) -> list[str]:
        """Store or restore the measurement settings; there is a single slot, so the setup name is ignored."""
        self.require_professional()
        sensor = self._sensor
        match request.parameters:
            case ["STORE", _]:
                basic = {name: getattr(sensor.stored, name) for name in BASIC}
                sensor.stored = replace(sensor.settings, **basic)
            case ["READ", _]:
                basic = {name: getattr(sensor.settings, name) for name in BASIC}
                sensor.apply(replace(sensor.stored, **basic), request.now)
            case _:
                raise Refusal(234, WRONG_TYPE)
        return self.done(request)

    def _set_default(self, request: Request) -> list[str]:
        self.require_professional()
        if single(request.parameters) != "ALL":
            raise Refusal(234, WRONG_TYPE)
        self._sensor.stored = self._factory
        self._sensor.apply(self._factory, request.now)
        return self.done(request)


def _no_parameters(request: Request) -> None:
    if request.parameters:
        raise Refusal(232, WRONG_COUNT)
