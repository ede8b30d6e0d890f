"""Pages of a PDF report with figures and tables of awkward sizes, measured in the file: filled, and not torn apart."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from pypdfium2 import PdfDocument, PdfPage

from bench.document.document import Column, Document, Part, Picture, Section, Table
from bench.document.rendering import write_pdf
from bench.figures.style import new_figure

TOP, BOTTOM = 841.89 - 53.86, 56.69
"""Upper and lower edge of the text [pt]: margins of 19 and 20 mm on A4."""

LEAST = 0.6


def text(words: int) -> str:
    return "words " * words


def figure(width: float, height: float) -> Picture:
    return Picture(new_figure(width, height), "An empty figure.", "Nothing")


def table(rows: int) -> Table:
    return Table("Values", [Column("row", words=True), Column("b", "m")], [[f"r{k}.", "123.25"] for k in range(rows)])


def report(*sections: Sequence[Part]) -> Document:
    return Document(
        "Title", ["Summary."], [Section("s", f"Section {k}", parts) for k, parts in enumerate(sections)], "made"
    )


def filled(page: PdfPage) -> float:
    """Filled share of the height of the text: down to the lowest object above the foot."""
    boxes = [each.get_bounds() for each in page.get_objects(max_depth=1)]
    return (TOP - min(bottom for _, bottom, _, top in boxes if top > BOTTOM)) / (TOP - BOTTOM)


def lines_of(page: PdfPage) -> list[str]:
    return [line.strip() for line in page.get_textpage().get_text_range().splitlines() if line.strip()]


AWKWARD = {
    "a large figure after half a page": report([text(400), figure(7.0, 8.0)], [text(600)]),
    "figures that fit on no page together": report([figure(6.7, 5.6), figure(6.7, 5.6), figure(6.7, 5.6), text(300)]),
    "a figure at the end of a section": report([text(150), figure(6.7, 5.0)], [text(50), figure(6.7, 6.0), text(9)]),
    "tables between the figures": report(
        [table(12), figure(6.7, 7.5), table(12), figure(6.7, 6.0), table(12), figure(6.7, 7.9), text(200)], [table(50)]
    ),
    "text behind the figure": report([text(350), figure(6.7, 8.0), text(150), table(40), text(50)]),
    "a wide and flat one, and a narrow one": report([text(200), figure(12.0, 14.0), figure(3.0, 7.0), text(300)]),
}


@pytest.mark.parametrize("name", AWKWARD)
def test_pages_are_filled_and_nothing_is_torn_apart(name: str, tmp_path: Path) -> None:
    document = AWKWARD[name]
    write_pdf(tmp_path / "report.pdf", document)
    with PdfDocument(tmp_path / "report.pdf") as pdf:
        shares = [filled(page) for page in pdf]
        pages = [lines_of(page) for page in pdf]
    assert min(shares[:-1]) >= LEAST, [f"{share:.2f}" for share in shares]
    for lines in pages:
        # the last line is the foot of the page
        assert not lines[-2].startswith("Section")
        assert not lines[-2].startswith("Table")
    # figures stay in their sections and in order
    whole = [line for lines in pages for line in lines]
    places = [" ".join(line.split()[:2]).rstrip(".") for line in whole if line.startswith(("Section", "Fig."))]
    expected: list[str] = []
    for section in document.sections:
        expected.append(section.heading)
        for part in section.parts:
            if isinstance(part, Picture):
                expected.append(f"Fig. {sum(each.startswith('Fig.') for each in expected) + 1}")
    assert places == expected


@pytest.mark.parametrize("rows", [53, 54, 55])
def test_the_last_row_of_a_table_is_not_alone(rows: int, tmp_path: Path) -> None:
    assert 1 not in rows_by_page(report([table(rows), text(20)]), tmp_path / "report.pdf")


@pytest.mark.parametrize("words", [668, 676, 684])
def test_the_first_row_of_a_table_is_not_alone(words: int, tmp_path: Path) -> None:
    assert 1 not in rows_by_page(report([text(words), table(20)]), tmp_path / "report.pdf")


def rows_by_page(document: Document, path: Path) -> list[int]:
    """Number of rows of tables on each page."""
    write_pdf(path, document)
    with PdfDocument(path) as pdf:
        return [sum("123.25" in line for line in lines_of(page)) for page in pdf]


def test_a_row_is_on_one_page(tmp_path: Path) -> None:
    """Rows of many lines; only one longer than most of a page would continue on the next page."""
    columns = [Column("row", words=True), Column("words", words=True)]
    rows = [[f"first{k} of {'words ' * 30} last{k}", "words " * 20] for k in range(30)]
    write_pdf(tmp_path / "report.pdf", report([Table("Values", columns, rows)]))
    with PdfDocument(tmp_path / "report.pdf") as pdf:
        texts = [page.get_textpage().get_text_range() for page in pdf]
    assert len(texts) > 2
    for k in range(30):
        assert [f"first{k} " in each for each in texts] == [f"last{k}" in each.split() for each in texts]
