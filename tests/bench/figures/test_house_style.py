"""Units and signs on figures are printed ones: m/s², µm, √Hz, ±."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SHOWN = {"set_xlabel", "set_ylabel", "set_title", "suptitle", "text", "annotate"}
"""Methods whose first text is drawn; so is every `label`."""
ASCII = re.compile(r"\bum\b|\+-|/s2|/m2|Hz\^|\bdeg\b|[a-z]_[a-z]{2}|\basked\b| - ")
MATHS = re.compile(r"\$[^$]*\$")


def _drawn(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        texts = [word.value for word in node.keywords if word.arg == "label"]
        if isinstance(node.func, ast.Attribute) and node.func.attr in SHOWN:
            texts += node.args
        for text in texts:
            yield from _constants(text)


def _constants(text: ast.expr) -> Iterator[str]:
    """Texts of an expression, but not the keys that it looks values up by."""
    if isinstance(text, ast.JoinedStr):
        yield "".join(str(each.value) for each in text.values if isinstance(each, ast.Constant))
    elif isinstance(text, ast.IfExp):
        yield from (*_constants(text.body), *_constants(text.orelse))
    elif isinstance(text, ast.Constant) and isinstance(text.value, str) and text.value != "_nolegend_":
        yield text.value


@pytest.mark.parametrize("room", ["bench/figures", "bench/document", "bench/app/reports", "protocols"])
def test_no_figure_has_an_ascii_unit_or_an_identifier(room: str) -> None:
    found = {
        f"{path.name}: {text}"
        for path in (ROOT / room).rglob("*.py")
        for text in _drawn(path)
        if ASCII.search(MATHS.sub("", text))
    }
    assert found == set()
