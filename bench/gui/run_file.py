"""What the results page shows of a file, and stretches of its samples. Knows nothing of Qt."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.cli.words import clock
from bench.gui import texts
from bench.link.reduction import extremes
from bench.record.tables import Column, Table

DRIVE = "drive"
CHUNK = 1_000_000
"""Rows that are read at a time: an hour of samples does not fit into memory."""


@dataclass(frozen=True, eq=False)
class RunFile:
    """The headings of a file, its points and its prediction; `runs` are the numbers of its runs and their seconds."""

    path: Path
    told: str
    points: list[dict[str, Any]]
    results: Mapping[str, Column]
    prediction: Table
    channels: Mapping[str, str]
    """Name and unit of every channel, the drive last."""
    runs: Mapping[int, float]

    @property
    def name(self) -> str:
        """A short name: every file of a run is called alike, its folder is not."""
        return self.path.resolve().parent.name or self.path.stem


@dataclass(frozen=True, eq=False)
class Stretch:
    """Samples of a channel from `begin` to `end` [s] as a line through the extremes of its parts: least and largest of
    each in turn. Both arrays have shape (n,); values are in the channel's unit.
    """

    time: NDArray[np.float64]
    values: NDArray[np.float32]
    channel: str
    unit: str
    begin: float
    end: float


def read_file(path: Path) -> RunFile:
    """Read the headings. Raises RockbenchError for what is no record of ours or cannot be read."""
    from bench.record.reader import open_record

    with open_record(path) as record:
        length = clock(record.rows / record.sample_rate)
        return RunFile(
            path,
            texts.FILE_TOLD.format(
                path=path, start=record.start_time, status=record.status, summary=record.summary, length=length
            ),
            record.points,
            record.results,
            record.tables.get("prediction", {}),
            {**{channel.name: channel.unit for channel in record.channels}, DRIVE: "V"},
            {run.number: len(run.rows) / record.sample_rate for run in record.runs},
        )


def read_stretch(path: Path, run: int, channel: str, begin: float, end: float, parts: int) -> Stretch:
    """Channel `channel` of run `run` between two moments [s] since the rig was armed, in at most `parts` parts.

    A stretch with fewer samples than two in a part is given sample by sample. Raises RockbenchError.
    """
    from bench.record.reader import open_record

    with open_record(path) as record:
        rate = record.sample_rate
        rows = next(each.rows for each in record.runs if each.number == run)
        first = rows.start + min(max(int(begin * rate), 0), len(rows))
        last = rows.start + min(max(int(np.ceil(end * rate)) + 1, 0), len(rows))
        unit = "V" if channel == DRIVE else next(each.unit for each in record.channels if each.name == channel)
        width = max((last - first) // max(parts, 1), 1)
        lows, highs = [np.zeros(0, np.float32)], [np.zeros(0, np.float32)]
        step = max(CHUNK // width, 1) * width
        for at in range(first, last, step):
            part = slice(at, min(at + step, last))
            values = record.drive(part).astype(np.float64) if channel == DRIVE else record.values(channel, part)
            low, high = extremes(values[:, None], width)
            lows.append(low[:, 0])
            highs.append(high[:, 0])
    low, high = np.concatenate(lows), np.concatenate(highs)
    time = (first - rows.start + width * np.arange(low.size, dtype=np.float64)) / rate
    if width == 1:
        return Stretch(time, low, channel, unit, begin, end)
    return Stretch(np.repeat(time, 2), np.column_stack((low, high)).ravel(), channel, unit, begin, end)
