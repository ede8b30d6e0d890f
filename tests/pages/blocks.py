"""Fenced blocks of the Markdown pages, with the directive that stands above a block.

A directive is a comment, invisible in the rendered page: `<!-- page: parse, needs a shaker -->`.

=========  ==========================================================================================================
run        the default: the block is executed
slow       executed by `python -m tests.pages` only, not in the test suite
parse      the command lines are checked against the command line's declaration, but not executed; the reason follows
records    executed where the recorded ground motions are available, otherwise parsed; `records, slow` by
           `python -m tests.pages` only
=========  ==========================================================================================================
"""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
"""Root of the project."""

DIRECTIVES = ("run", "slow", "parse", "records")

LANGUAGES = ("sh", "console", "toml", "json", "python", "matlab", "text")
"""Languages of a block. `sh` has one command per line, `console` commands after `$` with the expected output."""

_FENCE = re.compile(r"^```(?P<language>\S*)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE)
_DIRECTIVE = re.compile(r"<!-- page: (?P<word>\w+)(?:, (?P<reason>[^>]+))? -->\n+$")


@dataclass(frozen=True)
class Command:
    """One command line of a block and the lines of output that the page shows for it."""

    line: str
    output: tuple[str, ...] = ()

    @property
    def arguments(self) -> list[str]:
        """Words of the command without its comment, beginning with `rockbench` where `uv run` precedes it."""
        words = shlex.split(self.line, comments=True)
        return words[2:] if words[:2] == ["uv", "run"] else words


@dataclass(frozen=True)
class Block:
    """A fenced block: where it is, what it contains, and how it is checked."""

    page: Path
    line: int
    language: str
    text: str
    directive: str
    reason: str

    @property
    def where(self) -> str:
        """Page and line, for messages."""
        return f"{self.page.relative_to(ROOT).as_posix()}:{self.line}"

    @property
    def commands(self) -> tuple[Command, ...]:
        """The command lines of an `sh` or `console` block."""
        lines = self.text.splitlines()
        if self.language == "sh":
            written = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
            return tuple(Command(part) for line in written for part in line.split(" && "))
        starts = [number for number, line in enumerate(lines) if line.startswith("$ ")]
        ends = [*starts[1:], len(lines)]
        return tuple(
            Command(lines[start][2:], tuple(lines[start + 1 : end])) for start, end in zip(starts, ends, strict=False)
        )


def pages() -> list[Path]:
    """README and every page of `docs/` except the decision records, which are history."""
    found = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return [page for page in found if "decisions" not in page.parts]


def blocks(page: Path) -> Iterator[Block]:
    """The fenced blocks of a page in order. Raises ValueError for a directive that is not known."""
    text = page.read_text(encoding="utf-8")
    for match in _FENCE.finditer(text):
        directive = _DIRECTIVE.search(text[: match.start()])
        word = directive["word"] if directive else "run"
        line = text[: match.start()].count("\n") + 1
        if word not in DIRECTIVES:
            raise ValueError(f"{page.name}:{line}: the directive {word!r} is none of {', '.join(DIRECTIVES)}")
        reason = (directive["reason"] if directive else "") or ""
        yield Block(page, line, match["language"], match["text"], word, reason)


def links(page: Path) -> Iterator[tuple[int, str]]:
    """Line and target of every link and picture of a page that points into the project."""
    text = _FENCE.sub(lambda match: "\n" * match[0].count("\n"), page.read_text(encoding="utf-8"))
    for match in re.finditer(r"\]\((?P<target>[^)\s]+)\)", text):
        if "://" not in match["target"] and not match["target"].startswith("mailto:"):
            yield text[: match.start()].count("\n") + 1, match["target"]


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as forges derive them: lower case, punctuation dropped, spaces to hyphens."""
    text = _FENCE.sub("", page.read_text(encoding="utf-8"))
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
