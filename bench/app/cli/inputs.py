"""Validation of a command's inputs from flags and files: parameters, configuration, specimen and records."""

import sys
from collections.abc import Mapping, Sequence
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from bench.app.cli.output import print_warning
from bench.config.declared import flag
from bench.config.validation import dotted, read_fields, validated
from sim.errors import InvalidInput
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.accelerograms.accelerogram import Accelerogram
    from bench.config.model import BenchConfiguration
    from bench.config.sections import Profile
    from sim.knowledge import SpecimenKnowledge
    from sim.specimen import Specimen

P = TypeVar("P", bound=Parameters)

MOST_POINTS = 1_000_000
"""Maximum number of points, the product of the numbers of values of all ranges; a larger number is probably a typing
error.
"""

SPECIMEN_FILE = ".json"
"""Extension of a specimen file, which holds identified properties."""

_AXES = ("omega", "beta", "corner")

_OF_SPECIMEN: dict[tuple[str | int, ...], str] = {
    ("d",): "--distance",
    ("block", "restitution_factor"): "--restitution-factor",
}


def parameters_from(model: type[P], arguments: Mapping[str, Any], file: Path | None) -> P:
    """The parameters of a protocol: flags override the file, the file overrides the defaults. Raises InvalidInput."""
    from bench.config.toml import read_table

    flags = read_fields(model, arguments)
    table = read_table(file, "--protocol-file") if file is not None else {}

    def named(path: tuple[str | int, ...]) -> str:
        if path and path[0] in flags:
            return flag(str(path[0]))
        return f"{file.name}: {dotted(path)}" if file is not None else dotted(path)

    return validated(model, {**table, **flags}, named)


def configuration_from(file: Path | None, seed: str | None, specimen: Path | None = None) -> "BenchConfiguration":
    """The configuration of the bench; `seed` and the identified properties in the file `specimen`, if given, replace
    those of the configuration. Raises InvalidInput.
    """
    from bench.config.model import BenchConfiguration
    from bench.config.sections import Simulation
    from bench.config.toml import former_keys, read_configuration, with_identified

    configuration = read_configuration(file) if file is not None else BenchConfiguration()
    for notice in former_keys(file) if file is not None else ():
        print_warning(notice)
    if specimen is not None:
        from bench.config.result_files import read_specimen
        from bench.config.review import review

        configuration = with_identified(configuration, read_specimen(specimen))
        review(configuration).require()
    if seed is None:
        return configuration
    if configuration.backend != "simulated":
        raise InvalidInput("--seed", seed, f"the backend {configuration.backend} has no seed; omit it")
    wanted = read_fields(Simulation, {"seed": seed})
    simulation = configuration.simulation.model_dump(mode="json") | wanted
    return configuration.model_copy(update={"simulation": validated(Simulation, simulation, lambda _path: "--seed")})


def with_profile(configuration: "BenchConfiguration", profile: "Profile | None") -> "BenchConfiguration":
    """The configuration with the timing of a profile. Raises InvalidInput if the devices do not allow it."""
    if profile is None:
        return configuration
    from bench.config.model import BenchConfiguration
    from bench.config.sections import acquisition_of

    networked = configuration.backend == "hardware" and configuration.hardware.daq.server is not None
    timing = acquisition_of(profile, networked=networked)
    data = configuration.model_dump(mode="json") | {"acquisition": timing.model_dump(mode="json")}
    return validated(BenchConfiguration, data, lambda path: f"--profile {profile}: {dotted(path)}")


def request_from(model: type[P], arguments: Mapping[str, Any]) -> P:
    """The request of type `model` that the flags specify. Raises InvalidInput."""
    wanted = read_fields(model, arguments)
    axes = [name for name in _AXES if name in wanted]
    points = prod(len(wanted[name]) for name in axes)
    if points > MOST_POINTS:
        raise InvalidInput(
            " times ".join(flag(name) for name in axes),
            points,
            f"at most {MOST_POINTS} points are allowed; specify fewer",
        )

    def named(path: tuple[str | int, ...]) -> str:
        return flag(str(path[0])) if path else dotted(path)

    return validated(model, wanted, named)


