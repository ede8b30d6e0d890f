"""Plug-ins by entry points: protocols, rigs and export formats of this program and of other packages.

An entry point is loaded when it is used. If it fails to load, the error names it, its package and the reason; the
others are not affected.
"""

import sys
import traceback
from collections.abc import Generator
from contextlib import contextmanager
from functools import lru_cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from pathlib import Path
from typing import TypeVar

from sim.errors import Cause, Interruption, InvalidInput, RockbenchError

T = TypeVar("T")
Y = TypeVar("Y")
S = TypeVar("S")
R = TypeVar("R")


class PluginFailed(RockbenchError):
    """The code of the plug-in `name` raised an exception other than this program's errors."""

    error_code = "plug_in"

    def __init__(self, name: str, what: str) -> None:
        super().__init__(f"{name} failed: {what}; repair or remove it")
        self.name = name

    @property
    def cause(self) -> Cause:
        """The error code, with the name of the plug-in as subject."""
        return Cause(self.error_code, self.name)


@contextmanager
def plugin_code(name: str, *, files: bool = False) -> Generator[None]:
    """Context manager that converts exceptions in the code of the plug-in `name` to PluginFailed, with the line that
    raised them; while the plug-in writes `files`, errors of the operating system are passed on.
    """
    try:
        yield
    except (RockbenchError, MemoryError, Interruption):
        raise
    except Exception as error:
        if files and isinstance(error, OSError):
            raise
        text = " ".join(str(error).split())
        frame = traceback.extract_tb(error.__traceback__)[-1]
        raised = f"{type(error).__name__}: {text}" if text else type(error).__name__
        raise PluginFailed(name, f"{raised} ({Path(frame.filename).name}, line {frame.lineno})") from error


def plugin_generator(name: str, code: Generator[Y, S, R]) -> Generator[Y, S, R]:
    """The plug-in's generator, with its exceptions converted like those in `plugin_code`."""
    with plugin_code(name):
        return (yield from code)


def plugin_names(group: str) -> tuple[str, ...]:
    """Names of all plug-ins of a group, in alphabetical order, without loading them."""
    return tuple(sorted(_entries(group)))


def load_plugin(group: str, name: str, item: str, kind: type[T]) -> T:
    """Load the plug-in `name` of a group, an instance of `kind`.

    Raises InvalidInput if it is not installed or fails to load; the message names the option or key `item`.
    """
    entries = _entries(group)
    if name not in entries:
        raise InvalidInput(item, name, f"one of {', '.join(sorted(entries))}")
    entry = entries[name]
    try:
        found = entry.load()
    except Exception as error:
        reason = " ".join(str(error).split()) or "no reason given"
        remedy = f"{_origin(entry)} cannot be loaded ({type(error).__name__}: {reason}); repair or uninstall it"
        raise InvalidInput(item, name, remedy) from error
    if not isinstance(found, kind):
        raise InvalidInput(item, name, f"{_origin(entry)} is not a {kind.__module__}.{kind.__qualname__}")
    return found


def _origin(entry: EntryPoint) -> str:
    # `entry.dist` reads the metadata of the package from the disk
    package = "an unknown package" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"
    return f"{entry.value} of {package}"


def _entries(group: str) -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in _on_path(group, tuple(sys.path))}


@lru_cache(maxsize=8)
def _on_path(group: str, _path: tuple[str, ...]) -> EntryPoints:
    """Entry points of `group` in all packages on the path; cached, so that the metadata are read only once."""
    return entry_points(group=group)
