"""Settings of the emulated sensor, and the commands that change them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, isinf
from typing import Any, Literal

BAUDS = (9600, 19200, 56000, 115200, 128000, 230400, 256000, 460800, 691200, 921600, 1_000_000)
ADDITIONAL = ("SHUTTER", "COUNTER", "TIMESTAMP", "INTENSITY", "STATE", "DIST_RAW")
"""Values that can be sent with the distance.

The manual does not document the order of transmission. This sensor uses the order of this list, whatever the request.
"""


@dataclass(frozen=True)
class Mastering:
    """A mastered distance: the distance `place`, a fraction of the measuring range, is reported as `value` [m]."""

    place: float
    value: float


@dataclass(frozen=True)
class Settings:
    """Settings of the sensor; factory settings by default.

    Analogue output and 2 kHz are the presumed factory settings: without configuration the sensor does not stream.
    """

    output: Literal["NONE", "RS422", "ANALOG"] = "ANALOG"
    rate: float = 2000.0
    """Measurements per second."""
    additional: tuple[str, ...] = ()
    average: int = 1
    """Measurements in the moving mean."""
    hold: float = 0.0
    """Largest number of successive errors that the last valid value replaces; infinite for no limit."""
    reduction: int = 1
    """Output reduction n: only every n-th measurement is sent."""
    reduced: tuple[str, ...] = ("RS422",)
    """The outputs to which the reduction applies."""
    trigger: Literal["NONE", "EDGE", "PULSE", "SOFTWARE"] = "NONE"
    """With any value except NONE the sensor sends no measurements, since there is no trigger source."""
    laser_power: Literal["FULL", "OFF"] = "FULL"
    mastering: Mastering | None = None
    baud: int = 921_600
    language: Literal["DE", "EN", "CN"] = "EN"
    echo: bool = True
    professional: bool = True
    """Whether the user may change settings."""


BASIC = ("baud", "language")
"""The device settings; all others are measurement settings."""


class Refusal(Exception):
    """A refusal by the sensor. Only E104 and E202 are documented; the other numbers are presumed."""

    def __init__(self, number: int, text: str) -> None:
        super().__init__(f"E{number} {text}")


WRONG_COUNT = "Wrong parameter count"
WRONG_TYPE = "Wrong or unknown parameter type"
OUT_OF_RANGE = "Parameter value is out of range or the format is invalid"


@dataclass(frozen=True)
class Command:
    """Functions that query and change a setting; `change` raises Refusal."""

    show: Callable[[Settings], str]
    change: Callable[[Settings, list[str]], Settings]


def number(text: str, kind: type[int] | type[float] = int) -> float:
    """The number in `text`. Raises Refusal."""
    try:
        return kind(text)
    except ValueError:
        raise Refusal(236, OUT_OF_RANGE) from None


def single(parameters: list[str]) -> str:
    """The single element of `parameters`. Raises Refusal if there are none or several."""
    if len(parameters) != 1:
        raise Refusal(232, WRONG_COUNT)
    return parameters[0]


def _choice(field: str, meanings: dict[str, Any]) -> Command:
    """Command for a setting with a keyword for each value."""
    words = {value: word for word, value in meanings.items()}

    def change(settings: Settings, parameters: list[str]) -> Settings:
        if (word := single(parameters)) not in meanings:
            raise Refusal(234, WRONG_TYPE)
        return replace(settings, **{field: meanings[word]})

    return Command(lambda settings: words[getattr(settings, field)], change)


def _named(*words: str) -> dict[str, Any]:
    return {word: word for word in words}


def _several(field: str, allowed: tuple[str, ...]) -> Command:
    """Command for a setting that is a set of keywords, or NONE; reported in the sensor's order."""

    def show(settings: Settings) -> str:
        return " ".join(getattr(settings, field)) or "NONE"

    def change(settings: Settings, parameters: list[str]) -> Settings:
        if parameters == ["NONE"]:
            return replace(settings, **{field: ()})
        if not set(parameters) <= set(allowed):
            raise Refusal(234, WRONG_TYPE)
        return replace(settings, **{field: tuple(word for word in allowed if word in parameters)})

    return Command(show, change)


def _integer(field: str, allowed: Callable[[float], bool]) -> Command:
    """Command for an integer setting."""

    def change(settings: Settings, parameters: list[str]) -> Settings:
        if not allowed(value := number(single(parameters))):
            raise Refusal(236, OUT_OF_RANGE)
        return replace(settings, **{field: value})

    return Command(lambda settings: str(getattr(settings, field)), change)


def _measuring_rate(rates: tuple[float, ...]) -> Command:
    """Command for the measuring rate, whose parameter is in kHz; `rates` [1/s] are the permitted rates."""

    def change(settings: Settings, parameters: list[str]) -> Settings:
        if (rate := 1e3 * number(single(parameters), float)) not in rates:
            raise Refusal(236, OUT_OF_RANGE)
        return replace(settings, rate=rate)

    return Command(lambda settings: f"{settings.rate / 1e3:g}", change)


def _show_hold(settings: Settings) -> str:
    return "NONE" if not settings.hold else "INFINITE" if isinf(settings.hold) else f"{settings.hold:g}"


def _change_hold(settings: Settings, parameters: list[str]) -> Settings:
    words = {"NONE": 0.0, "INFINITE": inf}
    word = single(parameters)
    cycles = words[word] if word in words else number(word)
    if word not in words and not 1 <= cycles <= 1024:
        raise Refusal(236, OUT_OF_RANGE)
    return replace(settings, hold=cycles)


def _show_average(settings: Settings) -> str:
    return "NONE" if settings.average == 1 else f"MOVING {settings.average}"


def _change_average(settings: Settings, parameters: list[str]) -> Settings:
    match parameters:
        case ["NONE"]:
            return replace(settings, average=1)
        case ["MOVING", text]:
            if (n := int(number(text))) not in (2, 4, 8, 16, 32, 64, 128):
                raise Refusal(236, OUT_OF_RANGE)
            return replace(settings, average=n)
        case _:
            raise Refusal(234, WRONG_TYPE)


def commands(rates: tuple[float, ...]) -> dict[str, Command]:
    """The commands for settings by name; `rates` are the measuring rates of the sensor [1/s]."""
    return {
        "LANGUAGE": _choice("language", _named("DE", "EN", "CN")),
        "ECHO": _choice("echo", {"ON": True, "OFF": False}),
        "TRIGGER": _choice("trigger", _named("NONE", "EDGE", "PULSE", "SOFTWARE")),
        "BAUDRATE": _integer("baud", BAUDS.__contains__),
        "MEASRATE": _measuring_rate(rates),
        "LASERPOW": _choice("laser_power", _named("FULL", "OFF")),
        "AVERAGE": Command(_show_average, _change_average),
        "OUTPUT": _choice("output", _named("NONE", "RS422", "ANALOG")),
        "OUTREDUCEDEVICE": _several("reduced", ("RS422", "ANALOG")),
        "OUTREDUCECOUNT": _integer("reduction", lambda n: 1 <= n <= 3_000_000),
        "OUTHOLD": Command(_show_hold, _change_hold),
        "OUTADD_RS422": _several("additional", ADDITIONAL),
    }
