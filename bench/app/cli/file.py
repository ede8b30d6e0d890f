"""Commands for data files: `rockbench file info`, `verify` and `recover`, and `rockbench export`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from bench.app.catalogue import format_names
from bench.app.cli.interrupt import interrupted_text, report_interrupt
from bench.app.cli.options import CampaignFile, Handed, Json, switch
from bench.app.cli.output import print_error, print_result, print_warning
from bench.document.typography import counted
from bench.progress import counting, silent

if TYPE_CHECKING:
    Format = str
else:
    # installed formats, for completion and help
    Format = Literal[format_names()]


def info(file: CampaignFile, /, *, as_json: Json = False, progress: Handed = silent) -> int:
    """Describe a data file: how the campaign ended, its channels, runs, points and tables.

    A file that is still being written can be described too. The exit code is 0, or 2 if the file is refused.
    """
    progress("reading the file")
    from bench.datafile.inspection import overview

    content = overview(file)
    print_result(lambda: content, lambda: _text(content), as_json=as_json)
    for problem in content["failing"]:
        print_error(f"{file}: {problem}")
    return 0


def verify(file: CampaignFile, /, *, as_json: Json = False, progress: Handed = silent) -> int:
    """Check the datasets of a data file against their checksums and against the file layout.

    The exit code is 0 if the file is complete and unchanged, 2 if it is damaged or refused.
    """
    progress("loading the program")
    from bench.datafile.inspection import verify as judge

    verdict = judge(file, counting(progress, "verifying the checksums"))
    sound = not verdict.problems
    content = {
        "file": str(file),
        "sound": sound,
        "datasets": verdict.datasets,
        "compared": verdict.compared,
        "problems": verdict.problems,
    }
    if sound or as_json:
        print_result(
            lambda: content,
            lambda: (
                f"{file} is intact: {verdict.compared} of {verdict.datasets} datasets compared with their checksums"
            ),
            as_json=as_json,
            error=None if sound else f"{file}: {verdict.problems[0]}",
            code="damaged_file",
        )
    for problem in verdict.problems:
        print_error(f"{file}: {problem}")
    return 0 if sound else 2


def recover(
    file: CampaignFile,
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(
            name="--out",
            metavar="FILE",
            help="The new file; an existing file is never overwritten.",
            show_default="<name>-recovered.h5",
        ),
    ] = None,
    as_json: Json = False,
    progress: Handed = silent,
) -> int:
    """Rebuild a file after a crash or a full disk, or upgrade one of an older version.

    The original is only read. All readable data are copied to a new file of the current layout with checksums; lost
    events are restored from the journal next to the file, if there is one. The exit code is 0, or 2 if the file is
    refused.
    """
    progress("loading the program")
    from bench.datafile.recovery import recover as rebuild

    found = rebuild(file, out or file.with_name(f"{file.stem}-recovered.h5"), progress)
    content = {
        "file": str(found.target),
        "samples": found.rows,
        "unreadable": found.unreadable,
        "damage": found.damage,
        "lost": found.lost,
        "events_from_journal": found.from_journal,
        "points_from_journal": found.points_from_journal,
    }
    given = f"{counted(found.from_journal, 'event')} and {counted(found.points_from_journal, 'point')} from the journal"
    text = f"{found.target}: {found.rows} samples per channel, {given}"
    print_result(lambda: content, lambda: text, as_json=as_json)
    if as_json:
        return 0
    for each in found.damage:
        print_error(f"damaged in the original and still damaged in the copy: {each}")
    if found.loss:
        print_error(f"lost and omitted: {found.loss}")
    return 0


def export(
    file: CampaignFile,
    /,
    *,
    to: Annotated[
        Format,
        Parameter(
            help="MATLAB format 5, text, Universal File Format (dataset 58, binary), Parquet, or an installed plug-in."
        ),
    ],
    out: Annotated[
        Path | None,
        Parameter(
            metavar="DIR", help="New folder for the files.", show_default="<name>-<format> in the folder of FILE"
        ),
    ] = None,
    raw: Annotated[
        bool,
        switch("Export converter counts with scale and offset instead of physical values."),
    ] = False,
    progress: Handed = silent,
) -> int:
    """Write a recorded campaign for other programs: every channel and the drive, and the tables of results.

    Writes one file per run; names and units are kept, and missing samples are NaN. Datasets are compared with their
    checksums; damaged ones are reported and listed in the file DAMAGED.txt of the folder. The exit code is 0 if
    everything was written, 1 if the disk failed, 2 if an input was refused, 130 after Ctrl-C; no partial files remain.
    """
    progress("loading the program")
    from bench.app.export.format import export as write
    from bench.datafile.reader import open_datafile

    out = out or file.with_name(f"{file.stem}-{to}")
    try:
        with open_datafile(file) as record:
            written, integrity = write(record, file, to, out, raw=raw, progress=progress)
    except OSError as error:
        print_error(f"{out} could not be written ({error.strerror or error}): check the disk")
        return 1
    except KeyboardInterrupt:
        report_interrupt(interrupted_text("the export was interrupted", "no partial files remain"))
        return 130
    if integrity.failing:
        print_warning(f"{file}: {integrity}")
    size = sum(each.stat().st_size for each in written)
    print(f"Files written: {len(written)} ({size / 1e6:.1f} MB) in {out}")
    return 0


def _text(content: dict[str, Any]) -> str:
    """The contents of a campaign or re-analysis file as text, from `bench.datafile.inspection`."""
    heading = f"{content['file']}, {content['bytes'] / 1e6:.1f} MB, format {content['format_version']}"
    if "original" in content:
        return _lines({"file": heading} | _reanalysis(content))
    lines = [_lines({"file": heading} | _campaign(content))]
    lines += [
        f"channel    {each['name']}: {each['quantity']} [{each['unit']}], {each['device']}"
        for each in content["channels"]
    ]
    lines += [f"device     {name}: {said}" for name, said in content["devices"].items()]
    return "\n".join(lines)


def _lines(rows: dict[str, Any]) -> str:
    return "\n".join(f"{name:10} {value}" for name, value in rows.items() if value)


def _campaign(content: dict[str, Any]) -> dict[str, Any]:
    return {
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
        f"; runs: {len(content['runs'])}",
        "points": f"{content['points']}; events: {content['events']}",
        "tables": ", ".join(f"{name} (rows: {rows})" for name, rows in content["tables"].items()),
        "checksums": _checksums(content),
        "recovered": "; ".join(content["recovered"]),
    }


def _reanalysis(content: dict[str, Any]) -> dict[str, Any]:
    of = content["original"]
    return {
        "analysis": content["title"],
        "software": content["software"],
        "date": content["date"],
        "original": f"{of['file']}, {content['original_is']}; SHA-256 {of['sha256']}",
        "settings": ", ".join(f"{name} = {value}" for name, value in content["settings"].items()),
        "points": content["points"],
        "checksums": _checksums(content),
    }


def _checksums(content: dict[str, Any]) -> str:
    if not content["checksums"]:
        return "none"
    left = content.get("unchecked", 0)
    wrong = f"differing: {len(content['failing'])}" if content["failing"] else "those verified are intact"
    rest = f"; {left} not verified, see `rockbench file verify`" if left else ""
    return f"datasets: {content['checksums']}; {wrong}{rest}"
