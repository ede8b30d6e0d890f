"""The file of a re-analysis: new results beside the recorded ones, in a file of its own.

The campaign's file is never written: its checksums stay what they were.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from bench.config.model import BenchConfiguration
from bench.provenance import software
from bench.record import hdf5
from bench.record.checksums import Checksums
from bench.record.errors import RecordError, reason
from bench.record.fields import fields_of
from bench.record.layout import now, software_version
from bench.record.opening import ANALYSIS, ANALYSIS_VERSION
from bench.record.reader import Record
from bench.record.reanalysis import file_hash
from bench.record.rows import Rows
from bench.unfinished import unfinished, whole
from sim.errors import InvalidInput
from sim.parameters import Parameters


@dataclass(frozen=True)
class Analysis:
    """New `points` of type `point_type` for the recorded ones, and all that they were computed with.

    `settings` are what was changed by name; `used` and `configuration` all that was in force.
    """

    points: Sequence[Parameters]
    point_type: type[Parameters]
    settings: Mapping[str, object]
    used: Parameters
    configuration: BenchConfiguration


def write_analysis(original: Path, record: Record, analysis: Analysis, out: Path | None = None) -> Path:
    """Write a new file, `<name>.analysis-<n>.h5` beside the original with the first n that is free unless `out` is
    given. Returns its path.

    Raises InvalidInput when `out` exists or cannot be created, RecordError when the disk fails.
    """
    digest = file_hash(original)
    for path in [out] if out is not None else _names(original):
        try:
            file = hdf5.create(path)
        except FileExistsError:
            if out is None:
                continue
            raise InvalidInput("--out", str(path), "the file exists and is never overwritten; name another") from None
        except OSError as error:
            raise InvalidInput("--out", str(path), f"the file cannot be created ({reason(error)})") from error
        try:
            with unfinished(path):
                try:
                    _fill(file, original, digest, record, analysis)
                    file.close()
                except BaseException:
                    hdf5.let_go(file)
                    raise
                whole(path)
        except (OSError, RuntimeError) as error:
            raise RecordError(f"{path} could not be written ({reason(error)}): see to the disk") from error
        return path
    raise AssertionError("there is always a free name")


def _names(original: Path) -> Iterator[Path]:
    return (original.with_name(f"{original.stem}.analysis-{number}.h5") for number in count(1))


def _fill(file: hdf5.File, original: Path, digest: str, record: Record, analysis: Analysis) -> None:
    file.attrs["NX_class"], file.attrs["default"] = "NXroot", "entry"
    file.attrs["format"], file.attrs["format_version"] = ANALYSIS, ANALYSIS_VERSION
    entry = hdf5.create_group(file, "entry", "NXentry")
    hdf5.write_text(entry, "title", f"re-analysis of {record.title}")
    process = hdf5.create_group(entry, "process", "NXprocess")
    hdf5.write_text(process, "program", "rocking-bench")
    hdf5.write_text(process, "version", software_version())
    hdf5.write_text(process, "date", now(), description="wall clock, ISO 8601")
    texts = {
        "settings": (json.dumps(dict(analysis.settings), default=str), "what was changed, by name (JSON)"),
        "used": (analysis.used.model_dump_json(), "every setting of the analysis that was in force (JSON)"),
        "configuration": (analysis.configuration.model_dump_json(), "configuration of the bench, as used (JSON)"),
        "software": (json.dumps(software()), "versions of what numbers depend on (JSON)"),
    }
    for name, (text, description) in texts.items():
        hdf5.write_text(process, name, text, description=description)
    source = hdf5.create_group(entry, "original", "NXcollection")
    hdf5.write_text(source, "file", original.name, description="name of the campaign's file")
    hdf5.write_text(source, "sha256", digest, description="SHA-256 of the whole file")
    hdf5.write_text(source, "start_time", record.start_time)
    hdf5.write_text(source, "status", record.status)
    hdf5.write_text(source, "protocol", record.metadata.get("protocol", ""))
    fields = fields_of(analysis.point_type)
    points = Rows(entry, "points", fields)
    for point in analysis.points:
        points.add(*(getattr(point, field.name) for field in fields))
    points.write()
    stored = record.points
    known = [field for field in fields if stored and field.name in stored[0]]
    before = Rows(entry, "recorded_points", known)
    for row in stored:
        before.add(*(row[field.name] for field in known))
    before.write()
    Checksums(entry, ())
