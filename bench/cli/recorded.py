"""The experiment that a file was recorded with, from what the file says of itself."""

import json
from typing import TYPE_CHECKING, Any

from bench.cli.catalogue import CATALOGUE, Entry
from bench.cli.check import CHECK
from bench.config.validation import dotted, validated
from sim.errors import InvalidInput
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.record.reader import Record
    from bench.session import Experiment


def entry_of(record: "Record") -> Entry:
    """The protocol of an open file. Raises InvalidInput for one that this software does not have."""
    entries = {entry.name: entry for entry in (*CATALOGUE, CHECK)}
    name = record.metadata.get("protocol")
    if name not in entries:
        raise InvalidInput("protocol of the record", name, "this software knows " + ", ".join(entries))
    return entries[name]


def experiment_of(record: "Record", entry: Entry, parameters: Parameters) -> "Experiment":
    """The experiment with `parameters`; what it read of other files comes from the open file."""
    from bench.session import Sourced

    experiment = entry.campaign(parameters)
    if isinstance(experiment, Sourced):
        experiment.restore(record.tables)
    return experiment


def declared_parameters(record: "Record") -> type[Parameters] | None:
    """How the parameters of the file's protocol are declared; None where this software does not have it."""
    try:
        return entry_of(record).parameters
    except InvalidInput:
        return None


def parameters_of(record: "Record", entry: Entry, changed: dict[str, Any] | None = None) -> Parameters:
    """What was asked for, with some of it `changed`. Raises InvalidInput for what this version does not know."""
    stored = json.loads(record.metadata["parameters"])
    return validated(entry.parameters, stored | (changed or {}), lambda path: f"{entry.name}: {dotted(path)}")
