"""The paper reproduced from simulation alone: its figures, and its eight statements checked one by one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from bench.accelerograms.accelerogram import Accelerogram
from bench.app.reports.provenance import NAME, facts_table, libraries, program, provenance_line
from bench.app.reports.records import drift_picture, gains_picture, motions_table, record_pictures
from bench.app.reports.specimen import modes_section, specimen_section
from bench.config.model import BenchConfiguration
from bench.datafile.tables import arrays
from bench.document.campaign import AMPLITUDE_FACTOR
from bench.document.document import Column, Document, Notice, Part, Picture, Section, Table
from bench.document.gain_map import map_section
from bench.figures.history_figure import Motion, history_figure
from bench.figures.spectra_figure import gain_spectra
from bench.prediction.history import histories
from bench.prediction.requests import HistoryRequest, SeismicRequest, SpectrumRequest
from bench.prediction.seismic import SeismicCurve, seismic_curves
from bench.prediction.statements import POINTS, POINTS_BETA, SECTIONS, Statement, harmonic_statements, seismic_statement
from bench.prediction.steady import predict_spectra, steady_table
from bench.progress import Progress, silent
from bench.provenance import revision, software
from sim.loading import load_model
from sim.specimen import Specimen

Named = tuple[str, Statement]
"""Number of a statement of the paper, as text, and the statement."""


def verdicts_table(named: Sequence[Named]) -> Table:
    """Table of verdicts, one row per statement."""
    columns = [Column("statement", words=True), Column("subject", words=True), Column("verdict", words=True)]
    rows = [[number, each.title, str(each.verdict)] for number, each in named]
    caption = 'Verdicts; "as expected" marks a known and documented deviation of the model from the paper'
    return Table(caption, columns, rows)


def statement_table(named: Sequence[Named]) -> Table:
    """Table of all claims with the model's results."""
    columns = [
        Column("statement", words=True),
        Column("claim", words=True),
        Column("found", words=True),
        Column("verdict", words=True),
    ]
    rows = [[number, check.claim, check.found, str(check.verdict)] for number, each in named for check in each.checks]
    return Table("The claims behind the verdicts, and the model's results", columns, rows)


PARTS = ("statements", "modes", "map", "histories", "spectra", "records", "seismic")
"""Parts of the report that may be requested."""

MODES_BETAS = (0.25, 0.40, 0.64, 0.97)


@dataclass(frozen=True, eq=False)
class PaperRequest:
    """Requested `parts` of the report, the specimen (the paper's or another) and the earthquake records. `band` is the
    band of the table [Hz] as LOW:HIGH; gains are predicted for unfiltered records and for records limited to the band.
    """

    specimen: Specimen
    records: Sequence[Accelerogram]
    band: str
    parts: Sequence[str] = PARTS


