"""`rockbench records`: earthquake records, read and measured."""

import json
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter

from bench.cli.predict_options import ResultOptions
from bench.cli.progress import Handed
from bench.cli.records_fit import register_fit
from bench.cli.refusal import fail
from bench.progress import silent
from sim.errors import InvalidInput, RockbenchError

MOST_DRAWN = 8
"""Records that one figure can show."""


def records_app() -> App:
    """`rockbench records`."""
    app = App(
        name="records",
        help="Read earthquake records: what they are, what they hold, and how they fit the table.",
        version_flags=(),
    )
    app.command(info)
    register_fit(app)
    return app


def info(
    *files: Annotated[
        str,
        Parameter(
            name="FILE",
            metavar="FILE",
            help="A record: FILE, FILE@KEY=VALUE,... with the keys unit, dt, channel, column, name; or "
            "synthetic:NAME[:SEED].",
        ),
    ],
    dt: Annotated[
        str | None, Parameter(metavar="SECONDS", help="Time step of files that do not state it.", show_default=False)
    ] = None,
    unit: Annotated[
        str | None, Parameter(metavar="UNIT", help="Unit of files that do not state it.", show_default=False)
    ] = None,
    channel: Annotated[
        str | None, Parameter(metavar="CHANNEL", help="Channel, by number or name, of files that have several.")
    ] = None,
    column: Annotated[
        str | None, Parameter(metavar="COLUMN", help="Column, from 1 or by heading, of plain columns.")
    ] = None,
    plot: Annotated[
        Path | None,
        Parameter(metavar="FILE", help="Draw histories and response spectra: .png (200 dpi), .pdf or .svg."),
    ] = None,
    as_json: Annotated[
        bool, Parameter(name="--json", negative=(), show_default=False, help="Print one JSON object.")
    ] = False,
    progress: Handed = silent,
) -> int:
    """Say what earthquake records are and measure them: peaks, Arias intensity, significant duration, hash.

    The format is recognised by what a file holds. Unit and time step are the file's own or must be given; those that
    contradict the file are refused, and so is a file that is not a whole acceleration record. The exit code is 0 when
    every record was read, 1 when a figure could not be written, 2 when something was refused. Files that exist are
    never overwritten.
    """
    progress("reading the records")
    from bench.accelerograms.reference import GRAMMAR, RecordReference, read_records, seconds_of
    from bench.cli.records_output import content_of, figure_of, text_of

    if not files:
        raise InvalidInput("FILE", None, f"give one record or more: {GRAMMAR}")
    references = [RecordReference.parse(text) for text in files]
    if plot is not None:
        _check_plot(plot, len(references))
    defaults: dict[str, Any] = {
        "dt": None if dt is None else seconds_of("--dt", dt),
        "unit": unit,
        "channel": channel,
        "column": column,
    }
    records = read_records([reference.or_else(**defaults) for reference in references])
    try:
        if plot is not None:
            from bench.report.style import write_figure

            write_figure(plot, figure_of(records))
    except InvalidInput:
        raise
    except (RockbenchError, OSError) as error:
        fail(error)
        return 1
    if as_json:
        from bench.provenance import software

        content = {"records": [content_of(record) for record in records], "software": software()}
        print(json.dumps(content, allow_nan=False))
    else:
        print("\n\n".join(text_of(record) for record in records))
    return 0


def _check_plot(plot: Path, count: int) -> None:
    from bench.cli.predict_output import check_files

    check_files(ResultOptions(plot=plot))
    if count > MOST_DRAWN:
        raise InvalidInput("--plot", f"{count} records", f"at most {MOST_DRAWN} fit in a figure; give fewer")
