"""Reads an earthquake record, whichever of the usual formats it is in."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from bench.accelerograms import columns, cosmos, csmip, esm, itaca, knet, peer, smc
from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.choices import Choices, Reading, combine
from bench.accelerograms.text import RecordText, load


class _Format(NamedTuple):
    recognise: Callable[[RecordText], bool]
    read: Callable[[RecordText, Choices], Reading]


_FORMATS = tuple(
    _Format(module.recognise, module.read) for module in (esm, itaca, csmip, cosmos, knet, smc, peer, columns)
)
"""Told apart by what the files hold, in this order; columns of numbers come last because they say least."""

KNOWN = "PEER .AT2, ESM and ITACA .ASC, ITACA .acc, CSMIP .V2, COSMOS, K-NET and KiK-net, USGS .smc, plain columns"


def read_accelerogram(
    path: Path,
    *,
    dt: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    column: str | None = None,
) -> Accelerogram:
    """Every sample of a record, in m/s2; `format` and `unit` of the result say what the file was recognised as.

    `dt` [s] and `unit` (see `bench.accelerograms.units.UNITS`) are needed where the file does not state them, and may
    not contradict it where it does. `channel`, a number or a name, chooses in files of several channels, `column`,
    counted from 1 or a heading, among plain columns.

    Raises InvalidInput, naming the line where there is one, for anything that is not a whole, finite acceleration.
    """
    text = load(path)
    choices = Choices(dt, unit, channel, column)
    for known in _FORMATS:
        if known.recognise(text):
            return combine(text, choices, known.read(text, choices))
    raise text.refusal(0, f"the file begins like no format that is known here: {KNOWN}")
