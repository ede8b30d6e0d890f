"""Reports and figures show printed names, symbols and units; and the rule that finds what is not printed."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure
from pypdfium2 import PdfDocument

from bench.app.catalogue import installed_protocol, parameters_of
from bench.app.reports.report import campaign_report
from bench.config.validation import validated
from bench.datafile.reader import DataFile, open_datafile
from bench.document import gain_map
from bench.document.campaign import Campaign
from bench.document.document import Document, Picture, Section
from bench.document.rendering import html_page, write_pdf
from bench.protocol import Protocol
from bench.replay.session import stored_configuration
from tests.first_edition.command import unpack
from tests.visible_text import document_texts, faults, figure_texts, html_texts, program_notation

pytestmark = pytest.mark.usefixtures("shared_results")

INDEXED = re.compile(r"\b[A-Za-z]_[A-Za-z]\b")
"""A symbol whose index is not lowered."""

RUNS = (
    "check",
    "coupling_stiffness",
    "earthquake",
    "free_rocking",
    "free_vibration",
    "harmonic_springs",
    "identify",
    "laser_calibration",
)
"""A recorded run of each protocol; stability has none and is read where its tests make one."""


@pytest.mark.parametrize(
    "text",
    [
        "alpha_2 against beta",
        "what laser_1 measured",
        "r_th",
        "{'a': 1}",
        '{"sensor": 0.1}',
        "['laser']",
        "nan mm",
        "Finding(name='k1')",
        "9.81 m/s2",
        "3.3 um",
        "1.2 +- 0.1",
        "10^-3",
        "5 V s2/m",
        "phase [deg]",
        "True",
    ],
)
def test_program_notation_is_found(text: str) -> None:
    assert program_notation(text)


@pytest.mark.parametrize(
    "text",
    [
        "α₂ against β, m/s², rₜₕ, 3.3 µm, 1.2 ± 0.1",
        "k_C = 85.4 N/m, 2h_b = 0.4 m, k₁ 213.42(17) N/m",
        "Results are in runs/free_vibration_3/campaign.h5.",
        "limits.laser_range = 3 is refused",
        "like --settle-tolerance and `rockbench check`",
        "a number in table_model.json, 12 rad/s, one degree",
    ],
)
def test_what_a_person_types_and_what_is_printed_are_no_program_notation(text: str) -> None:
    assert not program_notation(text)


class Recording:
    """A recorded run, its protocol and its report."""

    def __init__(self, record: DataFile, path: Path) -> None:
        self.record = record
        found = installed_protocol(record)
        assert found is not None
        self.protocol: Protocol[Any] = found
        self.document = campaign_report(Campaign(path, record, found.parameters), found)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("recorded")


@pytest.fixture(scope="module", params=RUNS)
def recording(request: pytest.FixtureRequest, folder: Path) -> Iterator[Recording]:
    (folder / request.param).mkdir()
    # a file has the name that a run gives it
    path = unpack(request.param, folder).rename(folder / request.param / "campaign.h5")
    with pytest.MonkeyPatch.context() as patch, open_datafile(path) as record:
        patch.setattr(gain_map, "STEP", 1.0)
        patch.setattr(gain_map, "BETA_STEP", 0.2)
        yield Recording(record, path)


SECTIONS: dict[str, Section] = {}
"""One section of each kind, of the reports that were made."""


def test_reports_are_printed(recording: Recording) -> None:
    """Text and figures of the report, and the page that a browser shows."""
    document = recording.document
    SECTIONS.update({each.key: each for each in document.sections})
    assert not faults(document_texts(document))
    texts = list(html_texts(html_page(_undrawn(document))))
    assert len(texts) > 100
    assert not faults(("html", text) for text in texts)
    assert not [text for text in texts if INDEXED.search(text)]


def test_figures_of_runs_are_printed(recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All that the run drew, from its recorded points."""
    record, protocol = recording.record, recording.protocol
    drawn: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, path, **_options: (drawn.append(figure), path.touch()))
    prepared = protocol.prepare(parameters_of(record, protocol), stored_configuration(record), record.tables)
    points = [
        validated(protocol.point, {name: value for name, value in row.items() if value == value})
        for row in record.points
    ]
    result = prepared.result(points)
    assert set(result.figures) == set(protocol.figures)
    for name, draw in result.figures.items():
        draw(tmp_path / name)
    assert len(drawn) == len(protocol.figures)
    assert not faults((protocol.name, text) for figure in drawn for text in figure_texts(figure))


def test_every_kind_of_section_is_printed_in_a_pdf(tmp_path: Path) -> None:
    """Of the sections above, in one file; the texts of their figures are examined there."""
    if len(SECTIONS) < 2:
        pytest.skip("needs the reports of the tests above")
    document = _undrawn(Document("Test report", [], list(SECTIONS.values()), "provenance"))
    write_pdf(path := tmp_path / "report.pdf", document)
    with PdfDocument(path) as pdf:
        texts = [page.get_textpage().get_text_range() for page in pdf]
    assert len(" ".join(texts)) > 10_000
    assert not sorted({each for text in texts for each in program_notation(text)})
    assert not [found for text in texts for found in INDEXED.findall(text)]


def _undrawn(document: Document) -> Document:
    """The document with figures that take no time to draw."""
    sections = [
        replace(
            each,
            parts=[replace(part, figure=Figure((1, 1))) if isinstance(part, Picture) else part for part in each.parts],
        )
        for each in document.sections
    ]
    return replace(document, sections=sections)
