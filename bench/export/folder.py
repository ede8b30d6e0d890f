"""A whole export: a new folder, complete or not there at all."""

from pathlib import Path
from uuid import uuid4

from bench.catalogue import load_format
from bench.export.content import content_of
from bench.progress import Progress, counting, silent
from bench.record.integrity import Integrity
from bench.record.reader import Record
from bench.unfinished import unfinished
from sim.errors import InvalidInput
from sim.extras import require

DAMAGED = "DAMAGED.txt"
"""File that travels with an export of what failed its checksum."""


def export(
    record: Record, path: Path, to: str, out: Path, *, raw: bool = False, progress: Progress = silent
) -> tuple[list[Path], Integrity]:
    """Write an open file, read from `path`, into the new folder `out`; returns the files that are in it then, and
    whether the record is as it was written. What is not stands in the file DAMAGED.txt beside the others.

    Physical values are float64; with `raw` the counts are written with the way to values beside them. Raises
    InvalidInput for a format that is not installed or cannot hold what there is, and when `out` exists or cannot be
    made; MissingExtra without the format's library.
    """
    wanted = load_format(to)
    if wanted.library:
        require("export", f"--to {to}", wanted.library)
    if out.exists():
        raise InvalidInput("--out", str(out), "it exists, and nothing is ever overwritten; name another folder")
    integrity = record.integrity(None, counting(progress, "comparing the file with its checksums"))
    progress("writing the files of the export")
    content = content_of(record, path, raw=raw)
    wanted.check(content)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        temporary = out.with_name(f".{out.name}-{uuid4().hex[:8]}")
        temporary.mkdir()
    except OSError as error:
        raise InvalidInput("--out", str(out), f"the folder cannot be made: {error.strerror}") from None
    with unfinished(temporary):
        wanted.write(content, temporary)
        if integrity.failing:
            lines = (f"{path.name} is damaged or was changed since it was written:", *integrity.failing.values())
            (temporary / DAMAGED).write_text("\n".join(lines) + "\n", encoding="utf-8")
        temporary.rename(out)
    return sorted(out.iterdir()), integrity
