"""Pages of docs/reference, written from the program's declarations: `python -m tests.pages.reference --write`.

Without `--write` the names of the pages that differ from the program are printed, and the exit code is then 1.
"""

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from inspect import getdoc
from pathlib import Path
from typing import Any

from cyclopts import App

import bench.events
import bench.findings
import bench.live_values
from bench.app.catalogue import CHECK, all_protocols
from bench.app.cli.main import COMMANDS, GROUPS, rockbench_app
from bench.app.formatting import as_typed
from bench.config.backend import RigSettings
from bench.config.declared import Declared, declared
from bench.config.model import BenchConfiguration
from bench.datafile.declared import EVENT_TABLES, event_tables
from bench.datafile.fields import Field, fields_of
from bench.events import Event
from bench.protocol import Protocol
from sim.parameters import Parameters
from tests.pages.blocks import ROOT

FOLDER = ROOT / "docs" / "reference"
COMMAND = "uv run --dev python -m tests.pages.reference --write"

_CONFIGURATION = """\
# Configuration keys

Every key of a configuration file, with its unit, default and valid values; a key without a default is absent. The
notation of numbers and units and the cross-checks are in [configuration](../configuration.md)."""

_COMMANDS = """\
# Commands

Every command of `rockbench` with its arguments and options; `--help` of a command prints the same.

Exit codes: 0 done; 1 failed or aborted; 2 refused before anything started; 130 ended by Ctrl-C."""

_RUN = """
## rockbench run

`rockbench run PROTOCOL` carries out a protocol. Every protocol has the following options, and one for each of its
[parameters](protocols.md)."""

_CHECK = "\nOptions: those of [`rockbench run`](#rockbench-run) and the [parameters of the check](protocols.md#check)."

_PROTOCOLS = """\
# Protocols

Parameters and results of every protocol. A parameter is an option of the command, with `-` in place of `_`, and a key
of a protocol file. A column of the points is a dataset in `/entry/points` of the [data file](../file-format.md)."""

SHARED = (bench.events, bench.live_values, bench.findings)
"""Modules with the events of all protocols."""

_EVENTS = """\
# Events

Events of a run, in the order of their declaration. Those marked in the column *journal* have a line in
`/entry/events` of the [data file](../file-format.md) and in `campaign.events.jsonl`. The tables of that file follow."""


def pages() -> Mapping[str, str]:
    """The text of every generated page, by file name."""
    protocols = [each for each in all_protocols()[0] if each.parameters.__module__.startswith("protocols.")]
    check = next(each for each in protocols if each.name == CHECK)
    made = {
        "configuration.md": _configuration(),
        "commands.md": _commands(rockbench_app(), check),
        "protocols.md": _protocols(protocols),
        "events.md": _events(protocols),
    }
    note = f"<!-- written by `{COMMAND}`: do not edit -->\n\n"
    return {name: note + "\n".join(lines) + "\n" for name, lines in made.items()}


def stale() -> list[str]:
    """The names of the pages that differ from the program."""
    written = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.glob("*.md")}
    return [name for name, text in pages().items() if written.get(name) != text]


