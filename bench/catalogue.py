"""The protocols that are installed: entry points of the group `rockbench.protocols`, each loaded when it is used."""

from collections.abc import Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any, cast

from sim.errors import InvalidInput

if TYPE_CHECKING:
    from bench.protocol import Protocol

GROUP = "rockbench.protocols"


def protocol_names() -> tuple[str, ...]:
    """The names of all protocols that are installed, in alphabetical order; loads none."""
    return tuple(sorted(_entries()))


def load_protocol(name: str, item: str = "protocol") -> "Protocol[Any]":
    """The protocol `name`. Raises InvalidInput for one that is not installed or fails to load; `item` names
    what was given.
    """
    entries = _entries()
    if name not in entries:
        raise InvalidInput(item, name, f"one of {', '.join(sorted(entries))}")
    return _loaded(entries[name], item)


def all_protocols() -> "tuple[Sequence[Protocol[Any]], Sequence[str]]":
    """Every protocol that loads, in alphabetical order, and one line for each that does not."""
    found: list[Protocol[Any]] = []
    failed: list[str] = []
    for _, entry in sorted(_entries().items()):
        try:
            found.append(_loaded(entry, "protocol"))
        except InvalidInput as refused:
            failed.append(str(refused))
    return found, failed


def _entries() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def _loaded(entry: EntryPoint, item: str) -> "Protocol[Any]":
    from bench.protocol import Protocol

    package = "an unknown package" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"
    try:
        found = entry.load()
    except Exception as error:
        reason = " ".join(str(error).split()) or "no reason given"
        told = f"{entry.value} of {package} cannot be loaded ({type(error).__name__}: {reason}); mend or remove it"
        raise InvalidInput(item, entry.name, told) from error
    if not isinstance(found, Protocol):
        told = f"{entry.value} of {package} is no bench.protocol.Protocol"
        raise InvalidInput(item, entry.name, told)
    return cast("Protocol[Any]", found)
