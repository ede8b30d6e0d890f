"""What a run is asked for, from flags and files: refused here, in one line, or complete and valid."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from cyclopts import Parameter

from bench.cli.flags import flag, given
from bench.config.validation import dotted, validated
from sim.errors import InvalidInput
from sim.parameters import Parameters

if TYPE_CHECKING:
    from bench.config.model import BenchConfiguration

P = TypeVar("P", bound=Parameters)

Seed = Annotated[str | None, Parameter(metavar="INT", help="Seed of the simulation, in place of the configuration's.")]
SpecimenFile = Annotated[
    Path | None,
    Parameter(
        metavar="FILE",
        help="Specimen file (JSON) of what has been identified.",
        show_default="the configuration's specimen_file",
    ),
]


def parameters_from(model: type[P], arguments: Mapping[str, Any], file: Path | None) -> P:
    """The parameters of a protocol: flags win over the file, the file over the defaults. Raises InvalidInput."""
    from bench.config.toml import read_table

    flags = given(model, arguments)
    table = read_table(file, "--protocol-file") if file is not None else {}

    def named(path: tuple[str | int, ...]) -> str:
        if path and path[0] in flags:
            return flag(str(path[0]))
        return f"{file.name}: {dotted(path)}" if file is not None else dotted(path)

    return validated(model, {**table, **flags}, named)


def configuration_from(file: Path | None, seed: str | None, specimen: Path | None = None) -> "BenchConfiguration":
    """The configuration of the bench, with the simulation's `seed` and what the file `specimen` says is identified in
    place of its own, where they are given. Raises InvalidInput.
    """
    from bench.config.model import BenchConfiguration, Simulation
    from bench.config.toml import read_configuration, with_identified

    configuration = read_configuration(file) if file is not None else BenchConfiguration()
    if specimen is not None:
        from bench.config.review import review
        from bench.config.specimen_file import read_specimen

        configuration = with_identified(configuration, read_specimen(specimen))
        review(configuration).require()
    if seed is None:
        return configuration
    if configuration.backend != "simulated":
        raise InvalidInput("--seed", seed, f"the backend {configuration.backend} has no seed; leave it out")
    wanted = given(Simulation, {"seed": seed})
    simulation = configuration.simulation.model_dump(mode="json") | wanted
    return configuration.model_copy(update={"simulation": validated(Simulation, simulation, lambda _path: "--seed")})