def main() -> int:
    """Write or compare the pages, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.pages.reference", description=__doc__)
    parser.add_argument("--write", action="store_true", help="replace the pages by those of the program")
    if parser.parse_args().write:
        FOLDER.mkdir(exist_ok=True)
        for name, text in pages().items():
            Path(FOLDER / name).write_text(text, encoding="utf-8", newline="\n")
        return 0
    differing = stale()
    print("\n".join(differing))
    return 1 if differing else 0


def _configuration() -> Iterator[str]:
    yield _CONFIGURATION
    yield from _group(BenchConfiguration, "Top level", "", {})
    yield "\n## `[rig]`\n\nKeys of every backend of another package, which adds its own ([extending](../extending.md))."
    yield from _parameters(declared(RigSettings))


def _group(model: type[Parameters], heading: str, path: str, done: dict[type[Parameters], str]) -> Iterator[str]:
    """The values of a group of keys, then those of the groups within it; `done` has the headings of those before."""
    entries = list(declared(model))
    if (before := done.setdefault(model, heading)) != heading:
        yield f"\n## {heading}\n\nKeys as in {before}."
        return
    if values := [entry for entry in entries if entry.element is None]:
        yield f"\n## {heading}\n\n{_first_paragraph(model)}"
        yield from _parameters(values)
    for entry in entries:
        if entry.element is not None and entry.element is not Parameters:
            inner = f"{path}.{entry.name}".lstrip(".")
            yield from _group(entry.element, f"`[[{inner}]]`" if entry.many else f"`[{inner}]`", inner, done)


def _commands(app: App, check: Protocol[Any]) -> Iterator[str]:
    yield _COMMANDS
    purposes = {"run": GROUPS["run"][0], **{path: purpose for path, (_, purpose, _) in COMMANDS.items()}}
    links = {f"[`{path}`](#rockbench-{path.replace(' ', '-')})": purpose for path, purpose in purposes.items()}
    yield from _table(("command", "purpose"), links.items())
    yield _RUN
    own = {f"`--{name.replace('_', '-')}`" for name in check.parameters.model_fields}
    yield from _table(("option", "meaning", "default"), (row for row in _options(app["check"]) if row[0] not in own))
    for path, (_, _, example) in COMMANDS.items():
        command = app
        for word in path.split():
            command = command[word]
        yield f"\n## rockbench {path}"
        for paragraph in (getdoc(command.default_command) or "").split("\n\n"):
            if not paragraph.startswith("The exit code"):
                yield "\n" + " ".join(paragraph.split())
        if example:
            yield f"\nExample: `rockbench {path} {example}`"
        if path == CHECK:
            yield _CHECK
        else:
            yield from _table(("option", "meaning", "default"), _options(command))


def _options(command: App) -> Iterator[tuple[str, str, str]]:
    for each in command.assemble_argument_collection():
        if each.show:
            shown, default = each.parameter.show_default, each.field_info.default
            stated = as_typed(default) if isinstance(default, str | int | float) and shown is not False else ""
            names = ", ".join(f"`{name}`" for name in each.names)
            yield names, str(each.parameter.help or "").rstrip("."), shown if isinstance(shown, str) else stated


def _protocols(protocols: Iterable[Protocol[Any]]) -> Iterator[str]:
    yield _PROTOCOLS
    for protocol in protocols:
        name = protocol.name
        command = name if name == CHECK else f"run {name}"
        files = ", ".join(f"`{file}`" for file in ("campaign.h5", "summary.json", *protocol.figures, *protocol.files))
        yield f"\n## {name}\n\n{protocol.summary}"
        yield f"\nExample: `rockbench {command} {protocol.example}`. Files: {files}."
        yield f"\n### Parameters of {name}"
        yield from _parameters(declared(protocol.parameters))
        yield f"\n### Points of {name}"
        yield from _columns(fields_of(protocol.point))


def _events(protocols: Sequence[Protocol[Any]]) -> Iterator[str]:
    yield _EVENTS
    own = dict.fromkeys(kind for each in protocols for kind in each.event_types)
    members = [each for module in SHARED for each in vars(module).values()]
    modules = [module.__name__ for module in SHARED]
    events = [each for each in members if isinstance(each, type) and issubclass(each, Event) and each is not Event]
    kinds = [*dict.fromkeys(each for each in events if each.__module__ in modules), *own]
    tables = {**EVENT_TABLES, **event_tables(own)}
    links = {kind: f"[`{table.path}`](#entry{table.path.replace('/', '')})" for kind, table in tables.items()}
    rows = (
        (f"`{kind.__name__}`", "yes" if kind.journalled else "", links.get(kind, ""), _first_paragraph(kind))
        for kind in kinds
    )
    yield from _table(("event", "journal", "table", "meaning"), rows)
    for kind, table in tables.items():
        of = [f"`{each.name}`" for each in protocols if kind in each.event_types]
        only = f" Only in files of {' and '.join(of)}." if of else ""
        yield f"\n## /entry/{table.path}\n\nRows of `{kind.__name__}`.{only}"
        yield from _columns(table.fields)


def _parameters(entries: Iterable[Declared]) -> Iterator[str]:
    rows = ((f"`{e.name}`", e.unit, _default(e), e.description, e.allowed) for e in entries)
    yield from _table(("key", "unit", "default", "meaning", "valid values"), rows)


def _default(entry: Declared) -> str:
    if entry.default is None:
        return ""
    return " ".join(map(as_typed, entry.default)) if entry.many else as_typed(entry.default)


def _columns(columns: Iterable[Field]) -> Iterator[str]:
    rows = ((f"`{c.name}`", c.unit, f"{c.kind}{', optional' * c.optional}", c.description) for c in columns)
    yield from _table(("column", "unit", "type", "meaning"), rows)


def _table(heads: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> Iterator[str]:
    """A Markdown table after an empty line."""
    yield f"\n| {' | '.join(heads)} |\n|{'---|' * len(heads)}"
    yield from (f"| {' | '.join(map(_cell, row))} |" for row in rows)


def _first_paragraph(documented: object) -> str:
    return " ".join((getdoc(documented) or "").split("\n\n")[0].split())


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


if __name__ == "__main__":
    sys.exit(main())
