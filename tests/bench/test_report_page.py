"""A report as one HTML file and as PDF: complete, valid, self-contained, and with nothing lost between the two."""

import re
import subprocess
import zlib
from html.parser import HTMLParser
from pathlib import Path
from shutil import which
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure

from bench.publication.numbers import percent, plain, with_uncertainty
from bench.publication.typography import counted, listed, moment, typeset, unit_text
from bench.report.page.compositor import composed
from bench.report.page.document import Column, Document, Listing, Notice, Part, Picture, Section, Table
from bench.report.page.html import html_page
from bench.report.page.pdf import write_pdf
from bench.report.page.sheet import BOTTOM, HEIGHT, MARGIN, MEASURE, WIDTH, Line, Placed
from bench.report.page.typeset import Font, grid_of
from bench.report.style import new_figure

SVG = "{http://www.w3.org/2000/svg}"


def drawing(width: float = 5.0, height: float = 3.0) -> Figure:
    figure = new_figure(width, height)
    panel = figure.add_subplot()
    panel.plot(np.linspace(0.0, 1.0, 50), np.linspace(0.0, 1.0, 50) ** 2, label="curve")
    panel.set_xlabel(r"$\Omega$  [rad/s]")
    panel.fill_between([0.0, 1.0], [0.0, 0.5], hatch="//")
    figure.legend(loc="outside lower center")
    return figure


def document(rows: int = 3) -> Document:
    columns = [Column("name <b>", words=True), Column("α₂", "1"), Column("what & why", words=True)]
    table = Table("Values", columns, [[f"row {k}", "0.184 ± 0.002", "words " * 12] for k in range(rows)])
    first = Section("first", "First <part>", ["A paragraph & more.", Notice("Look here."), table])
    pictures = [Picture(drawing(), "A curve.", "What it shows"), Picture(drawing(11.0, 6.0), "A wide one.", "Wide")]
    second = Section("second", "Second", [*pictures, Listing(["one", "two"])])
    return Document("A title & a half", ["Summary."], [first, second], "made today")


@pytest.fixture(scope="module")
def page() -> str:
    return html_page(document())


def tree_of(page: str) -> ElementTree.Element:
    return ElementTree.fromstring(page.removeprefix("<!DOCTYPE html>\n"))


def test_the_page_is_well_formed_and_says_everything(page: str) -> None:
    tree = tree_of(page)
    assert tree.get("lang") == "en"
    assert tree.findtext("head/title") == "A title & a half"
    text = "".join(tree.itertext())
    for words in ("A paragraph & more.", "Look here.", "name <b>", "Table 1", "Fig. 2", "A wide one.", "two"):
        assert words in text
    assert [each.get("id") for each in tree.iter("section")] == ["first", "second"]
    assert [each.get("href") for each in tree.iter("a")] == ["#first", "#second"]


def test_the_page_refers_to_nothing_outside_and_no_identifier_comes_twice(page: str) -> None:
    outside: list[str] = []
    identifiers: list[str] = []

    class Look(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            values = dict(attrs)
            identifiers.extend(value for name, value in attrs if name == "id" and value)
            assert tag not in ("script", "link", "img", "iframe", "object")
            for name in ("src", "href", "xlink:href", "data"):
                value = values.get(name)
                if value and not value.startswith(("#", "data:image/png;base64,")):
                    outside.append(value)

    Look().feed(page)
    assert not outside
    assert "@import" not in page
    assert len(identifiers) == len(set(identifiers))
    used = set(re.findall(r'(?:href="|url\()#([^")]+)', page))
    assert used <= set(identifiers)


def test_figures_are_vectors_with_a_name_and_tables_have_scopes(page: str) -> None:
    tree = tree_of(page)
    drawings = list(tree.iter(f"{SVG}svg"))
    assert len(drawings) == 2
    for each in drawings:
        assert each.get("role") == "img"
        names = (each.get("aria-labelledby") or "").split()
        assert {
            found.get("id") for found in (each.find(f"{SVG}title"), each.find(f"{SVG}desc")) if found is not None
        } == {*names}
        assert len(list(each.iter(f"{SVG}path"))) > 10
        assert not list(each.iter(f"{SVG}image"))
    scopes = [head.get("scope") for head in tree.iter("th")]
    assert scopes == ["col"] * 3 + ["row"] * 3
    assert tree.find(".//table/caption") is not None


def page_count(content: bytes) -> int:
    return len(re.findall(rb"/Type /Page\b(?!s)", content))


def boxes(content: bytes) -> list[tuple[int, int]]:
    found = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", content)
    return [(round(float(width)), round(float(height))) for width, height in found]


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Document, Path]:
    made, path = document(), tmp_path_factory.mktemp("pdf") / "report.pdf"
    write_pdf(path, made)
    return made, path


