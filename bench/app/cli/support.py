"""Commands for support: `rockbench doctor` and `rockbench file bundle`."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from bench.app.cli.options import CampaignFile, Handed, Json, switch
from bench.app.cli.output import print_result
from bench.progress import silent


def doctor(
    *,
    out: Annotated[
        Path | None,
        Parameter(metavar="DIR", help="Folder of results; its disk is checked.", show_default="the current folder"),
    ] = None,
    server: Annotated[
        str | None,
        Parameter(
            metavar="HOST:PORT", help="Address of a device server; the connection to it is checked.", show_default=False
        ),
    ] = None,
    as_json: Json = False,
    progress: Handed = silent,
) -> int:
    """Check whether this computer can run a bench: versions, clocks, disk, power settings, serial ports and graphics,
    with remedies.

    Nothing is changed and no device is opened. The exit code is 0, 1 if a check is bad, or 2 if an argument is refused.
    """
    progress("checking the computer")
    from bench.app.support.doctor import Health, examine
    from bench.figures.text_table import TextColumn, text_table
    from sim.errors import InvalidInput

    folder = out or Path.cwd()
    if not folder.is_dir():
        raise InvalidInput("--out", str(folder), "the folder does not exist; create it, or specify another folder")
    found = list(examine(folder, server))
    rows = [(each.item, str(each.health), each.found, each.remedy) for each in found]
    bad = any(each.health is Health.BAD for each in found)
    print_result(
        lambda: {
            "good": not bad,
            "checks": [dict(zip(("item", "health", "found", "remedy"), row, strict=True)) for row in rows],
        },
        lambda: text_table([TextColumn(name, words=True) for name in ("check", "health", "found", "remedy")], rows),
        as_json=as_json,
    )
    return 1 if bad else 0


def bundle(
    file: CampaignFile,
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(
            name="--out",
            metavar="FILE",
            help="The new archive; an existing file is never overwritten.",
            show_default="<name>-bundle.zip",
        ),
    ] = None,
    anonymous: Annotated[bool, switch("Remove names of people, notes and paths.")] = False,
    as_json: Json = False,
    progress: Handed = silent,
) -> int:
    """Collect a fault report: log, configuration, versions and latest data of a campaign in one archive.

    The data cover the last minute. If a part of the file cannot be read, the archive states the reason in its place.
    The exit code is 0, or 2 if the data file does not exist or the archive cannot be written.
    """
    progress("collecting the report")
    from bench.app.support.bundle import write_bundle
    from sim.errors import InvalidInput

    if not file.is_file():
        raise InvalidInput("record", str(file), "there is no such file")
    target = out or file.with_name(f"{file.stem}-bundle.zip")
    parts = write_bundle(file, target, anonymous=anonymous)
    print_result(
        lambda: {"file": str(target), "parts": parts}, lambda: f"{target}: {', '.join(parts)}", as_json=as_json
    )
    return 0
