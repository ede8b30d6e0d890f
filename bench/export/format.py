"""A format of `rockbench export`: what a package registers under the entry point group `rockbench.exports`."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bench.export.content import Content


def _anything(content: Content) -> None:
    """Accept every content."""


@dataclass(frozen=True)
class ExportFormat:
    """How an open file is written for other programs. The name of its entry point is that of `--to`.

    `write` fills a new folder; `check` raises InvalidInput before it is made, for what the format cannot hold. `title`
    is what the window shows. `library` is a module of the extra `export` that has to be installed.
    """

    title: str
    write: Callable[[Content, Path], None]
    check: Callable[[Content], None] = _anything
    library: str = ""
