"""A campaign file as the window shows it: its description, points and prediction. Independent of Qt."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bench.app.catalogue import load_protocol
from bench.app.display import texts
from bench.app.display.gains import mark_of
from bench.app.display.samples import DRIVE
from bench.app.formatting import clock
from bench.datafile.reader import open_datafile
from bench.datafile.tables import Column, Table
from bench.document.typography import moment
from sim.errors import RockbenchError


@dataclass(frozen=True, eq=False)
class RunFile:
    """Description of a file, its points and its prediction; `runs` maps the number of each run to its duration [s]."""

    path: Path
    real: Path
    """The path without links, which identifies the file."""
    headline: str
    points: list[dict[str, Any]]
    results: Mapping[str, Column]
    prediction: Table
    channels: Mapping[str, str]
    """Unit of every channel by name, the drive last."""
    sample_rate: float
    """Sample rate [1/s]."""
    runs: Mapping[int, float]
    labels: Mapping[str, str] = field(default_factory=dict[str, str])
    """Displayed names of fields of a point, as declared by the protocol."""

    @property
    def has_gains(self) -> bool:
        """Whether any point has the fields of a gain."""
        return any(mark_of(point) is not None for point in self.points)

    @property
    def name(self) -> str:
        """Short name: the name of the folder, since the files of all runs have the same name."""
        return self.real.parent.name or self.path.stem


def read_file(path: Path) -> RunFile:
    """Read the description of a file. Raises RockbenchError for a file that is unreadable or of another format."""
    with open_datafile(path) as record:
        length = clock(record.rows / record.sample_rate)
        return RunFile(
            path,
            path.resolve(),
            texts.FILE_SUMMARY.format(
                path=path, start=moment(record.start_time), status=record.status, summary=record.summary, length=length
            ),
            record.points,
            record.results,
            record.tables.get("prediction", {}),
            {**{channel.name: channel.unit for channel in record.channels}, DRIVE: "V"},
            record.sample_rate,
            {run.number: len(run.rows) / record.sample_rate for run in record.runs},
            _labels(str(record.metadata.get("protocol", ""))),
        )


def _labels(protocol: str) -> Mapping[str, str]:
    """Displayed names of the results of a protocol; empty for a protocol that is not installed."""
    try:
        return load_protocol(protocol).view.labels
    except RockbenchError:
        return {}


def read_path(path: Path) -> RunFile | Path:
    """The file at a path, or the path itself if it is a folder. Raises the errors of `read_file`."""
    return path if path.is_dir() else read_file(path)
