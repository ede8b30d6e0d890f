"""What is installed beside the program: protocols and export formats by entry points, each loaded when it is used."""

import sys
from collections.abc import Sequence
from functools import lru_cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import TYPE_CHECKING, Any, TypeVar, cast

from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.export.format import ExportFormat
    from bench.protocol import Protocol

T = TypeVar("T")

PROTOCOLS, EXPORTS = "rockbench.protocols", "rockbench.exports"
"""Groups of entry points."""


def protocol_names() -> tuple[str, ...]:
    """The names of all protocols that are installed, in alphabetical order; loads none."""
    return _names(PROTOCOLS)


def load_protocol(name: str, item: str = "protocol") -> "Protocol[Any]":
    """The protocol `name`. Raises InvalidInput for one that is not installed or fails to load; `item` names what was
    given.
    """
    from bench.protocol import Protocol

    return cast("Protocol[Any]", _loaded(PROTOCOLS, name, item, Protocol))


def all_protocols() -> "tuple[Sequence[Protocol[Any]], Sequence[str]]":
    """Every protocol that loads, in alphabetical order, and one line for each that does not."""
    found: list[Protocol[Any]] = []
    failed: list[str] = []
    for name in protocol_names():
        try:
            found.append(load_protocol(name))
        except InvalidInput as refused:
            failed.append(str(refused))
    return found, failed


def format_names() -> tuple[str, ...]:
    """The names of all export formats that are installed, in alphabetical order; loads none."""
    return _names(EXPORTS)


def load_format(name: str) -> "ExportFormat":
    """The export format `name`. Raises InvalidInput for one that is not installed or fails to load."""
    from bench.export.format import ExportFormat

    return _loaded(EXPORTS, name, "--to", ExportFormat)


def _entries(group: str) -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in _on_path(group, tuple(sys.path))}


@lru_cache(maxsize=8)
def _on_path(group: str, _path: tuple[str, ...]) -> EntryPoints:
    """Those of every package on the path, whose metadata are read once."""
    return entry_points(group=group)


def _names(group: str) -> tuple[str, ...]:
    return tuple(sorted(_entries(group)))


def _loaded(group: str, name: str, item: str, kind: type[T]) -> T:
    entries = _entries(group)
    if name not in entries:
        raise InvalidInput(item, name, f"one of {', '.join(sorted(entries))}")
    entry = entries[name]
    package = "an unknown package" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"
    try:
        found = entry.load()
    except Exception as error:
        reason = " ".join(str(error).split()) or "no reason given"
        told = f"{entry.value} of {package} cannot be loaded ({type(error).__name__}: {reason}); mend or remove it"
        raise InvalidInput(item, name, told) from error
    if not isinstance(found, kind):
        raise InvalidInput(item, name, f"{entry.value} of {package} is no {kind.__module__}.{kind.__qualname__}")
    return found
