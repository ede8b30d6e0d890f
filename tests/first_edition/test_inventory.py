"""Nothing that the first edition offered is gone: commands, options, keys, settings, tables, exports, sections."""

import json
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.first_edition import inventory
from tests.first_edition.command import DATA, Rockbench

BEFORE: dict[str, Any] = json.loads((DATA / "inventory.json").read_text(encoding="utf-8"))

RENAMED: dict[str, str] = {
    # headings and captions of reports were reworded; every section, table and figure remains
    **json.loads((DATA / "captions.json").read_text(encoding="utf-8")),
    # standard terms; files with the former names are read, with a notice
    "configuration: hardware.hands": "hardware.emulator_address",
    "configuration: hardware.daq.patience": "hardware.daq.timeout_margin",
    "configuration: hardware.lasers.listening": "hardware.lasers.observation_time",
    "configuration: simulation.bench.laser_1.linearity_waves": "simulation.bench.laser_1.linearity_periods",
    "configuration: simulation.bench.laser_2.linearity_waves": "simulation.bench.laser_2.linearity_periods",
}
"""What was renamed since, as "part: name" (such as "commands: run harmonic" or "options: run harmonic --omega") to its
name of today, each with the reason beside it.
"""

CHANGED: dict[str, Any] = {
    # formats are found by entry points, and named in alphabetical order
    "options: export --to: choices": "csv, mat, parquet, uff",
    # the two sets are there, and further devices by name
    "options: emulate --device: choices": (
        "usb, crio, cDAQ-9174, cDAQ-9185, cRIO-9045, cRIO-9049, PCIe-6351, USB-6351"
    ),
    # emulated lasers on network ports, for systems without pseudo-terminals
    "options: emulate --lasers: choices": "serial, socket, analogue",
    "options: emulate --lasers: default": "serial; on Windows socket",
    # so are rig backends: those of other packages have names of their own
    "configuration: backend: allowed": "a text",
    # the profile fast has blocks of 5 ms
    "configuration: acquisition.block_duration: allowed": "a number at least 0.005 and at most 0.2",
    # the same defaults in plainer words
    "options: analyse --out: default": "<name>.analysis-<n>.h5 in the same folder",
    "options: emulate --sample-rate: default": "that of the simulation",
    "options: export --out: default": "<name>-<format> in the folder of FILE",
    "options: gui --config: default": "the paper's specimen on the simulated bench, with a guided tour",
}
"""What another value is meant for today, as "part: name: what" (such as "options: run harmonic --starts: default") to
that value, each with the reason beside it.
"""

QUICK = "check"


def today(part: str, name: str) -> str:
    """What is called `name` in the inventory."""
    return RENAMED.get(f"{part}: {name}", name)


def missing(part: str, before: dict[str, Any], after: dict[str, Any], said: tuple[str, ...]) -> Iterator[str]:
    """What of `before` is not in `after`, and where something of `said` is another one; names may be added."""
    for name, old in before.items():
        new = after.get(today(part, name))
        if new is None:
            yield f"{part}: {name} is missing"
            continue
        for what in said:
            expected = CHANGED.get(f"{part}: {name}: {what}", old.get(what))
            if new.get(what) != expected:
                yield f"{part}: {name}: {what} was {expected!r} and is {new.get(what)!r}"


def each_option(commands: dict[str, Any]) -> dict[str, Any]:
    """All options, by command and first name."""
    return {
        f"{command} {name}".strip(): option
        for command, found in commands.items()
        for name, option in found["options"].items()
    }


@pytest.fixture(scope="module")
def commands() -> dict[str, Any]:
    with pytest.MonkeyPatch.context() as patch:
        # so that nothing in a panel of the help is broken into lines
        patch.setenv("COLUMNS", "1000")
        return inventory.commands()


def test_every_command_is_there(commands: dict[str, Any]) -> None:
    assert len(BEFORE["commands"]) == 38
    assert not list(missing("commands", BEFORE["commands"], commands, ()))


def test_every_option_is_there_with_its_value_unit_default_and_bounds(commands: dict[str, Any]) -> None:
    before, after = each_option(BEFORE["commands"]), each_option(commands)
    assert len(before) > 350
    said = ("names", "value", "unit", "default", "allowed", "choices", "required")
    assert not list(missing("options", before, after, said))


def test_every_key_of_the_configuration_is_there_with_its_unit_default_and_bounds() -> None:
    before, after = BEFORE["configuration"], inventory.configuration()
    assert len(before) == 248
    assert not list(missing("configuration", before, after, ("absent", "default", "unit", "allowed")))


def test_a_configuration_with_every_key_is_still_good(rockbench: Rockbench) -> None:
    done = rockbench("config", "check", DATA / "every_key.toml")
    assert done.code == 0, done.err

    def keys(table: dict[str, Any], path: str = "") -> Iterator[str]:
        for name, value in table.items():
            if isinstance(value, dict):
                yield from keys(value, f"{path}{name}.")
            else:
                yield path + name

    given = tomllib.loads((DATA / "every_key.toml").read_text(encoding="utf-8"))
    files = {"specimen_file", "laser_calibration", "table_model"}
    protocols = {f"{table}.{key}" for table in ("specimen", "simulation.specimen") for key in ("beta", "spring_label")}
    assert {*keys(given)} == BEFORE["configuration"].keys() - files - protocols


@pytest.mark.parametrize("name", sorted(BEFORE["exports"]))
def test_every_setting_of_an_analysis_is_there(name: str, unpacked: Callable[[str], Path]) -> None:
    before = BEFORE["settings"]["every file"] | BEFORE["settings"][name]
    after = inventory.settings(unpacked(name))
    gone = {key: unit for key, unit in before.items() if after.get(today("settings", key)) != unit}
    assert not gone


def cases(names: list[str]) -> list[Any]:
    return [pytest.param(name, marks=() if name == QUICK else pytest.mark.soak) for name in names]


@pytest.mark.parametrize("name", cases(sorted(BEFORE["exports"])))
@pytest.mark.parametrize("to", inventory.FORMATS)
def test_every_file_of_an_export_is_there(name: str, to: str, unpacked: Callable[[str], Path], tmp_path: Path) -> None:
    after = inventory.exported(unpacked(name), to, tmp_path)
    assert {today("exports", file) for file in BEFORE["exports"][name][to]} <= {*after}


@pytest.mark.parametrize("name", cases(sorted(BEFORE["reports"])))
def test_every_section_table_and_figure_of_a_report_is_there(
    name: str, unpacked: Callable[[str], Path], tmp_path: Path
) -> None:
    after = inventory.report(unpacked(name), tmp_path)
    for part, before in BEFORE["reports"][name].items():
        assert [text for text in before if today(part, text) not in after[part]] == []
