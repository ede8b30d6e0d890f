"""What a re-analysis is asked for: settings from the command line and from a file, checked against the record."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from bench.report.text_table import TextColumn, text_table
from sim.errors import InvalidInput
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.config.declared import Declared
    from bench.config.model import BenchConfiguration
    from bench.protocol import Follower, Protocol
    from bench.record.reader import Record

SECTIONS = ("analysis", "specimen", "uncertainty")
"""Parts of the configuration that say how the measurement is understood, not how the bench is driven."""

LIST = "--list shows all of them with their values and units"


@dataclass(frozen=True)
class Choice:
    """What is analysed with.

    `asked` is what the campaign was asked for, `settings` what the analysis is; `changed` is the `recorded`
    configuration with other settings, and `given` are those by name. A protocol with an analysis of its own has a
    `follower`; another is carried out again with the settings as its parameters.
    """

    protocol: "Protocol[Any]"
    recorded: "BenchConfiguration"
    changed: "BenchConfiguration"
    asked: Parameters
    settings: Parameters
    given: Mapping[str, Any]
    follower: "Callable[[], Follower] | None" = None


def choice_of(record: "Record", changes: Sequence[str], config: Path | None, specimen: Path | None = None) -> Choice:
    """The settings for an open file: the recorded ones, those of a file, what a file says of the specimen, and
    `changes`, KEY=VALUE, each over the last.

    Raises InvalidInput for what there is not, or what may not be changed after a measurement.
    """
    from bench.cli.recorded import parameters_of, protocol_of
    from bench.config.declared import at
    from bench.config.model import BenchConfiguration
    from bench.config.validation import dotted, validated
    from bench.replaying.session import stored_configuration

    protocol, recorded = protocol_of(record), stored_configuration(record)
    asked, reanalysis = parameters_of(record, protocol), protocol.reanalysis
    data: dict[str, Any] = recorded.model_dump(mode="json")
    given = _from_file(config, data) if config is not None else {}
    if specimen is not None:
        from bench.config.specimen_file import read_specimen

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
            raise InvalidInput(f"--set {key}", value, f"of the configuration only {tables} can be changed; {LIST}")
        else:
            own[key] = value
    _require_known(own, settings_type)

    def named(path: tuple[str | int, ...]) -> str:
        return f"--set {dotted(path)}"

    changed = validated(BenchConfiguration, data, named)
    if changed.identified is not None:
        # what is set here by hand goes before what was identified
        by_hand = (key.rpartition(".")[2] for key in given if key.startswith("specimen."))
        changed = changed.model_copy(update={"identified": changed.identified.without(*by_hand)})
    if reanalysis is None:
        return Choice(protocol, recorded, changed, asked, parameters_of(record, protocol, own), given)
    settings = validated(reanalysis.settings, own, named)

    def follower() -> "Follower":
        return reanalysis.follower(settings, asked, changed, record)

    return Choice(protocol, recorded, changed, asked, settings, given, follower)


def unusual_of(choice: Choice) -> tuple[str, ...]:
    """Notices of what is unusual in the settings and was not in what was recorded."""
    from bench.config.review import notices_of, review

    before = set(review(choice.recorded).notices)
    new = [notice for notice in review(choice.changed).notices if notice not in before]
    return (*new, *notices_of(choice.settings, choice.changed.known_specimen))


def listed(choice: Choice) -> str:
    """Every setting that can be changed: value as it is now, unit, and what it is."""
    from bench.config.declared import at, keys

    rows: list[tuple[str, str, str, str]] = []
    groups: list[tuple[str, Parameters]] = [("", choice.settings)]
    groups += [(f"{name}.", getattr(choice.changed, name)) for name in SECTIONS]
    for prefix, group in groups:
        for key in keys(type(group)):
            path = key.split(".")
            entry = at(type(group), tuple(path))
            if entry is not None and entry.group is None:
                value = json.dumps(reduce(getattr, path, group), default=str)
                rows.append((f"{prefix}{key}", value, entry.unit, entry.description))
    columns = (
        TextColumn("key", words=True),
        TextColumn("now"),
        TextColumn("unit", words=True),
        TextColumn("meaning", words=True),
    )
    return text_table(columns, rows)


def _require_known(own: Mapping[str, Any], kind: type[Parameters]) -> None:
    """Raise InvalidInput for a setting that is none of the protocol's, with all that there are."""
    for key, value in own.items():
        if key not in kind.model_fields:
            near = get_close_matches(key, kind.model_fields, n=1)
            nearest = f"the nearest is {near[0]}; " if near else ""
            tables = ", ".join(f"{name}.KEY" for name in SECTIONS)
            known = ", ".join(kind.model_fields)
            raise InvalidInput(f"--set {key}", value, f"{nearest}the keys are {known}, and {tables}: {LIST}")


def _from_file(config: Path, data: Mapping[str, Any]) -> dict[str, Any]:
    """The sections of a configuration file that differ from the recorded ones."""
    from bench.config.toml import read_configuration

    other = read_configuration(config).model_dump(mode="json")
    return {name: other[name] for name in (*SECTIONS, "identified") if other[name] != data[name]}


def _value(entry: "Declared | None", text: str) -> Any:
    """Numbers as they are typed everywhere; a list, true, null or the like as JSON has it, else the text itself."""
    if entry is not None and entry.kind in (int, float):
        from bench.config.validation import read_typed

        typed = read_typed(entry, text)
        if not any(isinstance(each, str) for each in (typed if entry.many else [typed])):
            return typed
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


def _put(data: dict[str, Any], path: Sequence[str], value: Any) -> None:
    *groups, last = path
    for name in groups:
        inner: Any = data.get(name)
        if not isinstance(inner, dict):
            raise InvalidInput("--set", ".".join(path), f"there is no table {name} in the configuration")
        data = cast(dict[str, Any], inner)
    data[last] = value
