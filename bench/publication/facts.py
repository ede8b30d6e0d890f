"""Tables of what is known by name: facts, declared parameters with their units."""

import re
from collections.abc import Iterator, Mapping
from typing import Any, cast

from bench.config.declared import declared
from bench.publication.numbers import ABSENT, plain
from bench.publication.typography import typeset, unit_text
from bench.report.page.document import Column, Table
from sim.parameters import Parameters

EXACT = 10
"""Significant digits of a parameter: as it was typed."""

_DETAIL = (" (", "; ", ": ")
"""Where the first words of a description end and the details begin."""

_NAME = re.compile(r"(?<=[a-z]{4})_(?=[a-z]{3})")
"""Where a description names another parameter, such as heating_time; a symbol such as h_b is none."""


def facts_table(caption: str, facts: Mapping[str, str]) -> Table:
    """Names and texts."""
    rows = [[name, value] for name, value in facts.items()]
    return Table(caption, [Column("item", words=True), Column("value", words=True)], rows)


def parameters_table(caption: str, kind: type[Parameters] | None, values: Mapping[str, Any]) -> Table:
    """Parameters as they were declared: what each is, its name for programs, value and unit.

    What is not declared, as in a file of another version, stands below with its name alone.
    """
    rows = list(_declared_rows(kind, values, "")) if kind is not None else []
    known = {row[1] for row in rows}
    rows += [[ABSENT, name, text, ""] for name, text in flat(values).items() if name not in known]
    columns = [
        Column("parameter", words=True),
        Column("name", words=True),
        Column("value", words=True),
        Column("unit", words=True),
    ]
    return Table(caption, columns, rows)


def words_of(description: str) -> str:
    """What a declared parameter is, in its description's first words."""
    ends = [at for mark in _DETAIL if (at := description.find(mark)) > 0]
    return typeset(_NAME.sub(" ", description[: min(ends, default=len(description))]))


def flat(values: Mapping[str, Any]) -> dict[str, str]:
    """Nested values as texts, names joined by dots."""
    found: dict[str, str] = {}
    for name, value in values.items():
        if isinstance(value, dict):
            found |= {f"{name}.{key}": text for key, text in flat(cast(dict[str, Any], value)).items()}
        else:
            found[name] = _text(value)
    return found


def _declared_rows(kind: type[Parameters], values: Mapping[str, Any], prefix: str) -> Iterator[list[str]]:
    for entry in declared(kind):
        value = values.get(entry.name)
        if entry.name not in values:
            continue
        if entry.group is not None and isinstance(value, dict):
            yield from _declared_rows(entry.group, cast(dict[str, Any], value), f"{prefix}{entry.name}.")
            continue
        unit = unit_text(entry.unit) if value is not None else ""
        yield [words_of(entry.description) or ABSENT, f"{prefix}{entry.name}", _text(value), unit]


def _text(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(_text(item) for item in cast(list[Any], value)) or ABSENT
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return plain(value, EXACT)
    return ABSENT if value is None else str(value)
