"""Configuration files: TOML in SI units, fully validated before anything starts; and their templates.

A template has every key, the essential keys, or the keys of a bench with NI and optoNCDT devices. Templates are
generated from the declarations, so that keys, units, limits and defaults are those of the program. Every commented-out
line is complete: removing its # sets the key.
"""

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import tomlkit

from bench.bounded import read_bounded, require_shallow
from bench.config.backend import RigSettings, load_backend
from bench.config.declared import Declared, at, declared, summary
from bench.config.model import BenchConfiguration
from bench.config.result_files import read_calibration, read_specimen
from bench.config.review import review
from bench.config.validation import dotted, former_names, problems, validated
from sim.errors import InvalidInput
from sim.identified import Identified
from sim.parameters import Parameters

_NO_DECIMAL = re.compile(r"""^[ \t]*([\w.-]+)[ \t]*=[^"'#\n]*?(\b0[xob]\w+|\b\d+_\w+)""", re.MULTILINE)
"""A hexadecimal, octal, binary or underscored number in a file, with its key."""


def read_table(path: Path, item: str) -> dict[str, Any]:
    """The contents of a TOML file, unvalidated. `item` names the file in the one-line InvalidInput."""
    text = ""
    try:
        # Windows editors add a byte-order mark, which TOML does not allow
        text = read_bounded(path).decode("utf-8-sig").replace("\r\n", "\n")
        table = tomllib.loads(text)
        require_shallow(table)
    except FileNotFoundError:
        raise InvalidInput(item, str(path), "there is no such file") from None
    except OSError as error:
        raise InvalidInput(item, str(path), f"the file cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InvalidInput(item, str(path), f"the file is not UTF-8 text (byte {error.start})") from None
    except RecursionError:
        raise InvalidInput(item, str(path), "the file is nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise InvalidInput(item, str(path), f"the file is not valid TOML: {error}{_hint(text, str(error))}") from None
    except ValueError as error:
        raise InvalidInput(item, str(path), str(error)) from None
    # legal in TOML but not accepted: numbers have the same grammar everywhere
    if found := _NO_DECIMAL.search(text):
        raise InvalidInput(f"{path.name}: {found[1]}", found[2], "write a decimal number without underscores")
    return table


def _hint(text: str, error: str) -> str:
    """Hint for an invalid line: the correction if it has a decimal comma."""
    line = re.search(r"at line (\d+)", error)
    lines = text.splitlines()
    if line is None or not 0 < int(line[1]) <= len(lines):
        return ""
    wrong = lines[int(line[1]) - 1].strip()
    found = re.match(r"([\w.]+)\s*=\s*([+-]?\d+),(\d+)", wrong, re.ASCII)
    return f": {wrong}" if found is None else f": {wrong}; a decimal comma? write {found[1]} = {found[2]}.{found[3]}"


def read_configuration(path: str | PathLike[str]) -> BenchConfiguration:
    """The cross-checked configuration in a file, including the contents of the files that it names.

    Raises InvalidInput naming file and key.
    """
    configuration = _read(Path(path))
    for refusal in _refusals(configuration, Path(path)):
        raise refusal
    return configuration


def former_keys(path: str | PathLike[str]) -> tuple[str, ...]:
    """A notice for each key of a configuration file that still has the name used by an earlier version."""
    file = Path(path)
    found = former_names(BenchConfiguration, read_table(file, "configuration file"))
    return tuple(f"{_within(file)(old)} is now called {new}; rename it" for old, new in found)


def problems_of(path: Path) -> list[InvalidInput]:
    """All errors of a configuration file, in single keys or their combination; empty for a valid file.

    Raises InvalidInput if it is not TOML.
    """
    found = problems(BenchConfiguration, read_table(path, "configuration file"), _within(path))
    if found:
        return found
    try:
        return _refusals(_read(path), path)
    except InvalidInput as refusal:
        return [refusal]


def _read(path: Path) -> BenchConfiguration:
    read = validated(BenchConfiguration, read_table(path, "configuration file"), _within(path))
    return _with_certificates(_with_calibration_file(_with_specimen_file(read, path), path), path)


def _refusals(configuration: BenchConfiguration, path: Path) -> list[InvalidInput]:
    found = review(configuration).refusals
    return [InvalidInput(f"{path.name}: {each.item}", each.value, each.allowed) for each in found]


def _with_specimen_file(configuration: BenchConfiguration, path: Path) -> BenchConfiguration:
    """Replace the name of the specimen file, which is relative to the folder of `path`, by its contents.

    Raises InvalidInput if it cannot be read.
    """
    if configuration.specimen_file is None:
        return configuration
    return with_identified(configuration, read_specimen(path.parent / configuration.specimen_file))


def _with_calibration_file(configuration: BenchConfiguration, path: Path) -> BenchConfiguration:
    """Replace the name of the calibration file, relative to the same folder, by its contents.

    Raises InvalidInput if it cannot be read.
    """
    if configuration.laser_calibration is None:
        return configuration
    found = read_calibration(path.parent / configuration.laser_calibration)
    return configuration.model_copy(update={"laser_calibration": None, "calibrated": found})


def _with_certificates(configuration: BenchConfiguration, path: Path) -> BenchConfiguration:
    """Replace the names of the connection's PEM files, relative to the same folder, by their paths."""
    tls = configuration.hardware.daq.tls
    if tls is None:
        return configuration
    names = {name: getattr(tls, name) for name in ("root_certificate", "client_certificate", "client_key")}
    paths = {name: str(path.absolute().parent / each) for name, each in names.items() if each is not None}
    daq = configuration.hardware.daq.model_copy(update={"tls": tls.model_copy(update=paths)})
    return configuration.model_copy(update={"hardware": configuration.hardware.model_copy(update={"daq": daq})})


def with_identified(configuration: BenchConfiguration, identified: Identified) -> BenchConfiguration:
    """The configuration with the given identified properties. Raises InvalidInput if the specimen is impossible."""
    identified.applied(configuration.specimen)
    return configuration.model_copy(update={"specimen_file": None, "identified": identified})


def _within(path: Path) -> Callable[[tuple[str | int, ...]], str]:
    return lambda where: f"{path.name}: {dotted(where)}"


def as_toml(configuration: BenchConfiguration) -> str:
    """All keys with a value, except those of the simulation and hardware tables that the backend does not use."""
    unused = {"rig": {"hardware", "simulation"}, "hardware": {"simulation"}}.get(configuration.table, set[str]())
    plain: dict[str, Any] = configuration.model_dump(mode="json", exclude_none=True, exclude=unused)
    return tomlkit.dumps(plain)


Kind = Literal["all", "minimal", "hardware"]

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
"""Values, in templates, of the keys without a usable default."""

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
    """Write a template of this kind, or for the `backend` of another package.

    Raises InvalidInput if there is no such backend, or if `path` exists or cannot be written.
    """
    if backend is not None:
        settings = load_backend(backend).settings
        if not issubclass(settings, RigSettings):
            raise InvalidInput("--backend", backend, "it is built in: omit it, or use --hardware")
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
    """The lines of a table: its values, groups absent by default, then nested tables."""
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
    """The lines of an absent group, with dotted keys so that each line stays in its table."""
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
