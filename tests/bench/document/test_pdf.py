"""A report as PDF, read back by PDFium: complete, within the margins, with vector figures and whole fonts."""

import subprocess
from collections.abc import Iterator
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

import numpy as np
import pypdfium2.raw as pdfium
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from pypdfium2 import PdfDocument, PdfPage

from bench.document.document import Column, Document, Listing, Notice, Part, Picture, Section, Table
from bench.document.rendering import HEIGHT, WIDTH, write_pdf
from bench.figures.style import new_figure

INCH = 72.0
A4 = (595.28, 841.89)
LEFT, RIGHT, TOP, BOTTOM = 53.8, A4[0] - 53.8, A4[1] - 53.8, 56.6
"""Edges of the text [pt]: margins of 19 mm and, below, 20 mm."""

GREEK = "α₂ = 0.184 ± 0.002, β, Ω, ξ₁, −3·10⁻⁷ m/s², ≤ 10 µV/√Hz"
ATTACK = '<script>alert(1)</script> #import "x" $a^2$ *b* _c_ @d \\ & {}'


def drawing(width: float = 5.0, height: float = 3.0) -> Figure:
    figure = new_figure(width, height)
    panel = figure.add_subplot()
    panel.plot(np.linspace(0.0, 1.0, 50), np.linspace(0.0, 1.0, 50) ** 2, label="curve")
    panel.set_xlabel(r"$\Omega$  [rad/s]")
    panel.fill_between([0.0, 1.0], [0.0, 0.5], hatch="//")
    figure.legend(loc="outside lower center")
    return figure


def document(*parts: Part, title: str = "A title & a half") -> Document:
    return Document(title, ["Summary."], [Section("first", "First <part>", [*parts])], "made today")


@pytest.fixture
def printed(tmp_path: Path) -> Iterator["Printer"]:
    printer = Printer(tmp_path / "report.pdf")
    yield printer
    printer.close()


