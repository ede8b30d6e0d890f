"""Re-analysis of recorded samples with changed settings, and the file of its results."""

import json
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from bench.config.model import BenchConfiguration
from bench.datafile import hdf5
from bench.datafile.checksums import Checksums
from bench.datafile.fields import fields_of
from bench.datafile.hdf5_reading import DataFileError, reason
from bench.datafile.inspection import file_hash
from bench.datafile.layout import now, software_version
from bench.datafile.opening import ANALYSIS, ANALYSIS_VERSION
from bench.datafile.reader import DataFile
from bench.datafile.rows import Rows
from bench.engine.steps import Outcome, Plan, Step
from bench.events import Subscriber
from bench.protocol import Follower, Prepared, each_step
from bench.provenance import software
from bench.replay.compare import DRIVE, POINTS
from bench.replay.session import Replayed, replay
from bench.unfinished import unfinished, whole
from drivers.clock import VirtualClock
from sim.errors import InvalidInput, RockbenchError
from sim.parameters import Parameters


class NotComparable(RockbenchError):
    """Error raised if results of the requested analysis could not be compared with the recorded ones."""

    error_code = "not_comparable"


class DriveChanged(NotComparable):
    """Error raised for settings that would have changed the drive of the table."""


def follow(
    record: DataFile,
    prepared: Prepared[Any],
    make: Callable[[], Follower],
    subscribers: Sequence[Subscriber] = (),
) -> tuple[Replayed, tuple[Parameters, ...]]:
    """Replay the recorded plan with a follower. Returns the replay and the follower's points.

    Raises NotComparable if this software does not reproduce the recorded points with the recorded settings, because the
    effects of the settings could then not be separated from those of the software.
    """
    configuration = prepared.configuration
    follower = make()
    # the follower is the first subscriber, so that it processes a block before the plan continues
    heard = [follower, *subscribers]
    plan = _watched(prepared.plan(), follower)
    replayed = replay(record, plan, configuration, clock=VirtualClock(), subscribers=heard)
    if (why := replayed.first_difference(POINTS)) is not None:
        raise NotComparable(f"this software does not reproduce the recording with the same settings: {why}")
    return replayed, tuple(follower.points)


def carry_out(
    record: DataFile, changed: Prepared[Any], configuration: BenchConfiguration, subscribers: Sequence[Subscriber] = ()
) -> tuple[Replayed, tuple[Parameters, ...]]:
    """Carry out a plan with `changed` settings on the recorded samples. Returns the replay and its points.

    `configuration` is the recorded one. Raises DriveChanged if the plan with these settings would have driven the
    table differently, because the recorded motion is not the response to that drive, or for longer.
    """
    replayed = replay(record, changed.plan(), configuration, clock=VirtualClock(), subscribers=subscribers)
    if (why := replayed.first_difference(DRIVE)) is not None:
        raise DriveChanged(f"these settings would change the drive of the table ({why}): repeat the measurement")
    if replayed.beyond is not None:
        raise DriveChanged(f"these settings need more than was recorded ({replayed.beyond}): repeat the measurement")
    return replayed, replayed.points


def _watched(plan: Plan, follower: Follower) -> Generator[Step, Outcome, object]:
    def watch(step: Step) -> Generator[Step, Outcome, Outcome]:
        follower.before(step)
        outcome = yield step
        follower.after(step, outcome)
        return outcome

    return each_step(plan, watch)


@dataclass(frozen=True)
class Analysis:
    """Re-analysed `points` of type `point_type`, and the inputs of their computation.

    `settings` are the changed settings by name; `used` and `configuration` contain all settings that were used.
    """

    points: Sequence[Parameters]
    point_type: type[Parameters]
    settings: Mapping[str, object]
    used: Parameters
    configuration: BenchConfiguration


def write_analysis(
    original: Path,
    record: DataFile,
    analysis: Analysis,
    out: Path | None = None,
    companions: Callable[[Path], Sequence[Path]] = lambda _path: (),
) -> Path:
    """Write the results to a new file and return its path.

    Without `out`, the file is `<name>.analysis-<n>.h5` in the original's folder, with the first n for which neither the
    file exists nor one of its `companions`, which the caller writes. Raises InvalidInput if `out` exists or cannot be
    created, and DataFileError if the disk fails.
    """
    digest = file_hash(original)
    for path in [out] if out is not None else _names(original):
        if out is None and any(each.exists() for each in companions(path)):
            continue
        try:
            file = hdf5.create(path)
        except FileExistsError:
            if out is None:
                continue
            raise InvalidInput(
                "--out", str(path), "the file exists and is never overwritten: give another name"
            ) from None
        except OSError as error:
            raise InvalidInput(
                "--out", str(path), f"the file cannot be created ({reason(error)}): choose another folder"
            ) from error
        try:
            with unfinished(path):
                try:
                    _fill(file, original, digest, record, analysis)
                    file.close()
                except BaseException:
                    hdf5.release(file)
                    raise
                whole(path)
        except (OSError, RuntimeError) as error:
            raise DataFileError(f"{path} could not be written ({reason(error)}): check the disk") from error
        return path
    raise AssertionError("unreachable: there is always a free name")


def _names(original: Path) -> Iterator[Path]:
    return (original.with_name(f"{original.stem}.analysis-{number}.h5") for number in count(1))


def _fill(file: hdf5.File, original: Path, digest: str, record: DataFile, analysis: Analysis) -> None:
    file.attrs["NX_class"], file.attrs["default"] = "NXroot", "entry"
    file.attrs["format"], file.attrs["format_version"] = ANALYSIS, ANALYSIS_VERSION
    entry = hdf5.create_group(file, "entry", "NXentry")
    hdf5.write_text(entry, "title", f"re-analysis of {record.title}")
    process = hdf5.create_group(entry, "process", "NXprocess")
    hdf5.write_text(process, "program", "rocking-bench")
    hdf5.write_text(process, "version", software_version())
    hdf5.write_text(process, "date", now(), description="time of the analysis by the wall clock, ISO 8601")
    texts = {
        "settings": (json.dumps(dict(analysis.settings), default=str), "changed settings, by name (JSON)"),
        "used": (analysis.used.model_dump_json(), "all settings of the analysis (JSON)"),
        "configuration": (analysis.configuration.model_dump_json(), "configuration of the bench, as used (JSON)"),
        "software": (json.dumps(software()), "versions of the software on which the numbers depend (JSON)"),
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
