"""Configuration files to begin with: every key, what a person must look at, or a bench with NI and optoNCDT devices.

Written from the declarations, so that keys, units, limits and defaults are those of the program. A line that is
commented out is complete by itself: taking its # away gives the key, wherever it stands.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

import tomlkit

from bench.config.declared import Declared, at, declared, summary
from bench.config.model import BenchConfiguration
from sim.errors import InvalidInput
from sim.parameters import Parameters

Kind = Literal["all", "minimal", "hardware"]

_HEADING = """\
# Configuration of a shake-table bench for rockbench. SI units; a value in another is a text with its unit: "60 mm".
# Every key is optional; above it: what it is [unit], and what it may be. `rockbench config check` reads it again."""

_ALL = """\
# Every key stands here with its default. A line that begins with #, without a space, is absent by default, and shows an
# example: take the # away to give it; each works by itself."""

_MINIMAL = """\
# What to look at before the first run; every other key has its default (`rockbench config init` writes them all)."""

_HARDWARE = """\
# A bench with an NI device and two optoNCDT 1420 lasers: replace terminals, lines, ports and calibrations by yours, and
# leave out what is not wired. `rockbench devices` finds the devices, `rockbench check` checks the loop."""

_FRAME_AND_BLOCK = [
    *(f"specimen.frame.{key}" for key in ("h1", "h2", "m1", "m2", "k1", "k2", "xi1", "xi2")),
    *(f"specimen.block.{key}" for key in ("b", "h_b", "s", "rho")),
]
_LIMITS = [
    f"limits.{key}"
    for key in ("drive_voltage", "displacement", "velocity", "acceleration", "force", "current", "heating", "drift")
]
_WIRED = {
    "hardware.moving_mass": 50.0,
    "hardware.force_constant": 50.0,
    "hardware.daq.watchdog": 1.0,
    "hardware.daq.amplifier_ready.delay": 1.0,
    "hardware.laser_1.port": "COM5",
    "hardware.laser_2.port": "COM6",
}
"""What a bench has that the program cannot know."""

_DEVICES = [
    *(f"hardware.{key}" for key in ("sample_rate", "half_stroke", "band_low", "band_high")),
    *("hardware.moving_mass", "hardware.force_constant"),
    *(f"hardware.daq.{key}" for key in ("output", "output_range", "enable_line", "watchdog")),
    *("hardware.daq.emergency_stop.line", "hardware.daq.emergency_stop.good"),
    *("hardware.daq.over_travel.line", "hardware.daq.over_travel.good"),
    *("hardware.daq.amplifier_ready.line", "hardware.daq.amplifier_ready.good", "hardware.daq.amplifier_ready.delay"),
    *(f"hardware.table_displacement.{key}" for key in ("terminal", "wiring", "range", "sensitivity", "zero")),
    *(f"hardware.table_acceleration.{key}" for key in ("terminal", "wiring", "range", "sensitivity", "zero")),
    *(f"hardware.lasers.{key}" for key in ("connection", "reference", "rate", "delay")),
    *(f"hardware.laser_1.{key}" for key in ("port", "measuring_range", "polarity")),
    *(f"hardware.laser_2.{key}" for key in ("port", "measuring_range", "polarity")),
]


def write_template(path: Path, kind: Kind = "all") -> None:
    """Write a configuration file to begin with. Raises InvalidInput when `path` exists or cannot be written."""
    if kind == "all":
        lines = [_ALL, "", *_lines(BenchConfiguration, ())]
    elif kind == "minimal":
        lines = [_MINIMAL, "", *_chosen(["backend", *_FRAME_AND_BLOCK, "specimen.d", *_LIMITS], {})]
    else:
        given = {"backend": "hardware", **_WIRED}
        lines = [_HARDWARE, "", *_chosen(["backend", *_FRAME_AND_BLOCK, *_LIMITS, *_DEVICES], given)]
    text = "\n".join([_HEADING, *lines]) + "\n"
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise InvalidInput("configuration file", str(path), "it exists already; it is never overwritten") from None
    except OSError as error:
        raise InvalidInput("configuration file", str(path), f"it cannot be written: {error.strerror}") from None


def _lines(model: type[Parameters], path: tuple[str, ...]) -> Iterator[str]:
    """The lines of a table: its values, those of the groups that are absent by default, then its nested tables."""
    entries = list(declared(model))
    for entry in entries:
        if entry.group is None:
            yield from _value_lines(entry)
    for entry in entries:
        if entry.group is not None and entry.optional:
            yield ""
            yield from _absent(entry.group, entry, entry.name)
    for entry in entries:
        if entry.group is not None and not entry.optional:
            yield ""
            if entry.description:
                yield f"# {entry.description}"
            yield f"# {summary(entry.group)}"
            yield f"[{'.'.join((*path, entry.name))}]"
            yield from _lines(entry.group, (*path, entry.name))


def _absent(group: type[Parameters], of: Declared, prefix: str) -> Iterator[str]:
    """The lines of a group that is absent: its keys dotted, so that each belongs to the table in which it stands."""
    yield f"# {prefix}: {of.description or summary(group)}"
    required = any(field.is_required() for field in group.model_fields.values())
    for entry in declared(group):
        if entry.group is not None:
            yield from _absent(entry.group, entry, f"{prefix}.{entry.name}")
        elif required:
            yield f"# {prefix}.{entry.name}, which a run writes: {_meaning(entry)}"
        else:
            yield from _value_lines(entry, f"{prefix}.", "#")


def _value_lines(entry: Declared, prefix: str = "", mark: str = "") -> Iterator[str]:
    if entry.default is None and entry.example is None:
        yield f"# {prefix}{entry.name}, not to be given here: {_meaning(entry)}"
        return
    yield f"# {_meaning(entry)}"
    if entry.default is None:
        yield f"#{prefix}{entry.name} = {_as_toml(entry.example)}  # example"
    else:
        yield f"{mark}{prefix}{entry.name} = {_as_toml(list(entry.default) if entry.many else entry.default)}"


def _chosen(keys: list[str], given: Mapping[str, Any]) -> Iterator[str]:
    """The lines of some keys, table by table, with what is `given` or the default."""
    table = ""
    # the keys of a table before those of the tables within it, the tables in the order of their first key
    for key in sorted(keys, key=lambda key: [other.rpartition(".")[0] for other in keys].index(key.rpartition(".")[0])):
        parent, _, name = key.rpartition(".")
        entry = at(BenchConfiguration, key.split("."))
        if entry is None:
            raise KeyError(key)
        if parent != table:
            table, group = parent, at(BenchConfiguration, parent.split("."))
            yield ""
            if group is not None and group.group is not None:
                yield f"# {group.description or summary(group.group)}"
            yield f"[{parent}]"
        yield f"# {_meaning(entry)}"
        yield f"{name} = {_as_toml(given.get(key, entry.default))}"


def _meaning(entry: Declared) -> str:
    unit = f" [{entry.unit}]" if entry.unit else ""
    return f"{entry.description}{unit}; {entry.allowed}"


def _as_toml(value: Any) -> str:
    return str(tomlkit.item(value).as_string())  # pyright: ignore[reportUnknownMemberType, reportUnknownArgumentType]
