"""Configuration files: TOML in SI units, checked completely before anything starts."""

import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench.config.calibration_file import read_calibration
from bench.config.model import BenchConfiguration
from bench.config.review import review
from bench.config.specimen_file import read_specimen
from bench.config.validation import dotted, problems, validated
from sim.errors import InvalidInput
from sim.identified import Identified

_NO_DECIMAL = re.compile(r"""^[ \t]*([\w.-]+)[ \t]*=[^"'#\n]*?(\b0[xob]\w+|\b\d+_\w+)""", re.MULTILINE)
"""A number in a file, hexadecimal, octal, binary or with underscores: its key and itself."""


def read_table(path: Path, item: str) -> dict[str, Any]:
    """The keys of a TOML file, unchecked. `item` names the file in an error: InvalidInput, one line."""
    text = ""
    try:
        # Windows editors put a byte-order mark in front, which TOML does not allow
        text = path.read_text(encoding="utf-8-sig")
        table = tomllib.loads(text)
    except FileNotFoundError:
        raise InvalidInput(item, str(path), "there is no such file") from None
    except OSError as error:
        raise InvalidInput(item, str(path), f"it cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InvalidInput(item, str(path), f"it is not UTF-8 text (byte {error.start})") from None
    except RecursionError:
        raise InvalidInput(item, str(path), "it is nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise InvalidInput(item, str(path), f"it is not TOML: {error}{_hint(text, str(error))}") from None
    # legal in TOML, and refused all the same: numbers are typed in one way everywhere
    if found := _NO_DECIMAL.search(text):
        raise InvalidInput(f"{path.name}: {found[1]}", found[2], "write a decimal number without underscores")
    return table


def _hint(text: str, error: str) -> str:
    """The line that is no TOML, and what to write where it has a decimal comma."""
    line = re.search(r"at line (\d+)", error)
    lines = text.splitlines()
    if line is None or not 0 < int(line[1]) <= len(lines):
        return ""
    wrong = lines[int(line[1]) - 1].strip()
    found = re.match(r"([\w.]+)\s*=\s*([+-]?\d+),(\d+)", wrong, re.ASCII)
    return f": {wrong}" if found is None else f": {wrong}; a decimal comma? write {found[1]} = {found[2]}.{found[3]}"


def read_configuration(path: Path) -> BenchConfiguration:
    """The configuration in a file, with what its files hold in their place, cross-checked as a whole.

    InvalidInput names file and key.
    """
    configuration = _read(path)
    for refusal in _refusals(configuration, path):
        raise refusal
    return configuration


def problems_of(path: Path) -> list[InvalidInput]:
    """Every key of a configuration file that is refused, by itself or beside others; empty when the file is good.

    Raises InvalidInput when it is not TOML at all.
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
    return _with_calibration_file(_with_specimen_file(read, path), path)


def _refusals(configuration: BenchConfiguration, path: Path) -> list[InvalidInput]:
    found = review(configuration).refusals
    return [InvalidInput(f"{path.name}: {each.item}", each.value, each.allowed) for each in found]


def _with_specimen_file(configuration: BenchConfiguration, path: Path) -> BenchConfiguration:
    """What is identified in place of the name of a file with it, which is sought from the folder of `path` on.

    Raises InvalidInput when it cannot be read.
    """
    if configuration.specimen_file is None:
        return configuration
    return with_identified(configuration, read_specimen(path.parent / configuration.specimen_file))


def _with_calibration_file(configuration: BenchConfiguration, path: Path) -> BenchConfiguration:
    """The calibration in place of the name of its file, sought likewise. Raises InvalidInput when it cannot be read."""
    if configuration.laser_calibration is None:
        return configuration
    found = read_calibration(path.parent / configuration.laser_calibration)
    return configuration.model_copy(update={"laser_calibration": None, "calibrated": found})


def with_identified(configuration: BenchConfiguration, identified: Identified) -> BenchConfiguration:
    """With other findings than it had. Raises InvalidInput when such a specimen cannot be."""
    identified.applied(configuration.specimen)
    return configuration.model_copy(update={"specimen_file": None, "identified": identified})


def _within(path: Path) -> Callable[[tuple[str | int, ...]], str]:
    return lambda where: f"{path.name}: {dotted(where)}"
