"""`rockbench paper`: the paper from simulation alone, with its statements checked."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Parameter

from bench.cli.progress import Handed
from bench.cli.prose import prose
from bench.cli.report import HTML, OVERWRITE, PDF, check_outputs, written
from bench.progress import silent

BAND = "1.5:25"
"""Band [Hz] of the table that the records are limited to, beside the whole ones: that of a seismic campaign."""

Part = Literal["statements", "modes", "map", "histories", "spectra", "records", "seismic"]


def paper_app() -> App:
    """`rockbench paper`, a command of its own."""
    app = App(name="paper", help=prose(paper), version_flags=())
    app.default(paper)
    return app


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
            help="Band of the table [Hz] in which the records are predicted beside the whole ones.",
        ),
    ] = BAND,
    only: Annotated[
        tuple[Part, ...],
        Parameter(
            name="--only", consume_multiple=True, negative=(), help="Parts of the report.", show_default="all of them"
        ),
    ] = (),
    specimen: Annotated[
        Path | None,
        Parameter(
            name="--specimen",
            metavar="FILE",
            help="Specimen: TOML with keys as in [specimen] of a configuration, or a specimen file (.json).",
            show_default="the paper's specimen",
        ),
    ] = None,
    overwrite: OVERWRITE = False,
    progress: Handed = silent,
) -> int:
    """Reproduce the paper from simulation alone, statement by statement.

    Makes the figures of the paper (Fig. 3 to 9) and checks its eight statements, with numbers. Without --html and
    --pdf: paper.html in the present folder. Prints the verdicts. The exit code is 0 when the report was made, whatever
    the verdicts are, 1 when it could not be written, 2 when something was refused before. Files that exist are kept
    unless --overwrite is given.
    """
    progress("loading the program")
    from bench.cli.paper_inputs import named_records
    from bench.cli.predict_inputs import specimen_from, warn_of_unusual
    from bench.cli.predict_records import records_from
    from bench.config.model import BenchConfiguration
    from bench.prediction.requests import SpectrumRequest
    from bench.prediction.seismic import band_of
    from bench.publication.paper import PARTS, PaperRequest, paper_report

    if html is None and pdf is None:
        html = Path("paper.html")
    check_outputs(html, pdf, overwrite=overwrite)
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
    return written(document, html, pdf, overwrite=overwrite, progress=progress)
