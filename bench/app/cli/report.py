"""Reports as HTML and PDF: `rockbench report` on a campaign, and `rockbench paper` from simulation alone."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from bench.app.cli.options import CampaignFile, Handed, switch
from bench.app.cli.output import print_error, print_warning
from bench.progress import Progress, silent
from sim.errors import InvalidInput, RockbenchError
from sim.extras import require

if TYPE_CHECKING:
    from bench.document.document import Document

HTML = Annotated[Path | None, Parameter(name="--html", metavar="OUT", help="Write the report as one HTML file.")]
PDF = Annotated[Path | None, Parameter(name="--pdf", metavar="OUT", help="Write the report as a PDF in A4 format.")]
OVERWRITE = Annotated[
    bool,
    switch("Replace existing files."),
]

BAND = "1.5:25"
"""Default band of the table [Hz] for additional band-limited records: the band of a seismic campaign."""

Part = Literal["statements", "modes", "map", "histories", "spectra", "records", "seismic"]


def report(
    file: CampaignFile,
    /,
    *,
    html: HTML = None,
    pdf: PDF = None,
    overwrite: OVERWRITE = False,
    progress: Handed = silent,
) -> int:
    """Create a report of a campaign from its data file.

    The report is one self-contained document with the test and the specimen, figures and tables with uncertainties,
    a comparison with the prediction if there is one, limits, warnings, and provenance. The datasets are compared with
    their checksums first; damaged ones are listed at the top of the report. Without --html and --pdf, the report is
    written as HTML next to FILE, with the extension .report.html. The exit code is 0 if it was written, 1 if it could
    not be written, 2 if an input was refused. Existing files are kept unless --overwrite is given.
    """
    progress("loading the program")
    from bench.app.catalogue import installed_protocol
    from bench.app.reports.report import campaign_report
    from bench.datafile.reader import open_datafile
    from bench.document.campaign import Campaign

    if html is None and pdf is None:
        html = file.with_suffix(".report.html")
    _check_outputs(html, pdf, overwrite=overwrite, source=file)
    with open_datafile(file) as record:
        protocol = installed_protocol(record)
        campaign = Campaign(file, record, None if protocol is None else protocol.parameters)
        document = campaign_report(campaign, protocol, progress)
        integrity = campaign.integrity
    if integrity.failing:
        print_warning(f"{file}: {integrity}")
    return _deliver(document, html, pdf, overwrite=overwrite, progress=progress)


def paper(
    *,
    html: HTML = None,
    pdf: PDF = None,
    records: Annotated[
        tuple[str, ...],
        Parameter(
            name="--records",
            metavar="RECORD...",
            consume_multiple=True,
            negative=(),
            help="Earthquake records: files, FILE@KEY=VALUE,..., synthetic:NAME[:SEED], or a folder of files.",
            show_default="the seven synthetic ones",
        ),
    ] = (),
    table_band: Annotated[
        str,
        Parameter(
            name="--table-band",
            metavar="LOW:HIGH",
            help="Band of the table [Hz] for additional predictions of band-limited records.",
        ),
    ] = BAND,
    only: Annotated[
        tuple[Part, ...],
        Parameter(
            name="--only",
            consume_multiple=True,
            negative=(),
            help="Parts to include in the report.",
            show_default="all of them",
        ),
    ] = (),
    specimen: Annotated[
        Path | None,
        Parameter(
            name="--specimen",
            metavar="FILE",
            help="Specimen: TOML with keys as in the table [specimen] of a configuration, or a specimen file (.json).",
            show_default="the paper's specimen",
        ),
    ] = None,
    overwrite: OVERWRITE = False,
    progress: Handed = silent,
) -> int:
    """Reproduce the paper from simulation alone, statement by statement.

    Draws the figures of the paper (Figs. 3 to 9), checks its eight statements numerically, and prints the verdicts.
    Without --html and --pdf, the report is written as paper.html in the current folder. The exit code is 0 if the
    report was written, whatever the verdicts, 1 if it could not be written, 2 if an input was refused. Existing files
    are kept unless --overwrite is given.
    """
    progress("loading the program")
    from bench.app.cli.inputs import named_records, records_from, specimen_from, warn_of_unusual
    from bench.app.reports.paper import PARTS, PaperRequest, paper_report
    from bench.config.model import BenchConfiguration
    from bench.prediction.requests import SpectrumRequest
    from bench.prediction.seismic import band_of

    if html is None and pdf is None:
        html = Path("paper.html")
    _check_outputs(html, pdf, overwrite=overwrite)
    band_of(table_band, BenchConfiguration())
    request = PaperRequest(
        specimen=specimen_from(specimen, None, None),
        records=records_from(named_records(records)),
        band=table_band,
        parts=only or PARTS,
    )
    warn_of_unusual(SpectrumRequest(), request.specimen)
    document, named = paper_report(request, progress)
    for number, statement in named:
        print(f"statement {number}: {statement.title}: {statement.verdict}")
    return _deliver(document, html, pdf, overwrite=overwrite, progress=progress)


def _check_outputs(html: Path | None, pdf: Path | None, *, overwrite: bool, source: Path | None = None) -> None:
    """Check that the output files can be written, that none is the data file `source` and, for PDF, that the typesetter
    is installed. Raises InvalidInput.
    """
    if pdf is not None:
        require("pdf", "--pdf")
    for item, path in (("--html", html), ("--pdf", pdf)):
        if path is None:
            continue
        if path.is_dir():
            raise InvalidInput(item, str(path), "it is a folder; specify a file in it")
        if source is not None and path.exists() and source.exists() and path.samefile(source):
            raise InvalidInput(item, str(path), "it is the data file itself; choose another name")
        if path.exists() and not overwrite:
            raise InvalidInput(item, str(path), "the file exists; choose another name, or use --overwrite")
        if not path.parent.is_dir():
            raise InvalidInput(item, str(path), "the folder does not exist; create it first")
    if html is not None and pdf is not None and html.resolve() == pdf.resolve():
        raise InvalidInput("--pdf", str(pdf), "--html would write the same file; choose another name")


def _deliver(
    document: "Document", html: Path | None, pdf: Path | None, *, overwrite: bool, progress: Progress = silent
) -> int:
    """Write a report in the requested formats; returns 0, or 1 with an error line on standard error."""
    from bench.document.rendering import html_page, write_pdf
    from bench.unfinished import write_new

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
        print_error(error)
        return 1
    for path in (html, pdf):
        if path is not None:
            print(f"report: {path}", file=sys.stdout)
    return 0


def _write(path: Path, content: bytes) -> None:
    path.write_bytes(content)