class _Paper:
    """Computes the requested parts; shared results are computed once."""

    def __init__(self, request: PaperRequest, progress: Progress) -> None:
        self._request, self._specimen = request, request.specimen
        self._amplitude = AMPLITUDE_FACTOR * request.specimen.uplift_acceleration
        self.named: list[Named] = []
        self._curves: dict[str, list[SeismicCurve]] = {}
        if {"seismic", "statements"} & {*request.parts}:
            for words, band in (("as recorded", "none"), (f"within {self._band}", request.band)):
                asked = SeismicRequest(table_band=band)

                def under(phase: str, done: int = 0, total: int = 0, /, words: str = words) -> None:
                    progress(f"{phase}, {words}", done, total)

                self._curves[words] = seismic_curves(
                    self._specimen, request.records, asked, BenchConfiguration(), progress=under
                )

    @property
    def _band(self) -> str:
        return f"{self._request.band.replace(':', ' to ')} Hz"

    def statements(self) -> Section:
        found = harmonic_statements(self._specimen, self._amplitude)
        seismic = {words: seismic_statement(curves) for words, curves in self._curves.items()}
        self.named = [(str(each.number), each) for each in found]
        self.named += [(f"8, records {words}", each) for words, each in seismic.items()]
        parts: list[Part] = [
            "Each statement of the paper is expressed as falsifiable claims with tolerances, and checked with "
            "the model: periodic orbits under a sine, motions from rest under records. The numbers are the "
            "model's for the nominal specimen and are exact to the digits shown.",
            verdicts_table(self.named),
        ]
        return Section("statements", "The eight statements of the paper", [*parts, statement_table(self.named)])

    def modes(self) -> Section:
        return modes_section(self._specimen, MODES_BETAS)

    def map(self) -> Section:
        return map_section(self._specimen, AMPLITUDE_FACTOR)

    def histories(self) -> Section:
        asked = HistoryRequest(
            omega=tuple(POINTS.values()), beta=(POINTS_BETA,), amplitude_factor=AMPLITUDE_FACTOR, steady=True
        )
        made = [each for each in histories(self._specimen, asked) if each.motion == "rocking"]
        text = (
            "The steady rocking motions at the points A, B and C of the paper's Fig. 4(b). From rest, with the sine "
            "switched on, the block may topple although such a motion exists and is stable."
        )
        picture = Picture(
            history_figure([Motion(each.omega, each.beta, each.motion, each.status, each.values) for each in made]),
            f"Steady motions at {', '.join(POINTS)}: drift of the coupled and the bare frame, u₁ and ϑ "
            "(predicted). ϑ is positive when the top of the block moves towards the frame, u₁ when the storey "
            "moves towards the block.",
            "Curves of drift, first storey displacement and rocking angle over three periods of the drive.",
        )
        return Section("histories", "Time histories at A, B and C (as in Fig. 5 of the paper)", [text, picture])

    def spectra(self) -> Section:
        asked = SpectrumRequest(beta=SECTIONS, amplitude_factor=AMPLITUDE_FACTOR)
        columns = arrays(steady_table(predict_spectra(self._specimen, asked)))
        figure = gain_spectra([], {**columns, "omega": columns["omega_rad_s"]})
        return Section(
            "spectra",
            "Gain spectra (as in Fig. 6 of the paper)",
            [
                "Sections S1, S2 and S3 of the map, with the stability of the motions. The paper's experiments are "
                "not drawn because their values are not published.",
                Picture(
                    figure,
                    "Gain spectra at β = 0.25, 0.64 and 0.97 (predicted).",
                    "Gain of the peak drift (logarithmic) against frequency, one panel per stiffness ratio.",
                ),
            ],
        )

    def records(self) -> Section:
        parts: list[Part] = [*_of_what(self._request.records), *record_pictures(self._request.records)]
        return Section("records", "Records (as in Fig. 7 of the paper)", parts)

    def seismic(self) -> Section:
        peak = 1.2 * self._specimen.uplift_acceleration
        parts: list[Part] = [
            *_of_what(self._request.records),
            f"Every record is scaled to a peak of {peak:.4g} m/s² (1.2 g/λ), without a change of its time scale, both "
            f"unfiltered and limited to the band of the table, {self._band}. Motions start from rest; a block that "
            "topples has no gain. Statement 8 is checked on both.",
        ]
        parts.append(motions_table([curve for curves in self._curves.values() for curve in curves]))
        for words, curves in self._curves.items():
            parts.append(gains_picture(curves, words))
        softest = drift_picture(self._specimen, next(reversed(self._curves.values())), SECTIONS[0])
        return Section("seismic", "Gain curves under records (as in Figs. 8 and 9 of the paper)", [*parts, softest])


def paper_report(request: PaperRequest, progress: Progress = silent) -> tuple[Document, list[Named]]:
    """The report, and the statements if requested. Raises InvalidInput for a record that cannot be prepared, and
    RockbenchError if no motion is found.
    """
    load_model(progress)
    paper = _Paper(request, progress)
    builders: Mapping[str, Callable[[], Section]] = {name: getattr(paper, name) for name in PARTS}
    asked = [name for name in PARTS if name in request.parts]
    sections: list[Section] = []
    for name in asked:
        progress("computing and drawing the parts of the report", len(sections), len(asked))
        sections.append(builders[name]())
    sections.append(specimen_section(request.specimen, None))
    sections.append(_provenance(request))
    summary: list[Part] = [
        "The figures and statements of the paper on the rigid block coupled with a 2 d.o.f. system, "
        "recomputed from the equations of motion by one command, without a bench. Frame, block and springs "
        f"are those of Tables 1 to 3 unless stated otherwise; the sine has an amplitude of {AMPLITUDE_FACTOR:g} "
        "g/λ (Eq. 11)."
    ]
    return Document("The paper reproduced by simulation", summary, sections, provenance_line()), paper.named


def _of_what(records: Sequence[Accelerogram]) -> list[Part]:
    if all(record.synthetic for record in records):
        text = (
            "The ground motions are SYNTHETIC, not measured: they have the main characteristics of the paper's "
            "seven records (peak, duration, band, pulse). Their gains are not those of the actual records, which "
            "require the record files."
        )
        return [Notice(text)]
    made = [record.name for record in records if record.synthetic]
    return [Notice(f"Synthetic, not measured: {', '.join(made)}.")] if made else []


def _provenance(request: PaperRequest) -> Section:
    made = software()
    software_table = facts_table("Software", {"made by": program(made[NAME], revision()), "libraries": libraries(made)})
    columns = [Column("record", words=True), Column("source", words=True), Column("SHA-256", words=True)]
    rows = [[record.name, record.source, record.sha256] for record in request.records]
    records = [Table("Records", columns, rows)] if {"records", "seismic", "statements"} & {*request.parts} else []
    return Section("provenance", "Provenance", [software_table, *records])
