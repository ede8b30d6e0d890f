"""`rockbench file`: what a data file holds, whether it is whole, and a clean file from one that is not."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from bench.cli.file_text import text_of
from bench.cli.progress import Handed
from bench.cli.refusal import error_object, tell
from bench.progress import counting, silent

_File = Annotated[Path, Parameter(metavar="FILE", help="Data file of a campaign.")]
_Json = Annotated[
    bool, Parameter(name="--json", negative=(), show_default=False, help="Print one JSON object on standard output.")
]


def file_app() -> App:
    """`rockbench file`."""
    app = App(name="file", help="Look into data files, verify and recover them.", version_flags=())
    app.command(info)
    app.command(verify)
    app.command(recover)
    return app


def info(file: _File, /, *, as_json: _Json = False, progress: Handed = silent) -> int:
    """Say what a data file holds: how the campaign ended, its channels, runs, points and tables.

    A file that is being written can be looked into as well. The exit code is 0, or 2 when the file is refused.
    """
    progress("reading the file")
    from bench.record.overview import overview

    content = overview(file)
    print(json.dumps(content, allow_nan=False) if as_json else text_of(content))
    for problem in content["failing"]:
        tell(f"{file}: {problem}")
    return 0


def verify(file: _File, /, *, as_json: _Json = False, progress: Handed = silent) -> int:
    """Read a whole data file and hold every dataset against its checksum and the layout.

    The exit code is 0 when the file is complete and as it was written, 2 when it is not or is refused.
    """
    progress("loading the program")
    from bench.record.verification import verify as judge

    verdict = judge(file, counting(progress, "comparing the file with its checksums"))
    sound = not verdict.problems
    if as_json:
        content = {"file": str(file), "sound": sound, "datasets": verdict.datasets, "compared": verdict.compared}
        damaged = {} if sound else {"error": error_object(f"{file}: {verdict.problems[0]}", "damaged_file")}
        print(json.dumps(content | {"problems": verdict.problems} | damaged))
    elif sound:
        print(f"{file} is sound: {verdict.compared} of {verdict.datasets} datasets held against their checksums")
    for problem in verdict.problems:
        tell(f"{file}: {problem}")
    return 0 if sound else 2


def recover(
    file: _File,
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(
            name="--out", metavar="FILE", help="The new file; never overwritten.", show_default="<name>-recovered.h5"
        ),
    ] = None,
    as_json: _Json = False,
    progress: Handed = silent,
) -> int:
    """Make a clean file from one whose writer died, whose disk was full, or that an older version wrote.

    The original is only read. What was whole and can be read is kept, in today's layout and with checksums; events
    that it lost come from the journal beside it. The exit code is 0, or 2 when the file is refused.
    """
    progress("loading the program")
    from bench.record.recovery import recover as rebuild

    found = rebuild(file, out or file.with_name(f"{file.stem}-recovered.h5"), progress)
    if as_json:
        told = {"file": str(found.target), "samples": found.rows, "unreadable": found.unreadable}
        told |= {"damage": list(found.damage), "lost": dict(found.lost)}
        told |= {"events_from_journal": found.from_journal, "points_from_journal": found.points_from_journal}
        print(json.dumps(told))
        return 0
    given = f"{found.from_journal} events and {found.points_from_journal} points from the journal"
    print(f"{found.target}: {found.rows} samples per channel, {given}")
    for each in found.damage:
        tell(f"damaged in the original, and not mended by the copy: {each}")
    if found.loss:
        tell(f"lost, and left out: {found.loss}")
    return 0
