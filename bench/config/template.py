"""Configurations written as TOML: templates with comments, and complete configurations."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import tomlkit

from bench.config.backend import RigSettings, load_backend
from bench.config.declared import Declared, at, declared, summary
from bench.config.model import BenchConfiguration
from bench.config.toml import Kind
from sim.errors import InvalidInput
from sim.parameters import Parameters


def as_toml(configuration: BenchConfiguration) -> str:
    """All keys with a value, as TOML. For the backend "hardware", the table `simulation` is omitted; for a backend of
    another package, `hardware` and `simulation` are.
    """
    unused = {"rig": {"hardware", "simulation"}, "hardware": {"simulation"}}.get(configuration.table, set[str]())
    plain: dict[str, Any] = configuration.model_dump(mode="json", exclude_none=True, exclude=unused)
    return tomlkit.dumps(plain)


_HEADING = """\
# Configuration of a shake-table bench for rockbench. SI units; a value in another unit is a string: "60 mm". Every key
# is optional; its meaning [unit] and valid values are above it. To validate: `rockbench config check`."""

_ALL = """\
# Every key with its default. A line that begins with # and no space is an example of a key that is absent by default:
# remove the # to set the key; each line is valid by itself."""

_MINIMAL = """\
# The keys to check before the first run; every other key has its default (`rockbench config init` writes them all)."""

_HARDWARE = """\
# A bench with an NI device and two optoNCDT 1420 lasers: replace terminals, lines, ports and calibrations with yours,
# and remove parts that are not wired. `rockbench devices` finds the devices, `rockbench check` checks the loop."""

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
"""Values in the hardware template for keys without a usable default."""

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


def write_template(path: Path, kind: Kind = "all", backend: str | None = None) -> None:
    """Write a template of the given `kind`, or one for the `backend` of another package.

    Raises InvalidInput if there is no such backend, or if `path` exists or cannot be written.
    """
    if backend is not None:
        settings = load_backend(backend).settings
        if not issubclass(settings, RigSettings):
            raise InvalidInput("--backend", backend, "this backend is built in: omit --backend, or use --hardware")
        lines = [*_chosen(["backend", *_FRAME_AND_BLOCK, *_LIMITS], {"backend": backend}), "", "[rig]"]
        lines += _lines(settings, ("rig",))
    elif kind == "all":
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
        raise InvalidInput("configuration file", str(path), "the file exists and is never overwritten") from None
    except OSError as error:
        raise InvalidInput("configuration file", str(path), f"the file cannot be written: {error.strerror}") from None


def _lines(model: type[Parameters], path: tuple[str, ...]) -> Iterator[str]:
    """The lines of a table: first its values, then groups absent by default, then nested tables."""
    entries = list(declared(model))
    for entry in entries:
        if entry.group is None:
            yield from _value_lines(entry)
    for entry in entries:
        if entry.group is Parameters:
            yield ""
            yield f"# [{entry.name}]: {entry.description}"
        elif entry.group is not None and entry.optional:
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
    """The lines of a group that is absent by default, with dotted keys so that each line stays in its table."""
    yield f"# {prefix}: {of.description or summary(group)}"
    required = any(field.is_required() for field in group.model_fields.values())
    for entry in declared(group):
        if entry.group is not None:
            yield from _absent(entry.group, entry, f"{prefix}.{entry.name}")
        elif required:
            yield f"# {prefix}.{entry.name}, written by a run: {_meaning(entry)}"
        else:
            yield from _value_lines(entry, f"{prefix}.", "#")


def _value_lines(entry: Declared, prefix: str = "", mark: str = "") -> Iterator[str]:
    if entry.default is None and entry.example is None:
        yield f"# {prefix}{entry.name}, not to be set here: {_meaning(entry)}"
        return
    yield f"# {_meaning(entry)}"
    if entry.default is None:
        yield f"#{prefix}{entry.name} = {_as_toml(entry.example)}  # example"
    else:
        yield f"{mark}{prefix}{entry.name} = {_as_toml(list(entry.default) if entry.many else entry.default)}"


def _chosen(keys: list[str], given: Mapping[str, Any]) -> Iterator[str]:
    """The lines of selected keys, by table, with the value in `given` or else the default."""
    table = ""
    # keys of a table before those of its nested tables, tables in the order of their first key
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
