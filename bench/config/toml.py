"""Configuration files: TOML in SI units, checked completely before anything starts."""

import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import tomlkit

from bench.config.calibration_file import read_calibration
from bench.config.declared import Declared, declared, summary
from bench.config.model import BenchConfiguration
from bench.config.specimen_file import read_specimen
from bench.config.validation import dotted, problems, validated
from sim.errors import InvalidInput
from sim.identified import Identified
from sim.parameters import Parameters

_HEADING = """\
# Configuration of a shake-table bench for rockbench. SI units throughout.
# Every key is optional and stands here with its default; above it: what it is [unit], and what it may be.
# A key or table that begins with #, without a space, is absent by default: take the # away to give it."""


def read_table(path: Path, item: str) -> dict[str, Any]:
    """The keys of a TOML file, unchecked. `item` names the file in an error: InvalidInput, one line."""
    text = ""
    try:
        # Windows editors put a byte-order mark in front, which TOML does not allow
        text = path.read_text(encoding="utf-8-sig")
        return tomllib.loads(text)
    except FileNotFoundError:
        raise InvalidInput(item, str(path), "there is no such file") from None
    except OSError as error:
        raise InvalidInput(item, str(path), f"it cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InvalidInput(item, str(path), f"it is not UTF-8 text (byte {error.start})") from None
    except RecursionError:
        raise InvalidInput(item, str(path), "it is nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise InvalidInput(item, str(path), f"it is not TOML: {error}{_comma_hint(text, str(error))}") from None


def _comma_hint(text: str, error: str) -> str:
    """What to write where the line that is no TOML has a decimal comma."""
    line = re.search(r"at line (\d+)", error)
    lines = text.splitlines()
    if line is None or not 0 < int(line[1]) <= len(lines):
        return ""
    found = re.match(r"\s*([\w.]+)\s*=\s*([+-]?\d+),(\d+)", lines[int(line[1]) - 1], re.ASCII)
    return "" if found is None else f"; a decimal comma? write {found[1]} = {found[2]}.{found[3]}"


def read_configuration(path: Path) -> BenchConfiguration:
    """The configuration in a file, with what its files hold in their place. InvalidInput names file and key."""
    read = validated(BenchConfiguration, read_table(path, "configuration file"), _within(path))
    return _with_calibration_file(_with_specimen_file(read, path), path)


def problems_of(path: Path) -> list[InvalidInput]:
    """Every key of a configuration file that is refused; empty when the file is good.

    Raises InvalidInput when it is not TOML at all.
    """
    found = problems(BenchConfiguration, read_table(path, "configuration file"), _within(path))
    if not found:
        try:
            read_configuration(path)
        except InvalidInput as refusal:
            return [refusal]
    return found


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


def write_commented(path: Path) -> None:
    """Write every key with its default, commented. Raises InvalidInput when `path` exists or cannot be written."""
    text = "\n".join([_HEADING, "", *_lines(BenchConfiguration, ())]) + "\n"
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        raise InvalidInput("configuration file", str(path), "it exists already; it is never overwritten") from None
    except OSError as error:
        raise InvalidInput("configuration file", str(path), f"it cannot be written: {error.strerror}") from None


def _within(path: Path) -> Callable[[tuple[str | int, ...]], str]:
    return lambda where: f"{path.name}: {dotted(where)}"


def _lines(model: type[Parameters], path: tuple[str, ...], mark: str = "") -> Iterator[str]:
    """The lines of a group: its values first, as TOML requires, then its nested groups; `mark` comments them out."""
    entries = list(declared(model))
    for entry in entries:
        if entry.group is None:
            yield from _value_lines(entry, mark)
    for entry in entries:
        if entry.group is not None:
            inner = "#" if entry.optional else mark
            here = (*path, entry.name)
            yield ""
            if entry.description:
                yield f"# {entry.description}"
            yield f"# {summary(entry.group)}"
            # a group with values that must be there is not one to uncomment: a run writes it
            required = any(field.is_required() for field in entry.group.model_fields.values())
            yield f"{'# ' if required else inner}[{'.'.join(here)}]"
            yield from _lines(entry.group, here, inner)


def _value_lines(entry: Declared, mark: str) -> Iterator[str]:
    unit = f" [{entry.unit}]" if entry.unit else ""
    yield f"# {entry.description}{unit}; {entry.allowed}"
    if entry.default is None:
        yield f"#{entry.name} = <{entry.allowed}>"
    else:
        value = list(entry.default) if entry.many else entry.default
        yield f"{mark}{entry.name} = {tomlkit.item(value).as_string()}"
