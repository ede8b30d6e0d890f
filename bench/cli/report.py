"""`rockbench report FILE`: a page about a campaign that a researcher can attach to a paper."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from bench.cli.progress import Handed
from bench.cli.prose import prose
from bench.cli.refusal import tell, warn
from bench.progress import Progress, silent
from sim.errors import InvalidInput, RockbenchError
from sim.extras import require

if TYPE_CHECKING:
    from bench.report.page.document import Document

HTML = Annotated[Path | None, Parameter(name="--html", metavar="OUT", help="Write the report as one HTML file.")]
PDF = Annotated[Path | None, Parameter(name="--pdf", metavar="OUT", help="Write the report as PDF, A4.")]
OVERWRITE = Annotated[
    bool,
    Parameter(name="--overwrite", negative=(), show_default=False, help="Replace files that are there already."),
]


def report_app() -> App:
    """`rockbench report`, a command of its own."""
    app = App(name="report", help=prose(report), version_flags=())
    app.default(report)
    return app


def report(
    file: Annotated[Path, Parameter(metavar="FILE", help="Data file of a campaign (campaign.h5).")],
    /,
    *,
    html: HTML = None,
    pdf: PDF = None,
    overwrite: OVERWRITE = False,
    progress: Handed = silent,
) -> int:
    """Make a report of a campaign from its data file.

    One self-contained page: what was tested on what, figures like the paper's Fig. 3 to 9 from this file's data, tables
    with uncertainties, measured against predicted, limits and warnings, provenance. Every dataset is held against its
    checksum first; the report begins with what fails. Without --html and --pdf: HTML beside FILE, with the ending
    .report.html. The exit code is 0 when it was made, 1 when it could not be written, 2
    when something was refused before. Files that exist are kept unless --overwrite is given.
    """
    progress("loading the program")
    from bench.cli.recorded import installed_protocol
    from bench.publication.campaign import Campaign
    from bench.publication.report import campaign_report
    from bench.record.reader import open_record

    if html is None and pdf is None:
        html = file.with_suffix(".report.html")
    check_outputs(html, pdf, overwrite=overwrite)
    with open_record(file) as record:
        campaign = Campaign(file, record, installed_protocol(record))
        document = campaign_report(campaign, progress)
        integrity = campaign.integrity
    if integrity.failing:
        warn(f"{file}: {integrity}")
    return written(document, html, pdf, overwrite=overwrite, progress=progress)


def check_outputs(html: Path | None, pdf: Path | None, *, overwrite: bool) -> None:
    """Refuse places where nothing can be written, and a PDF without its typesetter. Raises InvalidInput."""
    if pdf is not None:
        require("pdf", "--pdf")
    for item, path in (("--html", html), ("--pdf", pdf)):
        if path is None:
            continue
        if path.is_dir():
            raise InvalidInput(item, str(path), "it is a folder; name a file in it")
        if path.exists() and not overwrite:
            raise InvalidInput(item, str(path), "it exists; name another, or give --overwrite")
        if not path.parent.is_dir():
            raise InvalidInput(item, str(path), "its folder does not exist; create it first")
    if html is not None and pdf is not None and html.resolve() == pdf.resolve():
        raise InvalidInput("--pdf", str(pdf), "--html goes there already; name another")


def written(
    document: "Document", html: Path | None, pdf: Path | None, *, overwrite: bool, progress: Progress = silent
) -> int:
    """Write a report in the forms that are asked for; returns 0, or 1 with a line on standard error."""
    from bench.report.files import write_new
    from bench.report.page.html import html_page
    from bench.report.page.pdf import write_pdf

    progress("writing the report")
    try:
        if html is not None:
            text = html_page(document).encode("utf-8")
            write_new(html, lambda unfinished: _write(unfinished, text), overwrite=overwrite)
        if pdf is not None:
            write_new(pdf, lambda unfinished: write_pdf(unfinished, document), overwrite=overwrite)
    except InvalidInput:
        raise
    except (RockbenchError, OSError) as error:
        tell(error)
        return 1
    for path in (html, pdf):
        if path is not None:
            print(f"report: {path}", file=sys.stdout)
    return 0


def _write(path: Path, content: bytes) -> None:
    path.write_bytes(content)
