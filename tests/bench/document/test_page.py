"""A report as one HTML file: complete, valid, self-contained, free of foreign markup; the numbers in its texts."""

import re
import zlib
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

from bench.document.document import Column, Document, Listing, Notice, Part, Picture, Section, Table
from bench.document.rendering import html_page
from bench.document.typography import counted, listed, moment, percent, plain, typeset, unit_text, with_uncertainty
from bench.figures.style import new_figure

ATTACK = "<script>alert('α & β')</script><img src=x onerror=alert(1)>"

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


def test_no_text_of_a_file_becomes_markup() -> None:
    """Notes, names and captions come from files and people."""
    table = Table(ATTACK, [Column(ATTACK, words=True), Column("n")], [[ATTACK, ATTACK]])
    parts: list[Part] = [ATTACK, Notice(ATTACK), Listing([ATTACK]), table, Picture(drawing(), ATTACK, ATTACK)]
    page = html_page(Document(ATTACK, [ATTACK], [Section("s", ATTACK, parts)], ATTACK))
    tree = tree_of(page)
    assert {each.tag for each in tree.iter()}.isdisjoint({"script", f"{SVG}script", "img"})
    assert "<script>" not in page
    # title twice, provenance, summary, entry of the contents, heading, paragraph, notice, item, table 4, figure 2
    assert "".join(tree.itertext()).count(ATTACK) == 15


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
