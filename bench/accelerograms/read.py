"""Reader of earthquake records; detects the file format."""

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
"""Formats in the order of detection; plain columns are the least specific and come last."""

KNOWN = "PEER .AT2, ESM and ITACA .ASC, ITACA .acc, CSMIP .V2, COSMOS, K-NET and KiK-net, USGS .smc, plain columns"


def read_accelerogram(
    path: Path,
    *,
    dt: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    column: str | None = None,
) -> Accelerogram:
    """Read all samples of a record, in m/s2; the result has the detected `format` and `unit`.

    `dt` [s] and `unit` (see `bench.accelerograms.units.UNITS`) are required where the file does not state them, and
    must not contradict the file. `channel`, a number or a name, selects one of several channels; `column`, a number
    from 1 or a heading, one of several plain columns. Raises InvalidInput, naming the line if possible, unless the file
    holds a complete, finite acceleration.
    """
    text = load(path)
    choices = Choices(dt, unit, channel, column)
    for known in _FORMATS:
        if known.recognise(text):
            return combine(text, choices, known.read(text, choices))
    raise text.refusal(0, f"unrecognised file format; supported: {KNOWN}")
