"""Values of protocol forms, stored as protocol files: named presets, and the values of the last checked plan."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench.config.declared import declared
from bench.config.toml import read_table
from bench.protocol import Protocol
from bench.unfinished import write_new
from sim.errors import InvalidInput

_NAME = re.compile(r"[^\W_](?:[\w ().,=+-]*[\w)+])?")
"""Names that are valid file names on every system, except the reserved ones."""
_RESERVED = re.compile(r"(?:con|prn|aux|nul|(?:com|lpt)[1-9¹²³]) *(?:\..*)?", re.IGNORECASE)
"""Names of devices on Windows, which it also opens under names with an extension."""
_NUMBER = re.compile(r"[+-]?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?")
_LONGEST = 60
LAST = "last-values"
"""Folder of the values of the last checked plans; the folders of presets are named after their protocols."""

Typed = Mapping[str, str | bool | list[str]]
"""Fields of a form as typed; empty ones are absent."""


class Presets:
    """The presets below a folder, which is created when the first one is saved."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def names(self, protocol: str) -> list[str]:
        """Names of the presets of a protocol, sorted."""
        return sorted(path.stem for path in (self._folder / protocol).glob("*.toml"))

    def path(self, protocol: str, name: str) -> Path:
        """File of a preset. Raises InvalidInput for a name that is not allowed."""
        if name.endswith((".", " ")):
            raise InvalidInput("preset", name, "Windows removes a dot or space at the end of a name; omit it")
        if _RESERVED.fullmatch(name):
            allowed = f"Windows reserves this name for a device; choose another one, such as {f'preset {name}'!r}"
            raise InvalidInput("preset", name, allowed)
        if not _NAME.fullmatch(name) or len(name) > _LONGEST:
            allowed = (
                f"use up to {_LONGEST} letters, digits, spaces and ().,=+-_, begin with a letter or digit, and do not "
                "end with a space or one of (.,=-"
            )
            raise InvalidInput("preset", name, allowed)
        return self._folder / protocol / f"{name}.toml"

    def load(self, protocol: str, name: str) -> dict[str, Any]:
        """The unvalidated values of a preset. Raises InvalidInput for a file that cannot be read."""
        return read_table(self.path(protocol, name), "preset")

    def save(self, protocol: Protocol[Any], name: str, typed: Typed) -> Path:
        """Save a preset, replacing one with the same name; returns its file. Raises InvalidInput for a name that is not
        allowed, and RockbenchError if the file cannot be written.
        """
        path = self.path(protocol.name, name)
        _write(path, protocol, typed)
        return path

    def delete(self, protocol: str, name: str) -> None:
        """Delete a preset. Raises InvalidInput if it cannot be deleted."""
        path = self.path(protocol, name)
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise InvalidInput("preset", str(path), f"it cannot be deleted ({error.strerror})") from None

    def last(self, protocol: str) -> dict[str, Any] | None:
        """The unvalidated values of the last checked plan; None if there are none. Raises InvalidInput like `load`."""
        return read_table(self._last(protocol), "last values") if self.has_last(protocol) else None

    def has_last(self, protocol: str) -> bool:
        """Whether the values of a checked plan are stored."""
        return self._last(protocol).exists()

    def keep_last(self, protocol: Protocol[Any], typed: Typed) -> None:
        """Store the values of a checked plan. Raises RockbenchError if the file cannot be written."""
        _write(self._last(protocol.name), protocol, typed)

    def _last(self, protocol: str) -> Path:
        return self._folder / LAST / f"{protocol}.toml"


def _write(path: Path, protocol: Protocol[Any], typed: Typed) -> None:
    many = {entry.name for entry in declared(protocol.parameters) if entry.many}
    values = [f"{name} = {_toml(value, many=name in many)}" for name, value in typed.items()]
    text = "\n".join([f"# rockbench run {protocol.name} --protocol-file FILE", *values, ""])
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput("preset", str(path), f"the folder cannot be created ({error.strerror})") from None
    write_new(path, lambda unfinished: _put(unfinished, text), overwrite=True)


def _put(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _toml(value: str | bool | list[str], *, many: bool) -> str:
    """A typed value in TOML: a number as typed, any other value as a string, which a protocol file also accepts."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return f"[{', '.join(map(_text, value))}]"
    return value if _NUMBER.fullmatch(value) and not many else _text(value)


def _text(text: str) -> str:
    import tomlkit

    return tomlkit.string(text).as_string()