def test_the_pdf_has_several_figures_on_a4_pages_and_the_figures_keep_their_size(
    printed: tuple[Document, Path],
) -> None:
    made, path = printed
    content = path.read_bytes()
    assert content.startswith(b"%PDF-")
    # text, a table and the first figure fill the first page; the wide one is drawn anew at the width of the second
    assert boxes(content) == [(595, 842)] * 2
    assert page_count(content) == 2
    placed = [mark for sheet in composed(made) for mark in sheet.marks if isinstance(mark, Placed)]
    sizes = [size for each in placed for size in (each.width, each.height)]
    assert sizes == pytest.approx([5.0, 3.0, MEASURE, 6.0 * (MEASURE / 11.0) ** 0.5])
    picture = made.sections[1].parts[0]
    assert isinstance(picture, Picture)
    assert tuple(picture.figure.get_size_inches()) == (5.0, 3.0)
    assert not picture.figure.texts


def test_the_pages_of_the_pdf_are_what_a_reader_program_sees(printed: tuple[Document, Path]) -> None:
    """The text on each page by poppler, a library of others."""
    if which("pdftotext") is None:
        pytest.skip("pdftotext of poppler is not installed")
    command = ["pdftotext", "-layout", str(printed[1]), "-"]
    text = subprocess.run(command, capture_output=True, text=True, check=True, encoding="utf-8").stdout
    first, second, _ = text.split("\f")
    assert "A title & a half" in first
    assert "Fig. 1. A curve." in first
    assert "Fig. 2. A wide one." in second
    assert re.search(r"row 2 +0\.184 ± 0\.002", first)
    assert "2 of 2" in second


PARTS = st.one_of(
    st.integers(1, 150).map(lambda n: "some words " * n),
    st.integers(1, 80).map(lambda n: Notice("look here " * n)),
    st.integers(1, 70).map(lambda n: Table("t", [Column("a", words=True), Column("b", "m")], [["x", "1"]] * n)),
    st.tuples(st.floats(1.0, 12.0), st.floats(0.5, 14.0)).map(lambda size: Picture(new_figure(*size), "c", "d")),
)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.lists(PARTS, min_size=1, max_size=5), min_size=1, max_size=4))
def test_nothing_overlaps_and_nothing_is_lost_or_beyond_the_margins(sections: list[list[Part]]) -> None:
    made = Document("Title", [], [Section("s", f"Section {k}", parts) for k, parts in enumerate(sections)], "made")
    sheets = composed(made)
    asked = [part.figure for parts in sections for part in parts if isinstance(part, Picture)]
    assert [mark.figure for sheet in sheets for mark in sheet.marks if isinstance(mark, Placed)] == asked
    lines = [mark.text for sheet in sheets for mark in sheet.marks if isinstance(mark, Line)]
    rows = sum(len(part.rows) for parts in sections for part in parts if isinstance(part, Table))
    assert lines.count("x") == rows
    for sheet in sheets:
        figures = [mark for mark in sheet.marks if isinstance(mark, Placed)]
        for k, each in enumerate(figures):
            assert each.x >= MARGIN - 1e-9
            assert each.x + each.width <= WIDTH - MARGIN + 1e-9
            assert each.y >= BOTTOM - 1e-9
            assert each.y + each.height <= HEIGHT - MARGIN + 1e-9
            assert all(each.y >= other.y + other.height for other in figures[:k] if other.y < each.y)
        for line in (mark for mark in sheet.marks if isinstance(mark, Line)):
            assert BOTTOM - 0.3 <= line.y <= HEIGHT - MARGIN
            assert not any(each.y - 0.02 < line.y < each.y + each.height for each in figures)


