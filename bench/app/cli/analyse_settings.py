"""Settings of a re-analysis from the command line and from a file, checked against the data file."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from bench.figures.text_table import TextColumn, text_table
from sim.errors import InvalidInput
from sim.identified import spring_name
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.config.declared import Declared
    from bench.config.model import BenchConfiguration
    from bench.datafile.reader import DataFile
    from bench.protocol import Follower, Protocol

SECTIONS = ("analysis", "specimen", "uncertainty")
"""Configuration tables that affect the analysis of a measurement but not the drive of the bench."""

LIST = "--list shows all of them with their values and units"


@dataclass(frozen=True)
class Choice:
    """Inputs of a re-analysis.

    recorded, changed : configuration in the file, without and with the new settings.
    asked, settings : parameters of the campaign, and those of the analysis.
    given : value of each new setting, by name.
    follower : constructor of the re-analysis that the protocol defines; None for any other protocol, which is executed
        again with `settings` as its parameters.
    """

    protocol: "Protocol[Any]"
    recorded: "BenchConfiguration"
    changed: "BenchConfiguration"
    asked: Parameters
    settings: Parameters
    given: Mapping[str, Any]
    follower: "Callable[[], Follower] | None" = None


def choice_of(record: "DataFile", changes: Sequence[str], config: Path | None, specimen: Path | None = None) -> Choice:
    """The settings of a re-analysis of an open data file. The recorded settings are overridden in turn by `config`,
    `specimen` and `changes` (KEY=VALUE).

    Raises InvalidInput for unknown settings and for settings that the measurement has fixed.
    """
    from bench.app.catalogue import parameters_of, protocol_of
    from bench.config.declared import at
    from bench.config.model import BenchConfiguration
    from bench.config.validation import dotted, validated
    from bench.replay.session import stored_configuration

    protocol, recorded = protocol_of(record), stored_configuration(record)
    asked, reanalysis = parameters_of(record, protocol), protocol.reanalysis
    data: dict[str, Any] = recorded.model_dump(mode="json")
    given = _from_file(config, recorded) if config is not None else {}
    if specimen is not None:
        from bench.config.result_files import read_specimen

        given["identified"] = read_specimen(specimen).model_dump(mode="json")
    data |= given
    own: dict[str, Any] = {}
    settings_type = protocol.parameters if reanalysis is None else reanalysis.settings
    for change in changes:
        key, equals, text = change.partition("=")
        if not (key and equals):
            raise InvalidInput("--set", change, f"it must be KEY=VALUE; {LIST}")
        section, *path = key.split(".")
        model = BenchConfiguration if path else settings_type
        value = given[key] = _value(at(model, tuple(key.split("."))), text)
        if section in SECTIONS and path:
            _put(data, [section, *path], value)
        elif path:
            tables = ", ".join(SECTIONS)
            raise InvalidInput(f"--set {key}", value, f"only the configuration tables {tables} can be changed; {LIST}")
        else:
            own[key] = value
    _require_known(own, settings_type)

    def named(path: tuple[str | int, ...]) -> str:
        return f"--set {dotted(path)}"

    changed = validated(BenchConfiguration, data, named)
    if changed.identified is not None:
        # explicit settings override identified properties
        by_hand = (key.rpartition(".")[2] for key in given if key.startswith("specimen."))
        changed = changed.model_copy(update={"identified": changed.identified.without(*by_hand)})
    if reanalysis is None:
        return Choice(protocol, recorded, changed, asked, parameters_of(record, protocol, own), given)
    settings = validated(reanalysis.settings, own, named)

    def follower() -> "Follower":
        return reanalysis.follower(settings, asked, changed, record)

    return Choice(protocol, recorded, changed, asked, settings, given, follower)


def unusual_of(choice: Choice) -> tuple[str, ...]:
    """Notices about unusual settings, without those that were already unusual in the recording."""
    from bench.config.review import review
    from bench.config.usual import notices_of

    before = set(review(choice.recorded).notices)
    new = [notice for notice in review(choice.changed).notices if notice not in before]
    return (*new, *notices_of(choice.settings, choice.changed.known_specimen))


def settings_of(choice: Choice) -> dict[str, dict[str, Any]]:
    """Every changeable setting by key: present value (`now`), `unit` and `description`."""
    from bench.config.declared import at, keys

    found: dict[str, dict[str, Any]] = {}
    groups: list[tuple[str, Parameters]] = [("", choice.settings)]
    groups += [(f"{name}.", getattr(choice.changed, name)) for name in SECTIONS]
    for prefix, group in groups:
        for key in keys(type(group)):
            path = key.split(".")
            entry = at(type(group), tuple(path))
            if entry is not None and entry.group is None:
                now = json.loads(json.dumps(reduce(getattr, path, group), default=str))
                found[f"{prefix}{key}"] = {"now": now, "unit": entry.unit, "description": entry.description}
    return found


def listed(choice: Choice) -> str:
    """Text table of `settings_of`."""
    columns = (
        TextColumn("key", words=True),
        TextColumn("now"),
        TextColumn("unit", words=True),
        TextColumn("meaning", words=True),
    )
    rows = (
        (key, json.dumps(each["now"]), each["unit"], each["description"]) for key, each in settings_of(choice).items()
    )
    return text_table(columns, rows)


def _require_known(own: Mapping[str, Any], kind: type[Parameters]) -> None:
    """Raise InvalidInput for an unknown setting; the message lists the known ones."""
    for key, value in own.items():
        if key not in kind.model_fields:
            near = get_close_matches(key, kind.model_fields, n=1)
            nearest = f"the nearest is {near[0]}; " if near else ""
            tables = ", ".join(f"{name}.KEY" for name in SECTIONS)
            known = ", ".join(kind.model_fields)
            raise InvalidInput(f"--set {key}", value, f"{nearest}the keys are {known}, and {tables}: {LIST}")


def _from_file(config: Path, recorded: "BenchConfiguration") -> dict[str, Any]:
    """The sections of a configuration file that differ from the recorded ones.

    A file without identified properties keeps the recorded ones, except those whose assumed values it changes.
    """
    from bench.config.toml import read_configuration

    read = read_configuration(config)
    if read.identified is None and recorded.identified is not None:
        groups = ((read.specimen.frame, recorded.specimen.frame), (read.specimen.block, recorded.specimen.block))
        changed = [
            name for new, old in groups for name in new.model_fields_set if getattr(new, name) != getattr(old, name)
        ]
        changed += [spring_name(each.label) for each in read.specimen.springs if each not in recorded.specimen.springs]
        read = read.model_copy(update={"identified": recorded.identified.without(*changed)})
    other, data = read.model_dump(mode="json"), recorded.model_dump(mode="json")
    return {name: other[name] for name in (*SECTIONS, "identified") if other[name] != data[name]}


def _value(entry: "Declared | None", text: str) -> Any:
    """Parse a value: a number in the common notation, else JSON (lists, true, null), else plain text."""
    if entry is not None and entry.kind in (int, float):
        from bench.config.validation import read_typed

        typed = read_typed(entry, text)
        if not any(isinstance(each, str) for each in (typed if entry.many else [typed])):
            return typed
    try:
        return json.loads(text)
    except (json.JSONDecodeError, RecursionError):
        return text


def _put(data: dict[str, Any], path: Sequence[str], value: Any) -> None:
    *groups, last = path
    for name in groups:
        inner: Any = data.get(name)
        if not isinstance(inner, dict):
            raise InvalidInput("--set", ".".join(path), f"there is no table {name} in the configuration")
        data = cast(dict[str, Any], inner)
    data[last] = value
