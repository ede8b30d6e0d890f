"""`rockbench export`: a recorded campaign for other programs."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from bench.catalogue import format_names
from bench.cli.interrupt import answer
from bench.cli.progress import Handed
from bench.cli.prose import prose
from bench.cli.refusal import tell, warn
from bench.progress import silent

if TYPE_CHECKING:
    Format = str
else:
    # those that are installed: completion and help name them
    Format = Literal[format_names()]


def export_app() -> App:
    """`rockbench export`."""
    app = App(name="export", help=prose(export), version_flags=())
    app.default(export)
    return app


def export(
    file: Annotated[Path, Parameter(name="FILE", help="File of a campaign (campaign.h5); it is only read.")],
    /,
    *,
    to: Annotated[
        Format,
        Parameter(
            help="MATLAB format 5, text, Universal File Format (dataset 58, binary), Parquet, or an installed one."
        ),
    ],
    out: Annotated[
        Path | None,
        Parameter(
            metavar="DIR", help="New folder for the files.", show_default="<name>-<format> beside the campaign's file"
        ),
    ] = None,
    raw: Annotated[
        bool,
        Parameter(
            negative=(),
            show_default=False,
            help="Counts as converted, with scale and offset beside them, in place of physical values.",
        ),
    ] = False,
    progress: Handed = silent,
) -> int:
    """Write a recorded campaign for other programs: one file per run with every channel and the drive, names and units
    kept, and the tables of results beside them.

    What is no measurement is NaN. Every dataset is held against its checksum; where one fails, that is told, and the
    folder gets a file DAMAGED.txt that names it. The exit code is 0 when everything was written, 1 when the disk
    failed, 2 when something was refused; nothing is left behind then.
    """
    progress("loading the program")
    from bench.export.folder import export as write
    from bench.record.reader import open_record

    out = out or file.with_name(f"{file.stem}-{to}")
    try:
        with open_record(file) as record:
            written, integrity = write(record, file, to, out, raw=raw, progress=progress)
    except OSError as error:
        tell(f"{out} could not be written ({error.strerror or error}): see to the disk")
        return 1
    except KeyboardInterrupt:
        answer("the export was interrupted; nothing was left behind")
        return 130
    if integrity.failing:
        warn(f"{file}: {integrity}")
    size = sum(each.stat().st_size for each in written)
    print(f"{len(written)} files, {size / 1e6:.1f} MB, are in {out}")
    return 0