def test_a_long_table_goes_on_with_its_heading_on_the_next_page() -> None:
    sheets = composed(document(rows=60))
    heads = [sum(mark.text == "α₂ [1]" for mark in sheet.marks if isinstance(mark, Line)) for sheet in sheets]
    rows = [sum(mark.text == "0.184 ± 0.002" for mark in sheet.marks if isinstance(mark, Line)) for sheet in sheets]
    assert sum(rows) == 60
    assert len(sheets) >= 3
    assert heads == [int(count > 0) for count in rows]


def test_words_break_and_numbers_do_not() -> None:
    font = Font(9.0)
    text = "several words that do not fit on one line of two inches, and aVeryLongWordThatFitsOnNoLineAtAll" * 2
    lines = font.wrapped(text, 2.0)
    assert max(font.width(line) for line in lines) <= 2.0 + 1e-6
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")
    grid = grid_of(document().sections[0].parts[2], 6.8, (8.5, 7.5))  # type: ignore[arg-type]
    assert sum(grid.widths) <= 6.8 + 1e-6
    assert all(row[1] == ["0.184 ± 0.002"] for row in grid.rows)


def test_a_row_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match="every row must have 2 cells"):
        Table("Values", [Column("a"), Column("b")], [["1"]])


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (with_uncertainty(1.34709, 0.02846), "1.347 ± 0.028"),
        (with_uncertainty(-123.4, 12.0), "−123 ± 12"),
        (with_uncertainty(0.5, None), "0.5"),
        (with_uncertainty(None, 0.1), "–"),
        (plain(1.23456e-7), "1.235·10⁻⁷"),
        (plain(float("nan")), "–"),
        (percent(-0.0123), "−1.23"),
    ],
)
def test_numbers_have_the_digits_that_their_uncertainty_leaves(shown: str, expected: str) -> None:
    assert shown == expected


@pytest.mark.parametrize(
    ("shown", "expected"),
    [
        (unit_text("m/s2"), "m/s²"),
        (unit_text("kg/m3"), "kg/m³"),
        (unit_text("m/s2/Hz^0.5"), "m/s²/√Hz"),
        (unit_text("V s2/m"), "V s²/m"),
        (typeset("start 1 of beta = 0.4 at omega = 16 rad/s"), "start 1 of β = 0.4 at Ω = 16 rad/s"),
        (typeset("alpha_2 1.2, 6 m/s2. 10% of the draws, +-10 V"), "α₂ 1.2, 6 m/s². 10 % of the draws, ±10 V"),
        # keys, flags and the masses of the storeys are no symbols or units
        (typeset("specimen.beta, --beta, beta: `omega` and m2"), "specimen.beta, --beta, beta: `omega` and m2"),
        (moment("2026-11-21T17:29:11.216+00:00"), "2026-11-21 17:29:11 UTC"),
        (moment("2026-11-21T17:29:11+01:00"), "2026-11-21 17:29:11 UTC+01:00"),
        (moment(""), ""),
        (counted(1, "test"), "1 test"),
        (counted(12, "point was", "points were"), "12 points were"),
        (listed(["a", "b", "c"]), "a, b and c"),
    ],
)
def test_words_and_units_are_printed_as_in_print(shown: str, expected: str) -> None:
    assert shown == expected


def test_the_report_is_light() -> None:
    # 2000 points are outlines of some bytes each, not of dozens
    figure = new_figure(5.0, 3.0)
    figure.add_subplot().plot(np.random.default_rng(1).normal(size=2000))
    page = html_page(Document("t", [], [Section("s", "s", [Picture(figure, "c", "d")])], "m"))
    assert len(zlib.compress(page.encode())) < 40_000
