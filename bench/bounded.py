"""Limits of size and nesting depth for text files: configurations, records, specimens and queues."""

from pathlib import Path
from typing import Any, cast

LARGEST = 2**25
"""Maximum size of a text file [bytes]; a long accelerogram has a few million bytes."""
DEEPEST = 40
"""Maximum nesting of tables and lists; a configuration has five levels."""


def read_bounded(path: Path) -> bytes:
    """Contents of a file. Raises ValueError if it is larger than LARGEST, and OSError if it cannot be read."""
    with path.open("rb") as file:
        content = file.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise ValueError(f"it is larger than {LARGEST // 2**20} MB")
    return content


def require_shallow(data: object) -> None:
    """Raise ValueError if data from TOML or JSON are nested deeper than DEEPEST."""
    level: list[Any] = [data]
    for _ in range(DEEPEST):
        level = [
            inner
            for outer in level
            for inner in (
                cast("dict[Any, Any]", outer).values()
                if isinstance(outer, dict)
                else cast("list[Any]", outer)
                if isinstance(outer, list)
                else ()
            )
            if isinstance(inner, dict | list)
        ]
        if not level:
            return
    raise ValueError(f"it is nested deeper than {DEEPEST} levels")
