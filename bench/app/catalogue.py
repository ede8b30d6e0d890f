"""The installed protocols, export formats and rig backends, and the protocol of a data file."""

import json
from collections.abc import Sequence
from types import NoneType
from typing import TYPE_CHECKING, Any, cast, get_args

from bench.config.backend import RigBackend, backend_names, load_backend
from bench.plugins import load_plugin, plugin_names
from sim.errors import InvalidInput

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

    from bench.datafile.reader import DataFile
    from bench.protocol import Protocol
    from sim.parameters import Parameters

PROTOCOLS, EXPORTS = "rockbench.protocols", "rockbench.exports"
"""Entry-point groups of protocols and of export formats."""

CHECK = "check"
"""The protocol that has a top-level command instead of `rockbench run`."""


def protocol_names() -> tuple[str, ...]:
    """Names of all installed protocols, in alphabetical order; none is loaded."""
    return plugin_names(PROTOCOLS)


def load_protocol(name: str, item: str = "protocol") -> "Protocol[Any]":
    """The protocol `name`. Raises InvalidInput, naming `item`, if the protocol is not installed or fails to load."""
    from bench.protocol import Protocol

    return cast("Protocol[Any]", load_plugin(PROTOCOLS, name, item, Protocol))


def all_protocols() -> "tuple[Sequence[Protocol[Any]], Sequence[str]]":
    """Every protocol that loads, in alphabetical order, and an error line for each that does not."""
    found: list[Protocol[Any]] = []
    failed: list[str] = []
    for name in protocol_names():
        try:
            found.append(load_protocol(name))
        except InvalidInput as refused:
            failed.append(str(refused))
    return found, failed


def all_backends() -> tuple[dict[str, RigBackend], Sequence[str]]:
    """Every rig backend that loads, by name in alphabetical order, and an error line for each that does not."""
    found, failed = dict[str, RigBackend](), list[str]()
    for name in backend_names():
        try:
            found[name] = load_backend(name)
        except InvalidInput as refused:
            failed.append(str(refused))
    return found, failed


def format_names() -> tuple[str, ...]:
    """Names of all installed export formats, in alphabetical order; none is loaded."""
    return plugin_names(EXPORTS)


def protocol_of(record: "DataFile") -> "Protocol[Any]":
    """The protocol of an open data file. Raises InvalidInput if it is not installed or fails to load."""
    return load_protocol(record.metadata.get("protocol", ""), "protocol of the data file")


def installed_protocol(record: "DataFile") -> "Protocol[Any] | None":
    """The protocol of an open data file; None if it is not installed or fails to load."""
    try:
        return protocol_of(record)
    except InvalidInput:
        return None


def parameters_of(record: "DataFile", protocol: "Protocol[Any]", changed: dict[str, Any] | None = None) -> "Parameters":
    """The stored parameters of a run, updated with `changed`. Raises InvalidInput for parameters that this version does
    not accept.

    A parameter that may be None, and is missing from the file of an earlier version, is set to None instead of its
    default: the run is then repeated without it.
    """
    from bench.config.validation import dotted, validated

    stored = json.loads(record.metadata["parameters"])
    fields = protocol.parameters.model_fields
    optional = [name for name, field in fields.items() if field.default is not None and _may_be_absent(field)]
    stored = dict.fromkeys(optional) | stored
    return validated(protocol.parameters, stored | (changed or {}), lambda path: f"{protocol.name}: {dotted(path)}")


def _may_be_absent(field: "FieldInfo") -> bool:
    return NoneType in get_args(field.annotation)
