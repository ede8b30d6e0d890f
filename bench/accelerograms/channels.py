"""Channels of a multi-channel file, and selection of one by number or name."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from bench.accelerograms.choices import Choices
from bench.accelerograms.text import RecordText
from sim.errors import InvalidInput


@dataclass(frozen=True)
class Channel:
    """Channel of a file and its line indices: the header begins at `first`; the samples follow line `data` and end
    before `last`.
    """

    number: int
    name: str
    first: int
    data: int
    last: int


def chosen(text: RecordText, channels: Sequence[Channel], choices: Choices) -> Channel:
    """The channel selected by number or name, or the only one if none is selected. Raises InvalidInput."""
    offered = ", ".join(
        f"{channel.number} ({channel.name})" if channel.name else f"{channel.number}" for channel in channels
    )
    item, wanted = f"channel of {text.path.name}", choices.channel
    if wanted is None:
        if len(channels) > 1:
            raise InvalidInput(item, None, f"the file has several channels; select one with @channel=NUMBER: {offered}")
        return channels[0]
    number = re.fullmatch(r"\s*(\d+)\s*", wanted)
    found = [channel for channel in channels if number is not None and channel.number == int(number[1])]
    if not found:
        found = [channel for channel in channels if _bare(channel.name) == _bare(wanted)]
    if len(found) != 1:
        raise InvalidInput(item, wanted, f"the channels of the file are {offered}; select one by number")
    return found[0]


def _bare(name: str) -> str:
    return re.sub(r"\s+", "", name).lower()
