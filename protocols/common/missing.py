"""Causes of missing samples, with their remedies."""

from drivers.optoncdt.codec import IMPLAUSIBLE, LATE, LOST
from sim.channel import STOREYS, Channel

_OF_THE_LINE = {
    LATE: "the computer was busy, or the sensor is silent: close other programs, increase acquisition.lead,"
    " or check the sensor's power and port",
    LOST: "check the cable, the RS422 adapter and its latency timer",
    IMPLAUSIBLE: "bit errors on the serial line: check the cable, its shield and the RS422 adapter",
}
"""Remedies for values that were measured but arrived late, corrupted or not at all."""


def cause(channel: Channel, count: int, *, at_rest: bool) -> str:
    """Why samples with this invalid count are missing, and the remedy, `at_rest` or in motion."""
    why = channel.meaning(count)
    if (remedy := _OF_THE_LINE.get(count)) is not None and count in channel.faults:
        return f"{why}: {remedy}"
    if channel.name not in STOREYS:
        return f"{why}: check the sensor's supply, its cable, and the terminal and range of the input"
    place = "the storey rests in the middle of the laser's range"
    if at_rest:
        return f"{why}: check that the laser is on and that {place}"
    return f"{why}: check that {place}, or reduce the motion"
