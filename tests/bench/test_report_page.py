"""A report as one HTML file and as PDF: complete, valid, self-contained, and with nothing lost between the two."""

import re
import zlib
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

from bench.publication.numbers import percent, plain, with_uncertainty
from bench.report.page.document import Column, Document, Listing, Notice, Picture, Section, Table
from bench.report.page.html import html_page
from bench.report.page.pdf import write_pdf
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
    pictures = [Picture(drawing(), "A curve.", "What it shows"), Picture(drawing(11.0, 4.0), "A wide one.", "Wide")]
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


def test_the_pdf_has_a4_pages_upright_and_across_and_the_figures_keep_their_size(tmp_path: Path) -> None:
    made, path = document(), tmp_path / "report.pdf"
    write_pdf(path, made)
    content = path.read_bytes()
    assert content.startswith(b"%PDF-")
    # the first figure stands below the text of the first page, the wide one lies across a second page
    upright, across = (595, 842), (842, 595)
    assert boxes(content) == [upright, across, upright]
    assert page_count(content) == 3
    picture = made.sections[1].parts[0]
    assert isinstance(picture, Picture)
    assert tuple(picture.figure.get_size_inches()) == (5.0, 3.0)
    assert not picture.figure.texts


def test_a_long_table_goes_on_with_its_heading_on_the_next_page(tmp_path: Path) -> None:
    path = tmp_path / "long.pdf"
    write_pdf(path, document(rows=60))
    assert page_count(path.read_bytes()) > 3


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
        (plain(1.23456e-7), "1.235·10^−7"),
        (plain(float("nan")), "–"),
        (percent(-0.0123), "−1.23"),
    ],
)
def test_numbers_have_the_digits_that_their_uncertainty_leaves(shown: str, expected: str) -> None:
    assert shown == expected


def test_the_report_is_light() -> None:
    # 2000 points are outlines of some bytes each, not of dozens
    figure = new_figure(5.0, 3.0)
    figure.add_subplot().plot(np.random.default_rng(1).normal(size=2000))
    page = html_page(Document("t", [], [Section("s", "s", [Picture(figure, "c", "d")])], "m"))
    assert len(zlib.compress(page.encode())) < 40_000
