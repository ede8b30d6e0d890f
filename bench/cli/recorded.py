"""The protocol that a file was recorded with, from what the file says of itself."""

import json
from typing import TYPE_CHECKING, Any

from bench.catalogue import load_protocol
from bench.config.validation import dotted, validated
from sim.errors import InvalidInput
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.protocol import Protocol
    from bench.record.reader import Record


def protocol_of(record: "Record") -> "Protocol[Any]":
    """The protocol of an open file. Raises InvalidInput for one that is not installed here."""
    return load_protocol(record.metadata.get("protocol", ""), "protocol of the record")


def installed_protocol(record: "Record") -> "Protocol[Any] | None":
    """The protocol of an open file; None where it is not installed here."""
    try:
        return protocol_of(record)
    except InvalidInput:
        return None


def parameters_of(record: "Record", protocol: "Protocol[Any]", changed: dict[str, Any] | None = None) -> Parameters:
    """What was asked for, with some of it `changed`. Raises InvalidInput for what this version does not know."""
    stored = json.loads(record.metadata["parameters"])
    return validated(protocol.parameters, stored | (changed or {}), lambda path: f"{protocol.name}: {dotted(path)}")
