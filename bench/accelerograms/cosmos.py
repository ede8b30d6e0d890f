"""COSMOS files, version 1.20 (`.V1c`, `.V2c`): text, integers, reals and comments, then one quantity of one channel.

Each part begins with the number of lines or values that follow and their format. Real 62 is the time step [ms] of the
samples; where it is absent, real 34 is used, that of the recorder [s], because processed records may have been
resampled. A file may contain several channels, with the velocity and displacement of each. Source: COSMOS Strong Motion
Programs Board, "COSMOS strong motion data format", version 1.20, August 15, 2001.
"""

import re
from typing import NamedTuple

from bench.accelerograms.channels import Channel, chosen
from bench.accelerograms.choices import Choices, Reading, refuse_choice
from bench.accelerograms.numbers import NUMBER, numbers, value_of
from bench.accelerograms.stated import acceleration_unit, check_peak, count_in
from bench.accelerograms.text import RecordText
from bench.accelerograms.units import spelled

_START = re.compile(r"\(\s*Format\s+v", re.IGNORECASE)
_CHANNEL = re.compile(r"^\s*Sta\w*\s+Chan\s*(\d+)\s*:\s*(.*?)\s*(?:\(|Location|$)", re.IGNORECASE)
_REALS = re.compile(
    r"^\s*(\d+)\s+Real-header values follow on\s+(\d+)\s+lines?\s*,\s*Format\s*=\s*\(\s*\d*\s*[A-Z]+\s*(\d+)",
    re.IGNORECASE,
)
_DATA = re.compile(
    r"^\s*(?P<count>\d+)\s+(?P<what>\S.*?)\s+pts\s*,.*?units\s*=\s*(?P<unit>[^,(]+?)\s*(?:\([^)]*\))?\s*,"
    r"\s*Format\s*=\s*\(\s*\d*\s*[A-Z]+\s*(?P<width>\d+)",
    re.IGNORECASE,
)
_END = re.compile(r"^\s*End-of-data", re.IGNORECASE)
_PEAK = re.compile(rf"^\s*Processed:.*?Max\s*=\s*({NUMBER})\s+(\S+)", re.IGNORECASE)
_STEP, _RECORDER = 62, 34
"""Positions of the time step of the samples [ms], and of that of the recorder [s], among the reals, counted from 1."""
_DURATION = re.compile(rf"\bapprox\s+({NUMBER})\s*sec", re.IGNORECASE)
_ROUNDED, _ABOUT = 1.5, 0.02
"""Largest difference between the duration of the samples and the stated one, which is rounded: a time [s], and a
fraction in addition.
"""


class _Block(NamedTuple):
    """Block of a file, by line indices: its header begins at `first`; its data follow line `data` and end before
    `last`.
    """

    first: int
    data: int
    last: int


def recognise(text: RecordText) -> bool:
    """Whether the first line states a COSMOS format and a header of reals follows."""
    return _START.search(text.lines[0]) is not None and any(_REALS.match(line) for line in text.lines)


def read(text: RecordText, choices: Choices) -> Reading:
    """Read a COSMOS file. Raises InvalidInput."""
    refuse_choice(text, choices, "column")
    channels = _channels(text)
    channel = chosen(text, channels, choices)
    head = _DATA.match(text.lines[channel.data])
    assert head is not None
    unit = acceleration_unit(text, channel.data, head["unit"])
    count = count_in(text, channel.data, head["count"])
    dt = _step(text, channel)
    _check_duration(text, channel.data, count * dt, dt)
    samples = numbers(text, channel.data + 1, channel.last, count, int(head["width"]))
    header = text.lines[channel.first : channel.data]
    for index, line in enumerate(header, channel.first):
        peak = _PEAK.match(line)
        if peak is not None and spelled(peak[2]) == unit and value_of(peak[1]) != 0.0:
            check_peak(text, index, peak[1], samples)
    titles = [line.strip() for line in header[:13]] + [line.strip() for line in header if line.startswith("|")]
    return Reading(
        format="COSMOS",
        values=samples.values,
        dt=dt,
        unit=unit,
        header={
            "channel": f"{channel.number} ({channel.name})",
            **{f"line {k}": line for k, line in enumerate(titles, 1) if line},
        },
        part=f"ch{channel.number}" if len(channels) > 1 else "",
    )


def _step(text: RecordText, channel: Channel) -> float:
    for index in range(channel.first, channel.data):
        reals = _REALS.match(text.lines[index])
        if reals is not None:
            values = numbers(text, index + 1, index + 1 + int(reals[2]), int(reals[1]), int(reals[3])).values
            if values.size >= _STEP and values[_STEP - 1] > 0.0:
                return float(values[_STEP - 1]) / 1e3
            if values.size >= _RECORDER and values[_RECORDER - 1] > 0.0:
                return float(values[_RECORDER - 1])
            raise text.refusal(index, f"real number {_STEP}, the time step, is missing or not positive")
    raise text.refusal(
        channel.first, "the real numbers, which include the time step, are missing; download the file again"
    )


def _check_duration(text: RecordText, index: int, duration: float, dt: float) -> None:
    """Raise InvalidInput if the line at `index` states another duration [s] than that of the samples."""
    found = _DURATION.search(text.lines[index])
    if found is not None:
        stated = value_of(found[1])
        if abs(duration - stated) > _ROUNDED + _ABOUT * stated:
            raise text.refusal(
                index,
                f"it states {stated:g} s, but with the step of the header, {dt:g} s, its samples last {duration:.4g} s:"
                " correct the header, or download the file again",
            )


def _channels(text: RecordText) -> list[Channel]:
    """The channels that contain an acceleration."""
    found: list[Channel] = []
    for block in _blocks(text):
        head = _DATA.match(text.lines[block.data])
        if head is None or "accel" not in head["what"].lower():
            continue
        named = [match for line in text.lines[block.first : block.data] if (match := _CHANNEL.match(line))]
        number, name = (int(named[0][1]), named[0][2]) if named else (len(found) + 1, "")
        found.append(Channel(number, name, block.first, block.data, block.last))
    if not found:
        raise text.refusal(0, "this file contains no acceleration; use the acceleration file of the record")
    return found


def _blocks(text: RecordText) -> list[_Block]:
    found: list[_Block] = []
    first = 0
    for data in (index for index, line in enumerate(text.lines) if _DATA.match(line)):
        after = range(data + 1, len(text.lines))
        last = next((k for k in after if _END.match(text.lines[k]) or _START.search(text.lines[k])), len(text.lines))
        found.append(_Block(first, data, last))
        first = last + 1 if last < len(text.lines) and _END.match(text.lines[last]) else last
    return found
