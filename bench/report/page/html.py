"""A report as one HTML file: no script, no reference to another file, readable on screen and on paper."""

from collections.abc import Iterator, Sequence
from html import escape
from itertools import count
from typing import assert_never

from bench.report.page.document import Document, Listing, Notice, Numbers, Part, Picture, Table
from bench.report.page.svg import inline_svg

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 "DejaVu Sans", "Segoe UI", Helvetica, Arial, sans-serif; color: #111; background: #fff;
  max-width: 64rem; margin: 0 auto; padding: 1.5rem; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 .3rem; }
h2 { font-size: 1.25rem; margin: 2.2rem 0 .5rem; padding-top: .4rem; border-top: 2px solid #0072b2; }
p, ul { margin: .5rem 0; max-width: 56rem; }
.made { color: #444; font-size: .9rem; }
nav ul { columns: 2; padding-left: 1.2rem; font-size: .95rem; }
a { color: #00547f; }
.notice { border-left: 4px solid #d55e00; background: #fdf3ec; padding: .5rem .8rem; }
.wide { overflow-x: auto; margin: 1rem 0; }
table { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-size: .9rem; padding-bottom: .3rem; }
caption b, figcaption b { font-weight: 700; }
th, td { padding: .22rem .6rem; border-bottom: 1px solid #ccc; text-align: right; vertical-align: top; }
thead th { border-bottom: 1.5px solid #333; vertical-align: bottom; }
th, td { white-space: nowrap; }
thead th { white-space: normal; }
.words { text-align: left; white-space: normal; overflow-wrap: break-word; min-width: 4.5rem; max-width: 34rem; }
tbody th { font-weight: 400; }
figure { margin: 1.2rem 0; }
figure svg { max-width: 100%; height: auto; display: block; margin: 0 auto; }
figure svg * { stroke-linejoin: round; stroke-linecap: butt; }
figcaption { font-size: .9rem; max-width: 56rem; margin-top: .3rem; }
@media print {
  @page { size: A4; margin: 16mm; }
  body { font-size: 10pt; max-width: none; padding: 0; }
  nav { display: none; }
  a { color: inherit; text-decoration: none; }
  h2 { break-after: avoid; }
  figure, tr, .notice { break-inside: avoid; }
  thead { display: table-header-group; }
  figure svg { max-height: 230mm; }
  .wide { overflow: visible; }
  table { font-size: 8pt; }
  th, td { padding: .2em .5em; }
  .words { overflow-wrap: anywhere; min-width: 3.5rem; }
}
"""


def html_page(document: Document) -> str:
    """The whole file, to be written as UTF-8. Draws every figure."""
    return "\n".join(_lines(document)) + "\n"


def _lines(document: Document) -> Iterator[str]:
    numbers, figures = Numbers(), count(1)
    yield "<!DOCTYPE html>"
    yield '<html lang="en">'
    yield "<head>"
    yield '<meta charset="utf-8"/>'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1"/>'
    yield f"<title>{escape(document.title)}</title>"
    yield f"<style>{STYLE}</style>"
    yield "</head>"
    yield "<body>"
    yield f'<header><h1>{escape(document.title)}</h1><p class="made">{escape(document.made)}</p></header>'
    yield "<main>"
    yield from _parts(document.summary, numbers, figures)
    links = "".join(f'<li><a href="#{each.key}">{escape(each.heading)}</a></li>' for each in document.sections)
    yield f'<nav aria-label="Contents"><ul>{links}</ul></nav>'
    for section in document.sections:
        yield f'<section id="{section.key}"><h2>{escape(section.heading)}</h2>'
        yield from _parts(section.parts, numbers, figures)
        yield "</section>"
    yield "</main>"
    yield "</body>"
    yield "</html>"


def _parts(parts: Sequence[Part], numbers: Numbers, figures: "count[int]") -> Iterator[str]:
    for part in parts:
        name = numbers.next(part)
        match part:
            case str():
                yield f"<p>{escape(part)}</p>"
            case Notice():
                yield f'<p class="notice">{escape(part.text)}</p>'
            case Listing():
                yield "<ul>" + "".join(f"<li>{escape(item)}</li>" for item in part.items) + "</ul>"
            case Table():
                yield from _table(part, name)
            case Picture():
                yield "<figure>"
                yield inline_svg(part.figure, f"f{next(figures)}", name, part.description)
                yield f"<figcaption><b>{name}.</b> {escape(part.caption)}</figcaption></figure>"
            case _:
                assert_never(part)


def _table(table: Table, name: str) -> Iterator[str]:
    kinds = [' class="words"' if column.words else "" for column in table.columns]
    heads = zip(table.columns, kinds, strict=True)
    yield '<div class="wide"><table>'
    yield f"<caption><b>{name}.</b> {escape(table.caption)}</caption>"
    yield "<thead><tr>" + "".join(f'<th scope="col"{kind}>{escape(head.heading)}</th>' for head, kind in heads)
    yield "</tr></thead><tbody>"
    for first, *others in table.rows:
        cells = "".join(f"<td{kind}>{escape(cell)}</td>" for cell, kind in zip(others, kinds[1:], strict=True))
        yield f'<tr><th scope="row"{kinds[0]}>{escape(first)}</th>{cells}</tr>'
    yield "</tbody></table></div>"
