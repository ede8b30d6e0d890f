"""Which values the sensor sends with each measurement, and in which order."""

from dataclasses import dataclass

from drivers.errors import RigError
from sim.errors import InvalidInput

BITS_PER_VALUE = 30
"""Three bytes, each with a start and a stop bit."""

_WISHES = (("COUNTER", "TIMESTAMP"), ("COUNTER",))
"""Additional signals that are asked for, the best choice first."""
_VALUES = {"TIMESTAMP": ("TIMESTAMP_LO", "TIMESTAMP_HI")}
"""The time stamp takes two values, of 16 bits each (manual, p. 66)."""


@dataclass(frozen=True)
class Layout:
    """Places of the values within a measurement; the distance is at 0. `time` are the two halves of the time stamp."""

    size: int
    counter: int
    time: tuple[int, int] | None


def wanted(rate: float, baud: int) -> tuple[str, ...]:
    """The additional signals that fit on the line at `rate` [1/s]: counter and time stamp, or the counter alone.

    Raises InvalidInput when not even that fits: without the counter a lost value would go unnoticed.
    """
    for signals in _WISHES:
        if (1 + len(_values(signals))) * rate * BITS_PER_VALUE <= baud:
            return signals
    most = baud / (2 * BITS_PER_VALUE)
    allowed = (
        f"{baud} baud carry {most:.0f} measurements/s with their counter;"
        " choose a lower rate, or a higher baud rate in the sensor's web interface"
    )
    raise InvalidInput("hardware.lasers.rate", rate, allowed)


def layout_in(who: str, reported: list[str], signals: tuple[str, ...]) -> Layout:
    """The layout that the sensor reports by GETOUTINFO_RS422, in the order of its output (manual, p. 109).

    Raises RigError when it does not begin with the distance or lacks one of `signals`.
    """
    values = _values(tuple(reported))
    needed = _values(signals)
    if not values or not values[0].startswith("DIST") or any(values.count(value) != 1 for value in needed):
        told, sent = ", ".join(signals).lower(), " ".join(reported) or "nothing"
        raise RigError(
            f"{who} was told to send distance, {told} and sends {sent};"
            " its firmware is not supported: update it, or use the analogue output"
        )
    time = (values.index("TIMESTAMP_LO"), values.index("TIMESTAMP_HI")) if "TIMESTAMP" in signals else None
    return Layout(len(values), values.index("COUNTER"), time)


def _values(signals: tuple[str, ...]) -> list[str]:
    return [value for signal in signals for value in _VALUES.get(signal, (signal,))]
