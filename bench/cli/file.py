"""`rockbench file`: what a data file holds, whether it is whole, and a clean file from one that is not."""

import json
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter

from bench.cli.refusal import tell

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


def info(file: _File, /, *, as_json: _Json = False) -> int:
    """Say what a data file holds: how the campaign ended, its channels, runs, points and tables.

    A file that is being written can be looked into as well. The exit code is 0, or 2 when the file is refused.
    """
    from bench.record.overview import overview

    content = overview(file)
    print(json.dumps(content, allow_nan=False) if as_json else _text(content))
    return 0


def verify(file: _File, /, *, as_json: _Json = False) -> int:
    """Read a whole data file and hold every dataset against its checksum and the layout.

    The exit code is 0 when the file is complete and as it was written, 2 when it is not or is refused.
    """
    from bench.record.verification import verify as judge

    verdict = judge(file)
    sound = not verdict.problems
    if as_json:
        content = {"file": str(file), "sound": sound, "datasets": verdict.datasets, "compared": verdict.compared}
        print(json.dumps(content | {"problems": verdict.problems}))
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
) -> int:
    """Make a clean file from one whose writer died, whose disk was full, or that an older version wrote.

    The original is only read. What was whole and can be read is kept, in today's layout and with checksums; events
    that it lost come from the journal beside it. The exit code is 0, or 2 when the file is refused.
    """
    from bench.record.recovery import recover as rebuild

    found = rebuild(file, out or file.with_name(f"{file.stem}-recovered.h5"))
    if as_json:
        told = {"file": str(found.target), "samples": found.rows, "unreadable": found.unreadable}
        told |= {"damage": list(found.damage)}
        print(json.dumps(told | {"events_from_journal": found.from_journal}))
        return 0
    print(f"{found.target}: {found.rows} samples per channel, {found.from_journal} events from the journal")
    for each in found.damage:
        tell(f"damaged in the original, and not mended by the copy: {each}")
    if found.unreadable:
        tell(f"{found.unreadable} samples per channel could not be read and are left out")
    return 0


def _text(content: dict[str, Any]) -> str:
    rows = {
        "file": f"{content['file']}, {content['bytes'] / 1e6:.1f} MB, format {content['format_version']}",
        "campaign": content["title"],
        "protocol": content["protocol"],
        "software": " ".join(filter(None, (content["software"], content["git"]))),
        "status": ": ".join(filter(None, (content["status"], content["summary"]))),
        "time": f"{content['start_time']} to {content['end_time'] or '?'}",
        "operator": content["operator"],
        "notes": content["notes"],
        "seed": content["seed"],
        "plan": content["plan_hash"],
        "samples": f"{content['samples']} at {content['sample_rate']:g} samples/s: {content['duration']:.1f} s"
        f" in {len(content['runs'])} runs",
        "points": f"{content['points']}; {content['events']} events",
        "tables": ", ".join(f"{name} ({rows} rows)" for name, rows in content["tables"].items()),
        "recovered": "; ".join(content["recovered"]),
    }
    lines = [f"{name:10} {value}" for name, value in rows.items() if value]
    lines += [
        f"channel    {each['name']}: {each['quantity']} [{each['unit']}], {each['device']}"
        for each in content["channels"]
    ]
    lines += [f"device     {name}: {said}" for name, said in content["devices"].items()]
    return "\n".join(lines)