def warn_of_unusual(request: Parameters, specimen: "Specimen") -> None:
    """Print a warning for each valid but unusual value."""
    from bench.config.usual import notices_of, specimen_notices

    for notice in (*notices_of(request, specimen), *specimen_notices(specimen)):
        print_warning(notice)


def known_from(
    file: Path | None, restitution_factor: str | None, configuration: "BenchConfiguration | None" = None
) -> "SpecimenKnowledge":
    """The specimen's properties with their uncertainty, from a specimen file or the configuration. Raises
    InvalidInput.
    """
    from bench.config.model import BenchConfiguration
    from sim.identified import Identified

    known = (configuration or BenchConfiguration()).known
    if file is not None:
        from bench.config.result_files import read_specimen

        identified = read_specimen(file) if file.suffix == SPECIMEN_FILE else Identified()
        known = known.model_copy(update={"identified": identified})
    if restitution_factor is None:
        return known
    return known.model_copy(update={"identified": known.identified.without("restitution_factor")})


def specimen_from(
    file: Path | None,
    distance: str | None,
    restitution_factor: str | None,
    assumed: "Specimen | None" = None,
    known: "SpecimenKnowledge | None" = None,
) -> "Specimen":
    """The specimen: flags override the file, the file overrides the `assumed` specimen or the paper's; identified
    properties from `known_from` replace assumed ones. Raises InvalidInput.
    """
    from sim.specimen import Block, Specimen

    table = assumed.model_dump(mode="json") if assumed is not None else {}
    if file is not None and file.suffix != SPECIMEN_FILE:
        from bench.config.toml import read_table

        table = read_table(file, "--specimen")
    if distance is not None:
        table["d"] = read_fields(Specimen, {"d": distance})["d"]
    if restitution_factor is not None and isinstance(table.setdefault("block", {}), dict):
        table["block"]["restitution_factor"] = read_fields(Block, {"restitution_factor": restitution_factor})[
            "restitution_factor"
        ]
    flags = {
        path for path, value in zip(_OF_SPECIMEN, (distance, restitution_factor), strict=True) if value is not None
    }

    def named(path: tuple[str | int, ...]) -> str:
        if path in flags:
            return _OF_SPECIMEN[path]
        return f"{file.name}: {dotted(path)}" if file is not None else dotted(path)

    specimen = validated(Specimen, table, named)
    identified = known_from(file, restitution_factor).identified if known is None else known.identified
    return identified.applied(specimen)


def records_from(files: Sequence[str]) -> "tuple[Accelerogram, ...]":
    """The records named on the command line, or the seven synthetic ones. Raises InvalidInput."""
    from bench.accelerograms.reference import RecordReference, read_records
    from bench.accelerograms.synthetic import NAMES

    named = files or [f"synthetic:{name}" for name in NAMES]
    return read_records([RecordReference.parse(text) for text in named])


def named_records(named: Sequence[str]) -> list[str]:
    """References to records, with each folder replaced by the complete records in it; its other files are listed on
    standard error. Raises InvalidInput for a folder without records.
    """
    from bench.accelerograms.reference import RecordReference

    found: list[str] = []
    for text in named:
        folder = Path(text)
        if not folder.is_dir():
            found.append(text)
            continue
        good: list[str] = []
        for path in sorted(file for file in folder.iterdir() if file.is_file() and not file.name.startswith(".")):
            try:
                RecordReference.parse(str(path)).read()
            except InvalidInput as refused:
                print(f"rockbench: skipped: {refused}", file=sys.stderr)
            else:
                good.append(str(path))
        if not good:
            raise InvalidInput("--records", text, "no file in this folder is a complete record; choose another folder")
        found += good
    return found
