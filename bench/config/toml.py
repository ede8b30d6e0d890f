"""Configuration files: TOML in SI units, fully validated before anything starts.

A template, written by `bench.config.template`, has every key, the essential keys, the keys of a bench with NI and
optoNCDT devices, or those of a backend of another package. Templates are generated from the declarations, so that keys,
units, limits and defaults are those of the program. Every commented-out line is complete: removing its # sets the key.
"""

import re
import tomllib
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from bench.bounded import read_bounded, require_shallow
from bench.config.model import BenchConfiguration
from bench.config.result_files import read_calibration, read_specimen
from bench.config.review import review
from bench.config.validation import dotted, former_names, problems, validated
from sim.errors import InvalidInput
from sim.identified import Identified

_NO_DECIMAL = re.compile(r"""^[ \t]*([\w.-]+)[ \t]*=[^"'#\n]*?(\b0[xob]\w+|\b\d+_\w+)""", re.MULTILINE)
"""Key and value of a line with a hexadecimal, octal, binary or underscored number."""


def read_table(path: Path, item: str) -> dict[str, Any]:
    """The contents of a TOML file, without validation of its keys. Raises InvalidInput, with `item` as the name of the
    file, if it cannot be read or is not valid TOML.
    """
    text = ""
    try:
        # Windows editors add a byte-order mark, which TOML does not allow
        text = read_bounded(path).decode("utf-8-sig").replace("\r\n", "\n")
        table = tomllib.loads(text)
        require_shallow(table)
    except FileNotFoundError:
        raise InvalidInput(item, str(path), "there is no such file") from None
    except OSError as error:
        raise InvalidInput(
            item, str(path), f"the file cannot be read ({error.strerror}); check its path and permissions"
        ) from None
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
    """Hint for an error in a line: the line, and its correction if it contains a decimal comma."""
    line = re.search(r"at line (\d+)", error)
    lines = text.splitlines()
    if line is None or not 0 < int(line[1]) <= len(lines):
        return ""
    wrong = lines[int(line[1]) - 1].strip()
    found = re.match(r"([\w.]+)\s*=\s*([+-]?\d+),(\d+)", wrong, re.ASCII)
    return f": {wrong}" if found is None else f": {wrong}; a decimal comma? write {found[1]} = {found[2]}.{found[3]}"


def read_configuration(path: str | PathLike[str]) -> BenchConfiguration:
    """The cross-checked configuration in a file, with the contents of its specimen and calibration files.

    Raises InvalidInput naming file and key.
    """
    configuration = _read(Path(path))
    for refusal in _refusals(configuration, Path(path)):
        raise refusal
    return configuration


def former_keys(path: str | PathLike[str]) -> tuple[str, ...]:
    """A notice for each key of a configuration file that has the name used by an earlier version."""
    file = Path(path)
    found = former_names(BenchConfiguration, read_table(file, "configuration file"))
    return tuple(f"{_within(file)(old)} is now called {new}; rename it" for old, new in found)


def problems_of(path: Path) -> list[InvalidInput]:
    """The errors in single keys of a configuration file or, if there are none, in their combination; empty for a valid
    file.

    Raises InvalidInput if the file cannot be read or is not TOML.
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
    for resolve in (_with_specimen_file, _with_calibration_file, _with_table_model, _with_certificates):
        read = resolve(read, path)
    return read


def _refusals(configuration: BenchConfiguration, path: Path) -> list[InvalidInput]:
    found = review(configuration).refusals
    return [InvalidInput(f"{path.name}: {each.item}", each.value, each.allowed) for each in found]


def _with_specimen_file(configuration: BenchConfiguration, path: Path) -> BenchConfiguration:
    """Replace the name of the specimen file, relative to the folder of `path`, by its contents.

    Raises InvalidInput if the file cannot be read or its specimen is impossible.
    """
    if configuration.specimen_file is None:
        return configuration
    return with_identified(configuration, read_specimen(path.parent / configuration.specimen_file))


def _with_calibration_file(configuration: BenchConfiguration, path: Path) -> BenchConfiguration:
    """Replace the name of the calibration file, relative to the folder of `path`, by its contents.

    Raises InvalidInput if it cannot be read.
    """
    if configuration.laser_calibration is None:
        return configuration
    found = read_calibration(path.parent / configuration.laser_calibration)
    return configuration.model_copy(update={"laser_calibration": None, "calibrated": found})


def _with_table_model(configuration: BenchConfiguration, path: Path) -> BenchConfiguration:
    """Replace the name of the table model, relative to the folder of `path`, by its absolute path: the model is read
    when it is used, because its age is checked then.
    """
    if configuration.table_model is None:
        return configuration
    return configuration.model_copy(update={"table_model": str(path.absolute().parent / configuration.table_model)})


def _with_certificates(configuration: BenchConfiguration, path: Path) -> BenchConfiguration:
    """Replace the names of the TLS connection's PEM files, relative to the folder of `path`, by absolute paths."""
    tls = configuration.hardware.daq.tls
    if tls is None:
        return configuration
    names = {name: getattr(tls, name) for name in ("root_certificate", "client_certificate", "client_key")}
    paths = {name: str(path.absolute().parent / each) for name, each in names.items() if each is not None}
    daq = configuration.hardware.daq.model_copy(update={"tls": tls.model_copy(update=paths)})
    return configuration.model_copy(update={"hardware": configuration.hardware.model_copy(update={"daq": daq})})


def with_identified(configuration: BenchConfiguration, identified: Identified) -> BenchConfiguration:
    """The configuration with the given identified properties. Raises InvalidInput for a specimen that is impossible."""
    identified.applied(configuration.specimen)
    return configuration.model_copy(update={"specimen_file": None, "identified": identified})


def _within(path: Path) -> Callable[[tuple[str | int, ...]], str]:
    return lambda where: f"{path.name}: {dotted(where)}"


Kind = Literal["all", "minimal", "hardware"]
