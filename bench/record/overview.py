"""What a file holds, in numbers and words that are ready for JSON."""

import json
from pathlib import Path
from typing import Any

from bench.record import diary, hdf5, reanalysis
from bench.record.errors import UNREADABLE, RecordError, reason
from bench.record.opening import ANALYSIS, FORMAT, open_file
from bench.record.reader import Record


def overview(path: Path) -> dict[str, Any]:
    """Read the headings of a file; of the samples only how many there are.

    Raises InvalidInput for what is no record of ours, RecordError for one that cannot be read.
    """
    with open_file(path, kinds=(FORMAT, ANALYSIS)) as file:
        try:
            heading = {"file": str(path), "bytes": path.stat().st_size, "kind": hdf5.attribute(file, "format")}
            if heading["kind"] == ANALYSIS:
                return heading | reanalysis.overview(file, path)
            return heading | _content(Record(file)) | {"journal": _journal(path)}
        except UNREADABLE as error:
            raise RecordError(
                f"{path} is damaged ({reason(error)}): `rockbench file recover` keeps the rest"
            ) from error


def _content(record: Record) -> dict[str, object]:
    metadata, rows, judged = record.metadata, record.rows, record.integrity()
    given = {name: metadata.get(name) for name in ("protocol", "operator", "notes", "seed", "git", "plan_hash")}
    return {
        "format_version": record.format_version,
        "title": record.title,
        "software": record.software,
        "status": record.status,
        "summary": record.summary,
        "start_time": record.start_time,
        "end_time": record.end_time or None,
        **given,
        "devices": json.loads(metadata.get("devices", "{}")),
        "sample_rate": record.sample_rate,
        "samples": rows,
        "duration": rows / record.sample_rate,
        "channels": [
            {"name": each.name, "quantity": each.quantity, "unit": each.unit, "device": each.device}
            for each in record.channels
        ],
        "runs": [{"number": run.number, "samples": len(run.rows)} for run in record.runs],
        "points": len(record.points),
        "events": record.counted["events"],
        "tables": {name: len(next(iter(table.values())).values) for name, table in record.tables.items() if table},
        "checksums": len(record.checksums),
        "failing": list(judged.failing.values()),
        "unchecked": len(judged.unchecked),
        "recovered": record.recoveries,
    }


def _journal(path: Path) -> str | None:
    beside = diary.beside(path)
    return str(beside) if beside.is_file() else None
