"""CSMIP volume 2 files (`.V2`): for each channel 25 lines of text, headers of integers and reals, then acceleration,
velocity and displacement in eight columns, usually 10 characters wide, that may touch.

Source: California Strong Motion Instrumentation Program, "Standard tape format for CSMIP strong-motion data tapes",
OSMS 85-03 (1985); its later releases state the column format, such as (8f10.6), next to the count.
"""

import re

from bench.accelerograms.channels import Channel, chosen
from bench.accelerograms.choices import Choices, Reading, refuse_choice
from bench.accelerograms.numbers import NUMBER, numbers, value_of
from bench.accelerograms.stated import acceleration_unit, check_peak, count_in
from bench.accelerograms.text import RecordText

_START = re.compile(r"^\s*CORRECTED ACCELEROGRAM\b.*?CHAN\s*(\d+):\s*(.*?)\s*(?:\bFROM\b.*)?$", re.IGNORECASE)
_DATA = re.compile(
    r"^\s*(?P<count>\d+)\s+POINTS OF (?P<what>ACCEL|VELOC|DISPL)\w*\s+DATA EQUALLY SPACED AT\s+"
    rf"(?P<dt>{NUMBER})\s*SEC\w*\.?,?\s*(?:IN|\(UNITS:)\s*(?P<unit>[A-Z/0-9^]+)",
    re.IGNORECASE,
)
_WIDTH = re.compile(r"\(\s*\d+\s*F\s*(\d+)", re.IGNORECASE)
_END = re.compile(r"^\s*/&")
_PEAK = re.compile(rf"^\s*PEAK ACCELERATION\s*=\s*({NUMBER})\s+(\S+)", re.IGNORECASE)


def recognise(text: RecordText) -> bool:
    """Whether the file begins with a line that announces a corrected accelerogram and its channel."""
    return _START.match(text.lines[0]) is not None


def read(text: RecordText, choices: Choices) -> Reading:
    """Read a CSMIP file. Raises InvalidInput."""
    refuse_choice(text, choices, "column")
    channels = _channels(text)
    channel = chosen(text, channels, choices)
    head = _DATA.match(text.lines[channel.data])
    assert head is not None
    unit = acceleration_unit(text, channel.data, head["unit"])
    stated = _WIDTH.search(text.lines[channel.data])
    count = count_in(text, channel.data, head["count"])
    width = 10 if stated is None else int(stated[1])
    samples = numbers(text, channel.data + 1, channel.last, count, width)
    for index in range(channel.first, channel.data):
        peak = _PEAK.match(text.lines[index])
        if peak is not None and acceleration_unit(text, index, peak[2]) == unit:
            check_peak(text, index, peak[1], samples)
    lines = (line.strip() for line in text.lines[channel.first : channel.first + 25])
    return Reading(
        format="CSMIP V2",
        values=samples.values,
        dt=value_of(head["dt"]),
        unit=unit,
        header={
            "channel": f"{channel.number} ({channel.name})",
            **{f"line {k}": line for k, line in enumerate(lines, 1) if line},
        },
        part=f"ch{channel.number}" if len(channels) > 1 else "",
    )


def _channels(text: RecordText) -> list[Channel]:
    """All channels, each with its block of accelerations. Raises InvalidInput."""
    starts = [(index, match) for index, line in enumerate(text.lines) if (match := _START.match(line)) is not None]
    ends = [index for index, _ in starts[1:]] + [len(text.lines)]
    found: list[Channel] = []
    for (first, match), last in zip(starts, ends, strict=True):
        heads = {k: head for k in range(first, last) if (head := _DATA.match(text.lines[k])) is not None}
        data = next((k for k, head in heads.items() if head["what"].upper() == "ACCEL"), None)
        if data is None:
            raise text.refusal(first, f"the acceleration of channel {match[1]} is missing; the file is truncated")
        stop = next((k for k in range(data + 1, last) if k in heads or _END.match(text.lines[k])), last)
        found.append(Channel(int(match[1]), match[2].strip(), first, data, stop))
    return found