class Printer:
    """Writes a report and opens it with a reader that knows nothing of the writer."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._open: PdfDocument | None = None

    def __call__(self, report: Document) -> list[PdfPage]:
        self.close()
        write_pdf(self.path, report)
        self._open = PdfDocument(self.path)
        return list(self._open)

    @property
    def headings(self) -> list[str]:
        assert self._open is not None
        return [entry.get_title() for entry in self._open.get_toc()]

    def close(self) -> None:
        if self._open is not None:
            self._open.close()
            self._open = None


def text_of(page: PdfPage) -> str:
    """The text of a page in one line, as a person copies it."""
    return " ".join(page.get_textpage().get_text_range().split())


def figures_on(page: PdfPage) -> list[tuple[float, float, float, float]]:
    """Left, bottom, right, top [pt] of what is embedded as a drawing of its own."""
    forms = page.get_objects(filter=[pdfium.FPDF_PAGEOBJ_FORM], max_depth=1)
    return [form.get_bounds() for form in forms]


def test_pages_are_a4_with_numbers_and_bookmarks(printed: Printer) -> None:
    pages = printed(document(drawing_of(5.0, 3.0), drawing_of(11.0, 6.0), drawing_of(6.0, 6.0)))
    assert [page.get_size() for page in pages] == [pytest.approx(A4, abs=0.1)] * 2
    for number, page in enumerate(pages, 1):
        assert f"A title & a half {number} of 2" in text_of(page)
    assert printed.headings == ["First <part>"]


def drawing_of(width: float, height: float) -> Picture:
    return Picture(drawing(width, height), f"{width:g} by {height:g}.", "What it shows")


def test_figures_are_vectors_and_keep_their_size_unless_they_are_too_large(printed: Printer) -> None:
    pictures = [drawing_of(5.0, 3.0), drawing_of(11.0, 6.0), drawing_of(6.0, 20.0)]
    pages = printed(document(*pictures))
    kinds = {each.type for page in pages for each in page.get_objects(max_depth=9)}
    assert pdfium.FPDF_PAGEOBJ_IMAGE not in kinds
    assert {pdfium.FPDF_PAGEOBJ_PATH, pdfium.FPDF_PAGEOBJ_TEXT, pdfium.FPDF_PAGEOBJ_FORM} <= kinds
    text = " ".join(text_of(page) for page in pages)
    for name in ("Fig. 1. 5 by 3.", "Fig. 2. 11 by 6.", "Fig. 3. 6 by 20."):
        assert name in text
    # letters are drawn at the size of the paper: the figures are redrawn, not scaled
    assert [tuple(each.figure.get_size_inches()) for each in pictures] == [(5.0, 3.0), (11.0, 6.0), (6.0, 20.0)]
    assert len([box for page in pages for box in figures_on(page)]) == 3


def test_letters_of_figures_keep_their_size(printed: Printer) -> None:
    def tallest(picture: Picture) -> float:
        (page, *_) = printed(document(picture))
        # the label of the axis, rad/s, is text of the figure
        found = page.get_textpage().search("rad/s").get_next()
        assert found is not None
        _, bottom, _, top = page.get_textpage().get_charbox(found[0])
        return top - bottom

    assert tallest(drawing_of(12.0, 5.0)) == pytest.approx(tallest(drawing_of(5.0, 3.0)), rel=0.02)


def test_greek_letters_and_signs_are_copied_as_they_were_written(printed: Printer) -> None:
    table = Table("Values", [Column("α₂", "1"), Column("Ω", "rad/s")], [["−0.184 ± 0.002", GREEK]])
    pages = printed(document(GREEK, table, Listing([GREEK])))
    assert text_of(pages[0]).count(GREEK) == 3
    assert "−0.184 ± 0.002" in text_of(pages[0])


def test_no_text_of_a_file_becomes_markup(printed: Printer) -> None:
    table = Table(ATTACK, [Column(ATTACK, words=True)], [[ATTACK]])
    pages = printed(
        Document(ATTACK, [ATTACK], [Section("s", ATTACK, [Notice(ATTACK), Listing([ATTACK]), table])], ATTACK)
    )
    # title, provenance, summary, heading, notice, item, caption, head, cell, foot
    assert text_of(pages[0]).count(ATTACK) == 10


def test_a_long_table_goes_on_with_its_heading_on_the_next_page(printed: Printer) -> None:
    columns = [Column("row", words=True), Column("α₂", "1"), Column("what & why", words=True)]
    pages = printed(
        document(Table("Values", columns, [[f"row {k}", "0.184 ± 0.002", "words " * 12] for k in range(150)]))
    )
    heads = [text_of(page).count("α₂ [1]") for page in pages]
    counts = [text_of(page).count("0.184 ± 0.002") for page in pages]
    assert sum(counts) == 150
    assert len(pages) >= 3
    assert heads == [int(count > 0) for count in counts]


def test_a_checksum_is_broken_without_a_character_more_and_numbers_are_not(printed: Printer) -> None:
    checksum = "58f98db2ab4102649cce5a3f1257caf903073f85d297c209b078db8a83366529"
    columns = [Column("file", words=True), Column("of", words=True), *(Column(f"value {k}") for k in range(6))]
    row = [checksum, "words " * 30, *["1234.5678 ± 0.0012"] * 6]
    (page,) = printed(document(Table("Values", columns, [row])))
    lines = page.get_textpage().get_text_range().splitlines()
    assert checksum in "".join(lines).replace(" ", "")
    assert sum(line.count("1234.5678 ± 0.0012") for line in lines) == 6
    beyond_the_margins(page)


def test_a_column_without_a_heading(printed: Printer) -> None:
    """A matrix has one: the names of its rows need no title."""
    (page,) = printed(document(Table("Correlations", [Column(""), Column("k₁")], [["k₁", "1.00"]])))
    assert "k₁ k₁ 1.00" in text_of(page)


def beyond_the_margins(page: PdfPage) -> None:
    """Fail for letters and figures outside the text of the page; the foot stays on the paper."""
    text = page.get_textpage()
    boxes = [text.get_charbox(k) for k in range(text.count_chars())]
    for left, bottom, right, top in [*(box for box in boxes if box[2] > box[0]), *figures_on(page)]:
        assert left >= LEFT - 1.0
        assert right <= RIGHT + 1.0
        assert top <= TOP + 1.0
        assert bottom >= BOTTOM - 30.0


PARTS = st.one_of(
    st.integers(1, 150).map(lambda n: "some words " * n),
    st.integers(1, 80).map(lambda n: Notice("look here " * n)),
    st.integers(1, 30).map(lambda n: Listing(["an item of a list"] * n)),
    st.integers(1, 70).map(lambda n: Table("t", [Column("a", words=True), Column("b", "m")], [["x", "123.25"]] * n)),
    st.tuples(st.floats(1.0, 12.0), st.floats(0.5, 14.0)).map(lambda size: Picture(new_figure(*size), "cap.", "d")),
)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.lists(PARTS, min_size=1, max_size=5), min_size=1, max_size=4))
def test_nothing_overlaps_and_nothing_is_lost_or_beyond_the_margins(sections: list[list[Part]]) -> None:
    made = Document("Title", [], [Section("s", f"Section {k}", parts) for k, parts in enumerate(sections)], "made")
    with TemporaryDirectory() as folder:
        printer = Printer(Path(folder) / "report.pdf")
        pages = printer(made)
        text = " ".join(text_of(page) for page in pages)
        every = [part for parts in sections for part in parts]
        assert text.count("cap.") == sum(isinstance(part, Picture) for part in every)
        assert text.count("123.25") == sum(len(part.rows) for part in every if isinstance(part, Table))
        assert text.count("an item") == sum(len(part.items) for part in every if isinstance(part, Listing))
        assert printer.headings == [f"Section {k}" for k in range(len(sections))]
        for page in pages:
            beyond_the_margins(page)
            figures = figures_on(page)
            for k, (left, bottom, right, top) in enumerate(figures):
                assert right - left <= WIDTH * INCH + 0.1
                assert top - bottom <= HEIGHT * INCH + 0.1
                assert all(bottom >= other[3] or top <= other[1] for other in figures[:k])
            letters = page.get_textpage()
            for left, bottom, right, top in figures:
                # a figure without panels has no letters of its own
                assert not letters.get_text_bounded(left, bottom, right, top).strip()
        printer.close()


def test_poppler_finds_whole_fonts_and_the_same_text(printed: Printer) -> None:
    """A second reader, where it is installed."""
    if which("pdffonts") is None:
        pytest.skip("pdffonts of poppler is not installed")
    printed(document(GREEK, drawing_of(5.0, 3.0)))
    fonts = subprocess.run(["pdffonts", str(printed.path)], capture_output=True, text=True, check=True).stdout
    rows = [line for line in fonts.splitlines()[2:] if line]
    assert rows
    # embedded, a subset, with a map to Unicode
    assert all("yes yes yes" in row and "DejaVuSans" in row for row in rows)
    command = ["pdftotext", "-layout", str(printed.path), "-"]
    text = subprocess.run(command, capture_output=True, text=True, check=True, encoding="utf-8").stdout
    assert GREEK in " ".join(text.split())
